"""Conductivity over temperature and pressure for other programs: a format is one function and one row."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from etc_engine.output.exports.comsol import to_comsol
from etc_engine.output.exports.curves import Curve, Source, curves_of
from etc_engine.output.exports.fit import Fit, fit_curve
from etc_engine.output.exports.moose import to_moose
from etc_engine.output.exports.openfoam import to_openfoam
from etc_engine.output.exports.spreadsheet import to_csv

__all__ = ["EXPORTS", "Curve", "Fit", "Source", "curves_of", "fit_curve"]

EXPORTS: Mapping[str, Callable[[list[Curve], Source], str]] = MappingProxyType(
    {"csv": to_csv, "moose": to_moose, "comsol": to_comsol, "openfoam": to_openfoam}
)
