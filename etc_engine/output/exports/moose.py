"""MOOSE: functions of temperature and the material that evaluates them, as input blocks."""

from __future__ import annotations

import re

from etc_engine.output.exports.curves import Curve, Source, described
from etc_engine.output.exports.fit import fit_curve


def to_moose(curves: list[Curve], source: Source) -> str:
    """Text of a MOOSE input: [Functions] with a table and a polynomial for each curve, and [Materials].

    The time argument ``t`` of a function carries the temperature, as `HeatConductionMaterial` asks for.
    """
    lines = [f"# {line}" for line in source.lines]
    lines.append("# In functions, t is the temperature [K]: HeatConductionMaterial passes it as the time.")
    stem = re.sub(r"\W+", "_", source.study).strip("_") or "bed"
    names = [stem if len(curves) == 1 else f"{stem}_{i}" for i in range(len(curves))]
    functions, materials = [], []
    for name, curve in zip(names, curves, strict=True):
        if curve.temperature.size > 1:
            functions += _functions(name, curve)
            materials += _material(name, curve, "HeatConductionMaterial", f"{name}_table")
        else:
            materials += _constant(name, curve)
    if functions:
        lines += ["[Functions]", *functions, "[]"]
    lines += ["[Materials]", *materials, "[]"]
    return "\n".join(lines) + "\n"


def _functions(name: str, curve: Curve) -> list[str]:
    fit = fit_curve(curve)
    polynomial = " + ".join(f"({c:.17g})" + ("" if n == 0 else f"*t^{n}") for n, c in enumerate(fit.coefficients))
    return [
        f"  [{name}_table]",
        f"    # {described(curve)}; half-widths {_row(curve.half_width, '.3g')}",
        "    type = PiecewiseLinear",
        f"    x = '{_row(curve.temperature)}' # K",
        f"    y = '{_row(curve.conductivity)}' # W/(m K)",
        "  []",
        f"  [{name}_fit]",
        *(f"    # {line}" for line in fit.lines),
        "    type = ParsedFunction",
        f"    expression = '{polynomial}'",
        "  []",
    ]


def _material(name: str, curve: Curve, kind: str, function: str) -> list[str]:
    return [
        f"  [{name}]",
        f"    # {described(curve)}; set temp to your temperature variable",
        f"    type = {kind}",
        "    temp = temperature",
        f"    thermal_conductivity_temperature_function = {function}",
        "  []",
    ]


def _constant(name: str, curve: Curve) -> list[str]:
    at = f"; at {curve.temperature[0]:g} K" if curve.temperature.size else ""
    return [
        f"  [{name}]",
        f"    # {described(curve)}{at}; half-width {curve.half_width[0]:.3g} W/(m K)",
        "    type = GenericConstantMaterial",
        "    prop_names = 'thermal_conductivity'",
        f"    prop_values = '{float(curve.conductivity[0]):.17g}' # W/(m K)",
        "  []",
    ]


def _row(values: object, form: str = ".17g") -> str:
    return " ".join(format(float(value), form) for value in values)  # type: ignore[attr-defined]
