"""Gases over temperature and pressure: continuum properties, rarefaction, mixtures.

The properties of pure gases come from CoolProp (extra ``gas``), which is imported when it is needed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.errors import InputError

GAS_CONSTANT = 8.31446261815324
"""Molar gas constant R_u [J/(mol K)] (CODATA 2018)."""

NAMES: Mapping[str, str] = MappingProxyType(
    {
        "helium": "Helium",
        "he": "Helium",
        "air": "Air",
        "nitrogen": "Nitrogen",
        "n2": "Nitrogen",
        "argon": "Argon",
        "ar": "Argon",
        "hydrogen": "Hydrogen",
        "h2": "Hydrogen",
        "oxygen": "Oxygen",
        "o2": "Oxygen",
        "carbon dioxide": "CarbonDioxide",
        "co2": "CarbonDioxide",
        "methane": "Methane",
    }
)
"""Names of gases, as a user writes them, and as CoolProp does."""

HIGHEST = 1e8
"""Above this pressure [Pa] the correlations of conductivity and viscosity have no data behind them."""

DILUTE = 1e3
"""Below this pressure [Pa] a gas is taken at this pressure: conductivity, viscosity, cp and gamma of a dilute gas do
not depend on it."""


@dataclass(frozen=True)
class Gas:
    """State of a gas.

    Parameters
    ----------
    name : str
        The gas, or its mole fractions.
    temperature : float [K]
    pressure : float [Pa]
        0 is vacuum.
    conductivity : float [W/(m K)]
        Of the continuum.
    viscosity : float [Pa s]
    heat_capacity : float [J/(kg K)]
        At constant pressure.
    heat_capacity_ratio : float [-]
        gamma.
    molar_mass : float [kg/mol]
    """

    name: str
    temperature: float
    pressure: float
    conductivity: float
    viscosity: float
    heat_capacity: float
    heat_capacity_ratio: float
    molar_mass: float

    @property
    def prandtl(self) -> float:
        """Prandtl number Pr = mu cp / k [-]."""
        return self.viscosity * self.heat_capacity / self.conductivity

    @property
    def mean_free_path(self) -> float:
        r"""Mean free path L = (mu/p) sqrt(pi R_u T/(2 M)) [m]; infinite in vacuum."""
        if self.pressure == 0.0:
            return math.inf
        return (
            self.viscosity
            / self.pressure
            * math.sqrt(0.5 * math.pi * GAS_CONSTANT * self.temperature / self.molar_mass)
        )


def gas_state(gas: str | Mapping[str, float], temperature: float, pressure: float) -> Gas:
    """Properties of a gas, or of a mixture by mole fraction.

    Parameters
    ----------
    gas : str or mapping
        A name of `NAMES`, or mole fractions ``{"helium": 0.9, "hydrogen": 0.1}`` that add up to 1.
    temperature : float [K]
    pressure : float [Pa]
        0 is vacuum.

    Raises
    ------
    InputError
        If the gas is unknown, condensed or out of the range of its equation of state, if the fractions are not
        fractions, or if CoolProp is not installed.

    Notes
    -----
    Below 1 kPa the continuum properties are those at 1 kPa, the dilute limit. Mixtures: conductivity by
    Wassiljewa's equation with the factors of Mason and Saxena, viscosity by Wilke, heat capacity and molar
    mass by mole fraction.

    References
    ----------
    C. R. Wilke, J. Chem. Phys. 18, 517 (1950), 10.1063/1.1747673. E. A. Mason and S. C. Saxena, Phys. Fluids
    1, 361 (1958), 10.1063/1.1724352.

    Examples
    --------
    >>> helium = gas_state("helium", 300.0, 1e5)
    >>> round(helium.conductivity, 4), round(1e9 * helium.mean_free_path)
    (0.156, 197)
    """
    if not (math.isfinite(temperature) and temperature > 0.0):
        raise InputError(f"the temperature of a gas must be positive and finite [K], found {temperature:g}")
    if not (math.isfinite(pressure) and pressure >= 0.0):
        raise InputError(f"the pressure of a gas must be finite and not negative [Pa], found {pressure:g}")
    if isinstance(gas, str):
        return _pure(gas, temperature, pressure)
    return _mixture(gas, temperature, pressure)


def jump_length(gas: Gas, accommodation: float) -> float:
    r"""Temperature jump length at one surface [m].

    .. math:: j = \frac{2 - a}{a} \frac{2 \gamma}{\gamma + 1} \frac{L}{\mathrm{Pr}}

    Parameters
    ----------
    gas : Gas
    accommodation : float [-]
        Thermal accommodation coefficient a of the surface, 0 < a <= 1.

    Returns
    -------
    float [m]
        Infinite in vacuum.

    Raises
    ------
    InputError
        If the coefficient is not between 0 and 1.

    Notes
    -----
    A gap g between two surfaces conducts k/(g + j_1 + j_2) per area: k/g in the continuum, nothing in vacuum.
    Equal to half of the length l = 2 (2 - a)/a sqrt(2 pi R T/M) k/(p (2 cp - R/M)) of Zehner, Bauer and Schluender.

    References
    ----------
    E. H. Kennard, Kinetic Theory of Gases (1938), p. 312.

    Examples
    --------
    >>> helium = gas_state("helium", 300.0, 1e5)
    >>> round(1e9 * jump_length(helium, 1.0))
    371
    """
    if not 0.0 < accommodation <= 1.0:
        raise InputError(f"an accommodation coefficient must lie in (0, 1], found {accommodation:g}")
    gamma = gas.heat_capacity_ratio
    return (2.0 - accommodation) / accommodation * 2.0 * gamma / (gamma + 1.0) * gas.mean_free_path / gas.prandtl


def accommodation_from_masses(atomic_mass: float, gas: Gas) -> float:
    r"""Thermal accommodation coefficient of a clean surface, by the masses of its atoms and of the gas.

    .. math:: a = \frac{2.4 m}{(1 + m)^2}, \qquad m = M_{solid}/M_{gas}

    Parameters
    ----------
    atomic_mass : float [kg/mol]
        Mean molar mass of the atoms of the solid.
    gas : Gas

    Returns
    -------
    float [-]

    Notes
    -----
    The high-temperature limit of a correlation for clean surfaces; gas adsorbed on real surfaces raises it.

    References
    ----------
    S. Song and M. M. Yovanovich (1987), the limit of high temperature.

    Examples
    --------
    >>> round(accommodation_from_masses(0.0133, gas_state("helium", 300.0, 1e5)), 3)
    0.427
    """
    if not atomic_mass > 0.0:
        raise InputError(f"an atomic mass must be positive [kg/mol], found {atomic_mass:g}")
    ratio = atomic_mass / gas.molar_mass
    return 2.4 * ratio / (1.0 + ratio) ** 2


def pore_conductivity(gas: Gas, jump: float, diameter: float, density: float) -> float:
    r"""Conductivity of the gas in the open pores of a bed [W/(m K)].

    .. math:: k = \frac{k_g}{1 + 2 j/D}, \qquad D = \frac{2}{3} d \, \frac{1 - \phi}{\phi}

    Parameters
    ----------
    gas : Gas
    jump : float [m]
        Jump length of the surfaces; infinite in vacuum.
    diameter : float [m]
        Sauter mean diameter d of the particles.
    density : float [-]
        Solid fraction phi.

    Returns
    -------
    float [W/(m K)]

    Examples
    --------
    >>> helium = gas_state("helium", 300.0, 0.0)
    >>> pore_conductivity(helium, jump_length(helium, 0.5), 1e-3, 0.6)
    0.0
    """
    if not (0.0 < density < 1.0 and diameter > 0.0):
        raise InputError(f"pores need a diameter > 0 and 0 < density < 1, found {diameter:g} and {density:g}")
    width = 2.0 / 3.0 * diameter * (1.0 - density) / density
    return gas.conductivity / (1.0 + 2.0 * jump / width)


def _pure(name: str, temperature: float, pressure: float) -> Gas:
    key = name.lower().replace("_", " ").strip()
    if key not in NAMES:
        raise InputError(f"there is no gas named {name!r}; there are: {', '.join(k for k in NAMES if len(k) > 3)}")
    fluid = NAMES[key]
    if pressure > HIGHEST:
        raise InputError(f"{name} at {pressure:g} Pa: the properties of gases hold up to {HIGHEST:g} Pa")
    properties = _coolprop()
    state = ("T", temperature, "P", max(pressure, DILUTE), fluid)
    where = f"{name} at {temperature:g} K and {pressure:g} Pa"
    low, high = (properties.PropsSI(item, fluid) for item in ("Tmin", "Tmax"))
    if not low <= temperature <= high:
        raise InputError(f"{where}: its equation of state holds from {low:g} to {high:g} K")
    try:
        phase = properties.PhaseSI(*state)
        k, mu, cp, cv, molar = (properties.PropsSI(item, *state) for item in ("L", "V", "C", "CVMASS", "M"))
    except ValueError as error:
        raise InputError(f"{where} has no properties: {str(error).split(' : ')[0]}") from None
    if "gas" not in phase and "supercritical" not in phase:
        raise InputError(f"{where} is {phase}, expected a gas")
    values = (k, mu, cp, cp / cv, molar)
    if not all(math.isfinite(value) for value in values):
        raise InputError(f"{where} has no properties")
    return Gas(key, temperature, pressure, *values)


def _mixture(fractions: Mapping[str, float], temperature: float, pressure: float) -> Gas:
    if not fractions:
        raise InputError("a gas mixture needs mole fractions, such as { helium = 0.9, hydrogen = 0.1 }")
    for name, value in fractions.items():
        if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1.0:
            raise InputError(f"the mole fraction of {name} must lie in [0, 1], found {value!r}")
    total = math.fsum(fractions.values())
    if abs(total - 1.0) > 1e-6:
        raise InputError(f"the mole fractions of a gas mixture must add up to 1, found {total:g}")
    parts = [(value / total, _pure(name, temperature, pressure)) for name, value in fractions.items() if value > 0.0]
    x = np.array([value for value, _ in parts])
    molar = np.array([part.molar_mass for _, part in parts])
    mu = np.array([part.viscosity for _, part in parts])
    k = np.array([part.conductivity for _, part in parts])
    cp = np.array([part.heat_capacity * part.molar_mass for _, part in parts])  # per mole
    cv = np.array([part.heat_capacity * part.molar_mass / part.heat_capacity_ratio for _, part in parts])
    factors = interaction_factors(mu, molar)
    mass = float(x @ molar)
    name = " + ".join(f"{value:g} {part.name}" for value, part in parts)
    return Gas(
        name,
        temperature,
        pressure,
        conductivity=mixture_value(x, k, factors),
        viscosity=mixture_value(x, mu, factors),
        heat_capacity=float(x @ cp) / mass,
        heat_capacity_ratio=float(x @ cp) / float(x @ cv),
        molar_mass=mass,
    )


def interaction_factors(viscosity: Floats, molar_mass: Floats) -> Floats:
    r"""Wilke's factors, which Mason and Saxena use for conductivity as well.

    .. math:: \phi_{ij} = \frac{[1 + (\mu_i/\mu_j)^{1/2} (M_j/M_i)^{1/4}]^2}{[8 (1 + M_i/M_j)]^{1/2}}

    Parameters
    ----------
    viscosity : ndarray, shape (n,) [Pa s]
    molar_mass : ndarray, shape (n,)

    Returns
    -------
    ndarray, shape (n, n) [-]
    """
    mu = viscosity[:, None] / viscosity[None, :]
    m = molar_mass[:, None] / molar_mass[None, :]
    return (1.0 + np.sqrt(mu) * m**-0.25) ** 2 / np.sqrt(8.0 * (1.0 + m))


def mixture_value(x: Floats, values: Floats, factors: Floats) -> float:
    """Mean sum_i x_i v_i / sum_j x_j phi_ij of a property of a gas mixture.

    Examples
    --------
    >>> x, mu, m = np.array([0.05, 0.95]), np.array([1.34e-5, 9.5029e-6]), np.array([64.06, 46.07])
    >>> round(1e6 * mixture_value(x, mu, interaction_factors(mu, m)), 9)
    9.701614886
    """
    return float(np.sum(x * values / (factors @ x)))


def _coolprop() -> Any:
    try:
        import CoolProp.CoolProp as properties
    except ImportError:
        raise InputError(
            "gases by name need CoolProp: install it with pip install '.[gas]' in the folder of etc_engine, or give "
            "[pores] conductivity as a number"
        ) from None
    return properties
