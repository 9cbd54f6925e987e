"""The catalogue of solids: values over temperature, each with its range and the source it was read in."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.materials.properties import Property, polynomial, table
from etc_engine.materials.solid import W_MK, Solid

CELSIUS = 273.15

ATOMIC_WEIGHT = {
    "H": 1.008,
    "Li": 6.94,
    "C": 12.011,
    "O": 15.999,
    "Na": 22.990,
    "Al": 26.982,
    "Si": 28.085,
    "Ca": 40.078,
    "Ti": 47.867,
    "Fe": 55.845,
    "Cu": 63.546,
    "U": 238.029,
}
"""Standard atomic weights [g/mol] (IUPAC, abridged)."""


def _atoms(**counts: int) -> float:
    """Mean molar mass of the atoms of a formula unit [kg/mol]."""
    total = sum(ATOMIC_WEIGHT[element] * n for element, n in counts.items())
    return 1e-3 * total / sum(counts.values())


def _alumina(t: Floats) -> Floats:
    """K = 5.85 + 15360 exp(-0.002 c)/(c + 516), c in degrees Celsius."""
    c = t - CELSIUS
    return 5.85 + 15360.0 * np.exp(-0.002 * c) / (c + 516.0)


def _sintered_silicon_carbide(t: Floats) -> Floats:
    """K = 52000 exp(-1.24e-5 c)/(c + 437), c in degrees Celsius."""
    c = t - CELSIUS
    return 52000.0 * np.exp(-1.24e-5 * c) / (c + 437.0)


def _cvd_silicon_carbide(t: Floats) -> Floats:
    """K = 1/(-0.0003 + 1.05e-5 T)."""
    return 1.0 / (-0.0003 + 1.05e-5 * t)


def uranium_dioxide_conductivity(t: Floats, porosity: float = 0.05) -> Floats:
    """Conductivity of UO2 of a given porosity.

    k = [115.8/(7.5408 + 17.692 x + 3.6142 x^2) + 7410.5 x^(-5/2) exp(-16.35/x)] (1 - p)/(1 + 2 p), x = T/1000 K.

    Examples
    --------
    >>> round(float(uranium_dioxide_conductivity(np.float64(1000.0))), 3)
    3.467
    """
    x = t / 1000.0
    dense = 115.8 / (7.5408 + 17.692 * x + 3.6142 * x**2) + 7410.5 * x**-2.5 * np.exp(-16.35 / x)
    return dense * (1.0 - porosity) / (1.0 + 2.0 * porosity)


def lithium_titanate_conductivity(t: Floats, porosity: float = 0.2) -> Floats:
    """Conductivity of Li2TiO3 of a given porosity: k = (1 - p)^2.9 (5.35 - 4.78e-3 T + 2.87e-6 T^2).

    Examples
    --------
    >>> round(float(lithium_titanate_conductivity(np.float64(900.0), porosity=0.0)), 4)
    3.3727
    """
    return (1.0 - porosity) ** 2.9 * (5.35 - 4.78e-3 * t + 2.87e-6 * t**2)


MUNRO_ALUMINA = "Munro, J. Am. Ceram. Soc. 80, 1919 (1997), NIST SRD 150"
MILLS = "Mills, Recommended Values of Thermophysical Properties (2002), fit of the MOOSE solid properties module"
VAN_LEW = "Van Lew, PhD thesis, UCLA (2016)"

SOLIDS = (
    Solid(
        "alumina",
        "Sintered alpha-alumina, 98 % dense",
        Property(
            "conductivity of alumina",
            W_MK,
            CELSIUS,
            1773.15,
            _alumina,
            "Munro, J. Am. Ceram. Soc. 80, 1919 (1997), as in the TRANSFORM library, Media.Solids.Alumina",
        ),
        youngs_modulus=table(
            [293.15, 773.15, 1273.15, 1473.15, 1673.15, 1773.15],
            [416e9, 390e9, 364e9, 354e9, 343e9, 338e9],
            "Young's modulus of alumina",
            "Pa",
            MUNRO_ALUMINA,
        ),
        # from the moduli: nu = 1/2 - E/(6 K), K = 257, 247, 237, 233, 229, 227 GPa
        poisson_ratio=table(
            [293.15, 773.15, 1273.15, 1473.15, 1673.15, 1773.15],
            [0.2302, 0.2368, 0.2440, 0.2468, 0.2504, 0.2518],
            "Poisson's ratio of alumina",
            "-",
            f"{MUNRO_ALUMINA}, from Young's and bulk modulus",
        ),
        atomic_mass=_atoms(Al=2, O=3),
    ),
    Solid(
        "fused silica",
        "Vitreous silica",
        table(
            [123.15, 173.15, 223.15, 273.15, 323.15, 373.15],
            [0.85, 1.05, 1.20, 1.30, 1.40, 1.50],
            "conductivity of fused silica",
            W_MK,
            "CRC Handbook of Chemistry and Physics, Thermal conductivity of glasses, 12-205 (approximate)",
        ),
        atomic_mass=_atoms(Si=1, O=2),
    ),
    Solid(
        "borosilicate glass",
        "Chemically resistant borosilicate glass (Pyrex type)",
        table(
            [173.15, 273.15, 373.15],
            [0.90, 1.10, 1.25],
            "conductivity of borosilicate glass",
            W_MK,
            "CRC Handbook of Chemistry and Physics, Thermal conductivity of glasses, 12-205 (approximate)",
        ),
    ),
    Solid(
        "soda-lime glass",
        "Soda-lime (float) glass, at room temperature",
        table(
            [293.15],
            [1.05],
            "conductivity of soda-lime glass",
            W_MK,
            "makeitfrom.com, Soda-Lime (Float) Glass: 1.0 to 1.1 W/(m K)",
        ),
        youngs_modulus=table(
            [293.15],
            [70.5e9],
            "Young's modulus of soda-lime glass",
            "Pa",
            "makeitfrom.com, Soda-Lime (Float) Glass: 70 to 71 GPa",
        ),
        poisson_ratio=table(
            [293.15],
            [0.23],
            "Poisson's ratio of soda-lime glass",
            "-",
            "makeitfrom.com, Soda-Lime (Float) Glass",
        ),
    ),
    Solid(
        "stainless steel 304",
        "Stainless steel 304",
        polynomial(
            [11.34905, 0.013],
            CELSIUS,
            1273.15,
            "conductivity of stainless steel 304",
            W_MK,
            "AK Steel data sheet, fit of the TRANSFORM library, Media.Solids.SS304",
        ),
    ),
    Solid(
        "stainless steel 316",
        "Stainless steel 316",
        polynomial(
            [6.308, 0.02716, -7.301e-6],
            298.15,
            1573.15,
            "conductivity of stainless steel 316",
            W_MK,
            f"{MILLS}, +-10 %",
        ),
        youngs_modulus=table(
            [300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 900.0],
            [194.18e9, 188.49e9, 182.02e9, 174.29e9, 166.17e9, 157.96e9, 148.63e9],
            "Young's modulus of stainless steel 316",
            "Pa",
            "Karditsas and Baptiste, Thermal and structural properties of fusion related materials (1995)",
        ),
    ),
    Solid(
        "carbon steel",
        "Plain carbon steel, 1 % C",
        table(
            [300.0, 400.0, 600.0, 800.0, 1000.0, 1200.0],
            [43.0, 43.0, 36.0, 30.0, 29.0, 29.0],
            "conductivity of carbon steel",
            W_MK,
            "Incropera et al., Fundamentals of Heat and Mass Transfer, 7th ed., table A.1",
        ),
        atomic_mass=_atoms(Fe=1),
    ),
    Solid(
        "copper",
        "Pure copper",
        table(
            [200.0, 300.0, 400.0, 600.0, 800.0, 1000.0, 1200.0],
            [413.0, 401.0, 393.0, 379.0, 366.0, 352.0, 339.0],
            "conductivity of copper",
            W_MK,
            "Incropera et al., Fundamentals of Heat and Mass Transfer, 7th ed., table A.1",
        ),
        atomic_mass=_atoms(Cu=1),
    ),
    Solid(
        "aluminium",
        "Pure aluminium",
        polynomial(
            [39.646, 1.684, -5.4134e-3, 8.4313e-6, -6.537e-9, 2.002e-12],
            297.0,
            933.0,
            "conductivity of aluminium",
            W_MK,
            "Ho, Powell and Liley, J. Phys. Chem. Ref. Data 1, 279 (1972), fit of the Agros2D material library",
        ),
        atomic_mass=_atoms(Al=1),
    ),
    Solid(
        "graphite H-451",
        "Graphite H-451, unirradiated",
        polynomial(
            [169.2145, -0.12489, 3.28248e-5],
            500.0,
            1800.0,
            "conductivity of graphite H-451",
            W_MK,
            "NEA MHTGR-350 benchmark (2018), as in the MOOSE solid properties module",
        ),
        atomic_mass=_atoms(C=1),
    ),
    Solid(
        "graphite IG-11",
        "Graphite IG-11, unirradiated",
        table(
            [298.15, 373.15, 473.15, 573.15, 673.15, 773.15, 1273.15],
            [110.0, 100.0, 92.0, 85.0, 79.0, 75.0, 50.0],
            "conductivity of graphite IG-11",
            W_MK,
            f"{VAN_LEW}, points of scripts/granular_ht_radiation.py",
        ),
        atomic_mass=_atoms(C=1),
    ),
    Solid(
        "Li2TiO3",
        "Lithium metatitanate, 80 % dense",
        Property(
            "conductivity of Li2TiO3",
            W_MK,
            700.0,
            1100.0,
            lithium_titanate_conductivity,
            f"Gierszewski (1998), as evaluated by {VAN_LEW}, scripts/lit_props.py, porosity 0.2",
        ),
        youngs_modulus=table(
            [300.0],
            [126e9],
            "Young's modulus of Li2TiO3",
            "Pa",
            f"Gierszewski (1998), in {VAN_LEW}, table of material properties",
        ),
        poisson_ratio=table(
            [300.0],
            [0.24],
            "Poisson's ratio of Li2TiO3",
            "-",
            f"Gierszewski (1998), in {VAN_LEW}, table of material properties",
        ),
        atomic_mass=_atoms(Li=2, Ti=1, O=3),
    ),
    Solid(
        "silicon carbide",
        "Sintered alpha silicon carbide",
        Property(
            "conductivity of silicon carbide",
            W_MK,
            CELSIUS,
            2273.15,
            _sintered_silicon_carbide,
            "Munro, J. Phys. Chem. Ref. Data 26, 1195 (1997), as in ARMI, materials/siC.py",
        ),
        atomic_mass=_atoms(Si=1, C=1),
    ),
    Solid(
        "silicon carbide CVD",
        "Chemical-vapour-deposited silicon carbide",
        Property(
            "conductivity of CVD silicon carbide",
            W_MK,
            300.0,
            1800.0,
            _cvd_silicon_carbide,
            "Snead et al., J. Nucl. Mater. 371, 329 (2007), as in the MOOSE solid properties module",
        ),
        atomic_mass=_atoms(Si=1, C=1),
    ),
    Solid(
        "UO2",
        "Uranium dioxide, 95 % dense, unirradiated",
        Property(
            "conductivity of UO2",
            W_MK,
            298.15,
            3120.0,
            uranium_dioxide_conductivity,
            "Popov et al., ORNL/TM-2000/351 (2000), equation 6.2, as in the TRANSFORM library",
        ),
        atomic_mass=_atoms(U=1, O=2),
    ),
    Solid(
        "Ti-6Al-4V",
        "Titanium alloy Ti-6Al-4V, beta phase below melting",
        polynomial(
            [-0.32, 0.0146],
            1400.0,
            1800.0,
            "conductivity of Ti-6Al-4V",
            W_MK,
            "Boivineau et al., Int. J. Thermophys. 27, 507 (2006)",
        ),
        youngs_modulus=table(
            [293.15], [113.8e9], "Young's modulus of Ti-6Al-4V", "Pa", "MatWeb, Titanium Ti-6Al-4V, annealed"
        ),
        poisson_ratio=table(
            [293.15], [0.342], "Poisson's ratio of Ti-6Al-4V", "-", "MatWeb, Titanium Ti-6Al-4V, annealed"
        ),
    ),
)
"""Every solid that has a sourced conductivity."""
