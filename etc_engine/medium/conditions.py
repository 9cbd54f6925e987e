"""Pores of a bed at a temperature and a pressure: gas by name, rarefaction, radiation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from etc_engine.errors import InputError
from etc_engine.laws.radiation import grey_exchange
from etc_engine.materials import accommodation_from_masses, gas_state, jump_length, pore_conductivity
from etc_engine.medium.pores import Pores
from etc_engine.packing.particles import ParticlePacking


@dataclass(frozen=True)
class Conditions:
    """What fills the pores of a bed, and how its surfaces radiate.

    Parameters
    ----------
    temperature : float, optional [K]
        Of the gas and of radiation.
    gas : str or mapping, optional
        A gas by name, or mole fractions; see `etc_engine.materials.gas_state`.
    pressure : float, optional [Pa]
        Of the gas; 0 is vacuum.
    accommodation : float, optional [-]
        Thermal accommodation coefficient of the surfaces. Without it, that of `atomic_mass`; without either the gas is
        a continuum.
    atomic_mass : float, optional [kg/mol]
        Mean molar mass of the atoms of the solid.
    emissivity : float, optional [-]
        Of the particles; without it nothing radiates.

    Raises
    ------
    InputError
        If a gas comes without temperature or pressure, radiation without a temperature, or a pressure without a gas.
    """

    temperature: float | None = None
    gas: str | Mapping[str, float] | None = None
    pressure: float | None = None
    accommodation: float | None = None
    atomic_mass: float | None = None
    emissivity: float | None = None

    def __post_init__(self) -> None:
        if self.gas is None and self.pressure is not None:
            raise InputError("a pressure needs a gas: name one, such as helium")
        if self.gas is None and self.accommodation is not None:
            raise InputError("an accommodation coefficient needs a gas: name one, such as helium")
        if self.gas is not None and (self.temperature is None or self.pressure is None):
            missing = "temperature" if self.temperature is None else "pressure"
            raise InputError(f"a gas needs a {missing}: without it its conductivity is not known")
        if self.emissivity and self.temperature is None:
            raise InputError("radiation needs a temperature: it grows as its cube")


def pores_at(conditions: Conditions, packing: ParticlePacking, conductivity: float = 0.0) -> Pores:
    r"""Pores of a packing under given conditions.

    Parameters
    ----------
    conditions : Conditions
    packing : ParticlePacking
        Its mean pore is D = (2/3) d (1 - phi)/phi wide, with the Sauter diameter d and the density phi.
    conductivity : float [W/(m K)]
        Of the pores where no gas is given by name.

    Returns
    -------
    Pores

    Notes
    -----
    The gas in a gap g conducts k/(g + j_1 + j_2), in the open pore k/(1 + 2 j/D). Vacuum is exact: no gas, radiation
    alone. Radiation is linear at the temperature: 4 sigma T^3/(2/e - 1).

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> one = ParticlePacking([[0.5, 0.5, 0.5]], [0.5], Box((1.0, 1.0, 1.0), (True,) * 3))
    >>> pores = pores_at(Conditions(600.0, "helium", 1e5, 0.4, emissivity=0.8), one)
    >>> round(pores.conductivity, 4), round(pores.radiation, 2), pores.plain
    (0.2524, 32.66, False)
    """
    glow = 0.0
    if conditions.emissivity and conditions.temperature is not None:
        glow = float(grey_exchange(conditions.temperature, conditions.emissivity, conditions.emissivity))
    if conditions.gas is None or conditions.temperature is None or conditions.pressure is None:
        return Pores(conductivity, radiation=glow)
    gas = gas_state(conditions.gas, conditions.temperature, conditions.pressure)
    if conditions.pressure == 0.0:
        return Pores(radiation=glow)
    accommodation = conditions.accommodation
    if accommodation is None and conditions.atomic_mass is not None:
        accommodation = min(accommodation_from_masses(conditions.atomic_mass, gas), 1.0)
    if accommodation is None:
        return Pores(gas.conductivity, radiation=glow)
    jump = jump_length(gas, accommodation)
    diameter = 2.0 * float(np.sum(packing.radii**3) / np.sum(packing.radii**2))
    density = min(packing.density, 1.0 - 1e-9)
    return Pores(
        gas.conductivity,
        jump_length=2.0 * jump,
        radiation=glow,
        open_conductivity=pore_conductivity(gas, jump, diameter, density),
    )
