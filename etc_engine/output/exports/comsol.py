"""COMSOL Multiphysics: the text file of an interpolation function (format Spreadsheet)."""

from __future__ import annotations

import numpy as np

from etc_engine.errors import InputError
from etc_engine.output.exports.curves import PRESSURE, Curve, Source, described
from etc_engine.output.exports.fit import fit_curve


def to_comsol(curves: list[Curve], source: Source) -> str:
    """Text of an interpolation file: columns of arguments, then of functions; comments begin with ``%``.

    Arguments are the temperature (and the pressure, if it varies); functions are the conductivity and the ends of
    its interval. Load it under Global Definitions, Functions, Interpolation, Data source: File, with as many
    arguments as the header names.

    Raises
    ------
    InputError
        If anything but temperature and pressure varies, or nothing does.
    """
    varying = [name for name in curves[0].at if len({str(curve.at.get(name)) for curve in curves}) > 1]
    foreign = [name for name in varying if name != PRESSURE]
    if foreign:
        raise InputError(
            f"a COMSOL file has temperature and pressure as arguments, this result also varies {', '.join(foreign)}: "
            "fix it with --at NAME=VALUE"
        )
    arguments = (["T"] if curves[0].temperature.size else []) + (["p"] if varying else [])
    if not arguments:
        raise InputError(
            "an interpolation function needs an argument: this result has neither temperature nor pressure"
        )
    with_ends = all(np.isfinite(curve.half_width).all() for curve in curves)
    lines = [f"% {line}" for line in source.lines]
    for curve in curves:
        lines += [f"% {described(curve)}", *_fitted(curve)]
    if not with_ends:
        lines.append("% No interval: some cells have a single realization.")
    columns = [*arguments, "k", *(["k_low", "k_high"] if with_ends else [])]
    lines.append(f"% {' '.join(columns)}  (number of arguments: {len(arguments)})")
    for curve in curves:
        for i, k in enumerate(curve.conductivity):
            row = [float(curve.temperature[i])] if curve.temperature.size else []
            row += [float(curve.at[PRESSURE])] if varying else []
            row.append(float(k))
            if with_ends:
                row += [float(k - curve.half_width[i]), float(k + curve.half_width[i])]
            lines.append(" ".join(f"{value:.17g}" for value in row))
    return "\n".join(lines) + "\n"


def _fitted(curve: Curve) -> list[str]:
    if curve.temperature.size < 2:
        return []
    fit = fit_curve(curve)
    terms = [f"({c:.17g})" + ("" if n == 0 else f"*(T/1[K])^{n}") for n, c in enumerate(fit.coefficients)]
    return [*(f"% {line}" for line in fit.lines), f"% expression: ({' + '.join(terms)})[W/(m*K)]"]
