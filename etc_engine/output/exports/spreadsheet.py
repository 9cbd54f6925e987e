"""Comma-separated values: every cell with its interval."""

from __future__ import annotations

from math import isfinite

from etc_engine.output.exports.curves import Curve, Source, described
from etc_engine.output.exports.fit import fit_curve
from etc_engine.study.quantities import readable


def to_csv(curves: list[Curve], source: Source) -> str:
    """Text of a CSV file; comments begin with ``#``.

    Columns: the coordinates of the sweep, temperature, conductivity, the ends of its interval (empty for a single
    realization), realizations.
    """
    lines = [f"# {line}" for line in source.lines]
    for curve in curves:
        if curve.temperature.size > 1:
            fit = fit_curve(curve)
            coefficients = ", ".join(f"{c:.9g}" for c in fit.coefficients)
            lines.append(f"# {described(curve)}: k = sum c_n T^n, c = [{coefficients}]. {fit.lines[0]}")
    names = list(curves[0].at)
    has_temperature = curves[0].temperature.size > 0
    header = [*names, *(["temperature"] if has_temperature else [])]
    header = [f"{name} [{readable(source.units[name])}]" if name in source.units else name for name in header]
    lines.append(",".join([*header, "conductivity [W/(m K)]", "low [W/(m K)]", "high [W/(m K)]", "count"]))
    for curve in curves:
        for i, k in enumerate(curve.conductivity):
            where = [_word(curve.at[name]) for name in names]
            if has_temperature:
                where.append(repr(float(curve.temperature[i])))
            half = float(curve.half_width[i])
            ends = [repr(float(k) - half), repr(float(k) + half)] if isfinite(half) else ["", ""]
            lines.append(",".join([*where, repr(float(k)), *ends, str(int(curve.count[i]))]))
    return "\n".join(lines) + "\n"


def _word(value: object) -> str:
    return repr(value) if isinstance(value, float) else str(value)
