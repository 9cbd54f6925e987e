"""The measured sets, what is known of each, and what had to be assumed, with a range."""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from etc_engine.errors import InputError
from etc_engine.materials import find_solid
from etc_engine.materials.solids import lithium_titanate_conductivity

Row = Mapping[str, str]
Range = tuple[float, float, float]  # low, best, high


@dataclass(frozen=True)
class Point:
    """One measured value."""

    temperature: float | None
    pressure: float | None
    contrast: float | None
    solid: float | None
    measured: float
    gas: str | None


@dataclass(frozen=True)
class Measured:
    """A set: its points, the inputs that its source gives, and the assumed ones as (low, best, high)."""

    key: str
    title: str
    gas: str | None
    known: Mapping[str, float]
    assumed: Mapping[str, Range]
    missing: str
    belongs: Callable[[Row], bool]
    points: tuple[Point, ...] = field(default=())


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


GASES = {"He": "helium", "N2": "nitrogen", "air": "air"}
PEBBLE = {  # lithium ceramics: modulus as Van Lew (2016) takes it for a pebble, load and asperities unknown
    "load": (1e3, 3e5, 6e6),
    "accommodation": (0.2, 0.43, 0.9),
    "emissivity": (0.6, 0.8, 0.95),
    "roughness": (2e-7, 0.0, 0.0),
}
SETS = (
    Measured(
        "li4sio4_pressure",
        "Li4SiO4 in helium, 519 °C, over pressure (Enoeda 2001)",
        "helium",
        {"youngs_modulus": 60e9, "poisson_ratio": 0.24},
        {**PEBBLE, "solid": (1.8, 2.3, 2.8), "diameter": (0.25e-3, 0.5e-3, 0.65e-3)},
        "sintering of contacts; the size distribution of the pebbles",
        lambda r: r["solid"] == "Li4SiO4" and r["fluid"].startswith("He"),
    ),
    Measured(
        "aquaro",
        "Li4SiO4 and Li2TiO3 in air and vacuum (Aquaro and Zaccari 2007)",
        None,
        {"youngs_modulus": 90e9, "poisson_ratio": 0.24},
        {
            **PEBBLE,
            "solid": (1.8, 2.4, 3.0),
            "diameter": (0.25e-3, 0.7e-3, 1.2e-3),
            "temperature": (300.0, 600.0, 900.0),
        },
        "the temperature of each point is not given",
        lambda r: r["reference"].startswith("Aquaro"),
    ),
    Measured(
        "sana_helium",
        "SANA, 60 mm graphite in helium (Niessen and Ball 2000)",
        "helium",
        {"diameter": 0.06, "pressure": 1e5, "accommodation": 0.4, "youngs_modulus": 1e10, "poisson_ratio": 0.2},
        {"load": (1e3, 5e3, 2e4), "emissivity": (0.6, 0.8, 0.95), "roughness": (5e-6, 0.0, 0.0)},
        "natural convection in cold nitrogen, 9 to 18 % of the radiation (past the neighbours); the rest is unknown",
        lambda r: "SANA" in r["reference"] and r["fluid"] == "He",
    ),
    Measured(
        "sana_nitrogen",
        "SANA, 60 mm graphite in nitrogen (Niessen and Ball 2000)",
        "nitrogen",
        {"diameter": 0.06, "pressure": 1e5, "accommodation": 0.8, "youngs_modulus": 1e10, "poisson_ratio": 0.2},
        {"load": (1e3, 5e3, 2e4), "emissivity": (0.6, 0.8, 0.95), "roughness": (5e-6, 0.0, 0.0)},
        "natural convection in cold nitrogen, 9 to 18 % of the radiation (past the neighbours); the rest is unknown",
        lambda r: "SANA" in r["reference"] and r["fluid"] == "N2",
    ),
    Measured(
        "comet",
        "COMET, 1 mm graphite in helium (Van Lew 2016)",
        "helium",
        {"diameter": 1e-3, "pressure": 1e5, "youngs_modulus": 1e10, "poisson_ratio": 0.2},
        {
            "load": (1e2, 3e3, 1e5),
            "accommodation": (0.2, 0.4, 0.9),
            "emissivity": (0.6, 0.8, 0.95),
            "roughness": (1e-5, 2e-6, 0.0),
        },
        "waviness and facets of ground pebbles",
        lambda r: "COMET" in r["reference"],
    ),
    Measured(
        "dimensionless",
        "25 dimensionless points (van Antwerpen and others 2010)",
        None,
        {"diameter": 1e-2, "temperature": 300.0, "emissivity": 0.0, "accommodation": 1.0, "roughness": 0.0},
        {"load": (1e2, 1e4, 1e6), "youngs_modulus": (2e11, 2e11, 2e11)},
        "porosity, load and material of each point are not kept in the source",
        lambda r: r["reference"].startswith("compilation"),
    ),
    Measured(
        "beaulieu",
        "6.4 mm steel in air at room temperature (Beaulieu 2020)",
        "air",
        # inputs of the example 3d-heated-packed-bed of github:chaos-polymtl/lethe, from which the value was derived:
        # gas of 0.027 W/(m K) (air at 310 K, the mean of 20 and 53 C), roughness 19 nm and slope 0.056 of each surface
        {
            "temperature": 309.65,
            "diameter": 6.4e-3,
            "pressure": 101325.0,
            "accommodation": 0.7,
            "youngs_modulus": 2e11,
            "poisson_ratio": 0.29,
            "roughness": 2.7e-8,
            "slope": 0.079,
            "hardness": 3e9,
        },
        # 0.2 m of bed on its side: 4.4 kPa vertical at half the height, and half as much across
        {"load": (1e3, 2.9e3, 4.4e3), "emissivity": (0.1, 0.3, 0.8)},
        "the wall: its resistance is a fit of the same temperatures; 8849 spheres between walls",
        lambda r: r["reference"].startswith("Beaulieu"),
    ),
    Measured(
        "li2tio3",
        "Li2TiO3 in helium (Hatano, Enoeda, Tanigawa; one size)",
        "helium",
        {"pressure": 1e5, "youngs_modulus": 126e9, "poisson_ratio": 0.24},
        {**PEBBLE, "diameter": (0.8e-3, 1.2e-3, 1.91e-3), "porosity": (0.25, 0.2, 0.1)},
        "strain of the bed in Tanigawa's runs",
        lambda r: (
            r["solid"] == "Li2TiO3"
            and r["fluid"] == "He"
            and "binary" not in r["reference"]
            and (_number(r["temperature"]) or 0.0) > 600.0
        ),
    ),
)
LEFT_OUT = {
    "binary": "two sizes of pebbles, 0.28 and 1.91 mm: the beds here are of one size",
    "Li2ZrO3": "no conductivity of the solid could be sourced",
    "powder, regolith, perlite": "no size, shape or solid conductivity given",
}


def read(path: Path) -> tuple[Measured, ...]:
    """The sets with their points."""
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return tuple(
        Measured(
            s.key,
            s.title,
            s.gas,
            s.known,
            s.assumed,
            s.missing,
            s.belongs,
            tuple(_point(s, row) for row in rows if s.belongs(row)),
        )
        for s in SETS
    )


def _point(measured: Measured, row: Row) -> Point:
    contrast = _number(row["k_s"]) if measured.key == "dimensionless" else None
    gas = measured.gas or GASES.get(row["fluid"].split(" ")[0])
    return Point(
        _number(row["temperature"]),
        _number(row["pressure"]),
        contrast,
        None if contrast else _number(row["k_s"]),
        float(row["k_eff"]),
        gas,
    )


def titanate(temperature: float, porosity: float) -> float:
    """Conductivity of Li2TiO3, held at its end values outside the range of its source (700 to 1100 K)."""
    solid = find_solid("Li2TiO3").conductivity
    if not 600.0 <= temperature <= 1200.0:
        raise InputError(f"Li2TiO3 at {temperature:g} K is too far from the range of its source")
    inside = min(max(temperature, solid.low), solid.high)
    return float(lithium_titanate_conductivity(inside, porosity))  # type: ignore[arg-type]
