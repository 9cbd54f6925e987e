"""Measured beds beside computed ones: ``python analyse.py beds results.csv``; ``plot.py`` draws them.

Every point is computed on the beds of ``make_beds.py``: with the best estimate of the assumed inputs, and a band
between the ends of their ranges, each end on the side where it lowers or raises the conductivity. Nothing is fitted.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
from bed import Bed, Conditions
from sets import Measured, Point, read, titanate

HERE = Path(__file__).parent
NAMES = {item.name for item in fields(Conditions)}


def conditions(measured: Measured, point: Point, assumed: dict[str, float]) -> Conditions:
    """Inputs of one point: known, as the row gives them, and assumed."""
    values = {**measured.known, **assumed}
    porosity = values.pop("porosity", None)
    for name in ("temperature", "pressure"):
        given = getattr(point, name)
        if given is not None:
            values[name] = given
    if point.contrast is not None:
        values |= {"solid": point.contrast, "fluid": 1.0, "pressure": 1e5}
    elif point.solid is not None:
        values["solid"] = point.solid
    elif porosity is not None:
        values["solid"] = titanate(values["temperature"], porosity)
    return Conditions(
        gas=point.gas if values["pressure"] > 0.0 else None, **{k: v for k, v in values.items() if k in NAMES}
    )


def compute(measured: Measured, point: Point, beds: list[Bed]) -> tuple[float, float, float]:
    """(low, best, high) [W/(m K)]: mean over the beds of the best, ends over beds and assumed inputs."""
    if point.contrast is not None and point.contrast < 1.0:
        return np.nan, np.nan, np.nan  # facet links need solids that conduct at least as well as the fluid
    best = {name: item[1] for name, item in measured.assumed.items()}
    centre = beds[len(beds) // 2]
    reference = centre.conductivity(conditions(measured, point, best))
    ends: dict[int, dict[str, float]] = {-1: dict(best), 1: dict(best)}
    for name, (low, _, high) in measured.assumed.items():
        for value in (low, high):
            k = centre.conductivity(conditions(measured, point, {**best, name: value}))
            side = 1 if k > reference else -1
            if abs(k - reference) > 1e-6 * reference:
                ends[side][name] = value
    values = [bed.conductivity(conditions(measured, point, best)) for bed in beds]
    low = min(bed.conductivity(conditions(measured, point, ends[-1])) for bed in (beds[0], beds[-1]))
    high = max(bed.conductivity(conditions(measured, point, ends[1])) for bed in (beds[0], beds[-1]))
    return low, float(np.mean(values)), high


def sensitivities(measured: Measured, bed: Bed) -> dict[str, float]:
    """d ln k / d ln x of every number, at the middle point of the set."""
    point = measured.points[len(measured.points) // 2]
    best = {name: item[1] for name, item in measured.assumed.items()}
    base = conditions(measured, point, best)
    k = bed.conductivity(base)
    found = {}
    for name in ("solid", "temperature", "pressure", "diameter", "emissivity", "accommodation", "load", "roughness"):
        value = getattr(base, name)
        if not value:
            continue
        step = 0.9 if name in ("emissivity", "accommodation") else 1.1
        varied = Conditions(**{**{f.name: getattr(base, f.name) for f in fields(Conditions)}, name: step * value})
        found[name] = float(np.log(bed.conductivity(varied) / k) / np.log(step))
    return found


def main(folder: str, table: str) -> None:
    beds = sorted((Bed(path) for path in sorted(Path(folder).glob("*.dump"))), key=lambda bed: bed.density)
    print("beds:", ", ".join(f"{bed.density:.3f} (Z = {bed.coordination:.2f})" for bed in beds))
    sets = read(HERE / "measured.csv")
    with Path(table).open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["set", "temperature", "pressure", "contrast", "gas", "measured", "low", "computed", "high"])
        for measured in sets:
            rows = [compute(measured, point, beds) for point in measured.points]
            for point, (low, best, high) in zip(measured.points, rows, strict=True):
                values = [point.temperature, point.pressure, point.contrast, point.gas, point.measured]
                out.writerow(
                    [
                        measured.key,
                        *("" if v is None else v for v in values),
                        f"{low:.5g}",
                        f"{best:.5g}",
                        f"{high:.5g}",
                    ]
                )
            _summary(measured, rows, sensitivities(measured, beds[len(beds) // 2]))


def _summary(measured: Measured, rows: list[tuple[float, float, float]], slopes: dict[str, float]) -> None:
    off = np.array([best / point.measured - 1.0 for point, (_, best, _) in zip(measured.points, rows, strict=True)])
    off = off[np.isfinite(off)]
    inside = sum(low <= point.measured <= high for point, (low, _, high) in zip(measured.points, rows, strict=True))
    print(
        f"{measured.key:18s}{off.size:4d} points, {inside} in the band; misfit median {100 * np.median(off):+.0f} %, "
        f"{100 * off.min():+.0f} to {100 * off.max():+.0f} %; d ln k/d ln x: "
        + ", ".join(f"{name} {value:+.2f}" for name, value in slopes.items())
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
