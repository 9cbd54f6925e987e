"""Pores: what fills the space between the particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.errors import InputError


@dataclass(frozen=True)
class Pores:
    """What fills the space between the particles: a fluid at rest, or the matrix of a composite.

    Parameters
    ----------
    conductivity : float [W/(m K)]
        Of the continuum fluid; finite and not negative, 0 for a vacuum.
    heat_capacity : float [J/(m3 K)]
        rho c, not negative.
    jump_length : float [m]
        Temperature jump length of a gap, both surfaces together; 0 for a continuum.
    radiation : float [W/(m2 K)]
        Radiative conductance per area of facing surfaces.
    open_conductivity : float, optional [W/(m K)]
        Of the fluid in the open pore, at most `conductivity`; smaller where the gas is rarefied. That of the
        continuum if left out.

    Raises
    ------
    InputError
    """

    conductivity: float = 0.0
    heat_capacity: float = 0.0
    jump_length: float = 0.0
    radiation: float = 0.0
    open_conductivity: float | None = None

    def __post_init__(self) -> None:
        values = {
            "conductivity": self.conductivity,
            "heat capacity": self.heat_capacity,
            "jump length": self.jump_length,
            "radiation": self.radiation,
            "open conductivity": self.in_open_pores,
        }
        for name, value in values.items():
            if not (np.isfinite(value) and value >= 0.0):
                raise InputError(f"the {name} of the pores must be finite and not negative, found {value:g}")

    @property
    def in_open_pores(self) -> float:
        """Conductivity of the fluid in the open pore [W/(m K)]."""
        return self.conductivity if self.open_conductivity is None else self.open_conductivity

    @property
    def conduct(self) -> bool:
        """Whether heat passes through the pores."""
        return self.conductivity > 0.0 or self.radiation > 0.0

    @property
    def plain(self) -> bool:
        """Whether they are a continuum of one conductivity, without temperature jumps and radiation."""
        return self.jump_length == 0.0 and self.radiation == 0.0 and self.in_open_pores == self.conductivity


VACUUM = Pores()
