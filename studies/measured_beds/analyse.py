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
DENSITIES = (0.52, 0.74)
ALIKE = 3.0
"""k_s/k_f below which the conductivity is computed by voxels."""
NAMES = {item.name for item in fields(Conditions)}


def conditions(measured: Measured, point: Point, assumed: dict[str, float]) -> Conditions:
    """Inputs of one point: known, as the row gives them, and assumed."""
    values = {**measured.known, **assumed}
    porosity = values.pop("porosity", None)
    for name in ("temperature", "pressure"):
        given = getattr(point, name)
        if given is not None and (name == "pressure" or name not in measured.known):
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
    if point.contrast is not None and point.contrast < ALIKE:  # contacts hardly matter, only the density
        found = [bed.by_voxels(point.contrast) for bed in beds]
        return min(found), float(np.mean(found)), max(found)
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


def sensitivities(measured: Measured, beds: list[Bed]) -> dict[str, float]:
    """d ln k / d ln x of every number, at the middle point of the set; of the density with its coordination."""
    bed = beds[len(beds) // 2]
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
    loose, dense = beds[0], beds[-1]
    found["density"] = float(
        np.log(dense.conductivity(base) / loose.conductivity(base)) / np.log(dense.density / loose.density)
    )
    return found


def bounds_of(contrast: float) -> tuple[float, float]:
    """Least lower and largest upper Hashin-Shtrikman bound of k/k_f over the densities of beds, `DENSITIES`."""
    phi = np.linspace(*DENSITIES, 50)
    fluid = 1.0 + phi / (1.0 / (contrast - 1.0) + (1.0 - phi) / 3.0)
    solid = contrast + (1.0 - phi) / (1.0 / (1.0 - contrast) + phi / (3.0 * contrast))
    return float(min(fluid.min(), solid.min())), float(max(fluid.max(), solid.max()))


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
            _summary(measured, rows, sensitivities(measured, beds))


def _summary(measured: Measured, rows: list[tuple[float, float, float]], slopes: dict[str, float]) -> None:
    off = np.array([best / point.measured - 1.0 for point, (_, best, _) in zip(measured.points, rows, strict=True)])
    off = off[np.isfinite(off)]
    inside = sum(low <= point.measured <= high for point, (low, _, high) in zip(measured.points, rows, strict=True))
    print(
        f"{measured.key:18s}{off.size:4d} points, {inside} in the band; misfit median {100 * np.median(off):+.0f} %, "
        f"{100 * off.min():+.0f} to {100 * off.max():+.0f} %, {int((np.abs(off) <= 0.15).sum())} within 15 %; "
        "d ln k/d ln x: " + ", ".join(f"{name} {value:+.2f}" for name, value in slopes.items())
    )
    for point in measured.points:
        if point.contrast is not None:
            low, high = bounds_of(point.contrast)
            if not low <= point.measured <= high:
                print(
                    f"  measured {point.measured:g} at k_s/k_f = {point.contrast:g}: no bed of a density of "
                    f"{DENSITIES[0]:g} to {DENSITIES[1]:g} conducts less than {low:.3f} or more than {high:.3f}"
                )


if __name__ == "__main__":
    main(*sys.argv[1:])
