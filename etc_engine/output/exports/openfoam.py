"""OpenFOAM: the transport dictionary of a solid, polynomial in temperature."""

from __future__ import annotations

from etc_engine.output.exports.curves import Curve, Source, described, only_curve
from etc_engine.output.exports.fit import MAX_ORDER, fit_curve


def to_openfoam(curves: list[Curve], source: Source) -> str:
    """Text of a dictionary with the sub-dictionary ``transport`` of a solid's ``mixture``.

    For ``transport polynomial;`` it holds ``kappaCoeffs<8>``, for ``transport constIso;`` (no temperature) ``kappa``.

    Raises
    ------
    InputError
        If the result has more than one curve.
    """
    curve = only_curve(curves, "an OpenFOAM dictionary")
    lines = [
        "FoamFile",
        "{",
        "    version     2.0;",
        "    format      ascii;",
        "    class       dictionary;",
        '    location    "constant";',
        "    object      bedTransport;",
        "}",
        *(f"// {line}" for line in source.lines),
        f"// {described(curve)}",
    ]
    if curve.temperature.size > 1:
        fit = fit_curve(curve)
        coefficients = [*(float(c) for c in fit.coefficients), *[0.0] * (MAX_ORDER - fit.order)]
        lines += [f"// {line}" for line in fit.lines]
        points = zip(curve.temperature, curve.conductivity, curve.half_width, strict=True)
        lines += [f"// {t:g} K: {k:.9g} +- {h:.2g} W/(m K)" for t, k, h in points]
        lines += [
            '// In thermophysicalProperties: transport polynomial; and in mixture: #include "bedTransport"',
            "transport",
            "{",
            f"    kappaCoeffs<{MAX_ORDER + 1}> ({' '.join(f'{c:.17g}' for c in coefficients)});",
            "}",
        ]
    else:
        lines += [
            f"// half-width {curve.half_width[0]:.3g} W/(m K)",
            '// In thermophysicalProperties: transport constIso; and in mixture: #include "bedTransport"',
            "transport",
            "{",
            f"    kappa           {float(curve.conductivity[0]):.17g};",
            "}",
        ]
    return "\n".join(lines) + "\n"
