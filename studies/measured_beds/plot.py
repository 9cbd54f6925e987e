"""The figure of measured and computed beds: ``python plot.py results.csv figure.png``"""

from __future__ import annotations

import csv
import sys
import textwrap
from collections import defaultdict
from pathlib import Path

import numpy as np
from sets import SETS

from etc_engine.output.figures.canvas import COLOURS, INK, TEXT, legend, new_panels, save

AXES = {"li4sio4_pressure": "pressure", "dimensionless": "contrast", "aquaro": "row"}
LABELS = {"contrast": "$k_s/k_f$", "pressure": "p [Pa]", "temperature": "T [K]", "row": "row (no temperature given)"}


def main(table: str, picture: str) -> None:
    rows: dict[str, list[dict[str, str]]] = defaultdict(list)
    with Path(table).open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            rows[row["set"]].append(row)
    figure, panels = new_panels(3, 3, 2.9)
    for measured, panel in zip(SETS, panels, strict=False):
        axis, found = AXES.get(measured.key, "temperature"), rows[measured.key]
        x = np.array([i if axis == "row" else float(row[axis] or 300.0) for i, row in enumerate(found)])
        low, best, high, real = ([float(row[k]) for row in found] for k in ("low", "computed", "high", "measured"))
        order = np.argsort(x, kind="stable")
        low, best, high = (np.array(values)[order] for values in (low, best, high))
        if len(found) == 1 or axis == "row":
            spread = [best - low, high - best]
            panel.errorbar(x[order], best, spread, fmt="o", ms=3, color=COLOURS[0], alpha=0.5)
        else:
            panel.fill_between(x[order], low, high, color=COLOURS[0], alpha=0.2, lw=0)
            panel.plot(x[order], best, color=COLOURS[0])
        panel.plot(x, real, ".", color=INK, ms=4)
        if axis in ("contrast", "pressure"):
            panel.set_xscale("log")
        if axis == "contrast":
            panel.set_yscale("log")
        panel.set_title(textwrap.fill(measured.title, 30), fontsize=TEXT)
        panel.set_xlabel(LABELS[axis])
        panel.set_ylabel("$k/k_f$" if axis == "contrast" else "k [W/(m K)]")
    key = panels[len(SETS)]
    key.set_axis_off()
    key.plot([], [], ".", color=INK, label="measured")
    key.plot([], [], color=COLOURS[0], label="computed, best estimate")
    key.fill_between([], [], color=COLOURS[0], alpha=0.2, label="ends of the assumed inputs")
    legend(key, loc="center")
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
