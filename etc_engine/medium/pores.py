"""Pores: what fills the space between the particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.errors import InputError

LARGEST, SMALLEST = 1e100, 1e-100
"""No conductivity in SI units lies beyond these; products of three of them are still finite numbers."""


def check_conductivity(value: float, whose: str, *, perfect: bool = True) -> None:
    """Refuse a conductivity that is negative, no number, or beyond the range in which products are finite.

    Parameters
    ----------
    value : float [W/(m K)]
        0 is an insulator and infinity a perfect conductor.
    whose : str
        What has this conductivity, for the message.
    perfect : bool, optional
        Whether it may be infinite.

    Raises
    ------
    InputError
    """
    if value == 0.0 or (perfect and value == np.inf) or SMALLEST <= value <= LARGEST:
        return
    others = (
        "or, with homogenize, 0 for an insulator and inf for a perfect conductor"
        if perfect
        else "or 0 for an insulator"
    )
    raise InputError(
        f"the conductivity of {whose} is {value:g}: give a number of W/(m K) from {SMALLEST:g} to {LARGEST:g}, {others}"
    )


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

        check_conductivity(self.conductivity, "the pores", perfect=False)

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
