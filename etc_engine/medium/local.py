"""What spheres and pores are made of at the temperature of the place: for walls far apart in temperature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from etc_engine.arrays import Flags, Floats
from etc_engine.errors import InputError
from etc_engine.materials.properties import Property
from etc_engine.medium.conditions import Conditions, pores_at
from etc_engine.packing.particles import ParticlePacking

SPACING = 10.0
"""Distance of the temperatures at which the pores are evaluated [K]; a cubic through four of them lies between."""

HELD = 0.5
"""How far beyond the range of a property its end value still stands for it [K]."""

Solid = Callable[[Floats], Floats]
"""Temperatures of all spheres, shape (n,) [K] -> conductivity of each [W/(m K)]."""


@dataclass(frozen=True, eq=False)
class LocalProperties:
    r"""Solid, gas and radiation over the temperature.

    Parameters
    ----------
    packing : ParticlePacking
        It sets the width of the open pore.
    conditions : Conditions
        Gas, pressure and emissivity; their temperature is replaced by the local one.
    solid : callable
        (n,) temperatures [K] -> (n,) conductivities [W/(m K)] of the spheres.
    fluid : float [W/(m K)]
        Conductivity of the pores where no gas is given by name.
    walls : (float, float), optional [K]
        Temperatures of the walls at the low and at the far end of an axis, of a steady problem.

    Notes
    -----
    The pores are evaluated at multiples of 10 K, and between them by the cubic through the four nearest: exact for
    radiation, :math:`4 \sigma T^3`, and below 1e-7 of the conductivity of a gas above 100 K. A value depends on its
    temperature alone, not on what was asked before.
    """

    packing: ParticlePacking
    conditions: Conditions
    solid: Solid
    fluid: float = 0.0
    walls: tuple[float, float] | None = None
    _known: dict[int, Floats] = field(default_factory=dict, repr=False)

    def pores(self, temperatures: Floats) -> Floats:
        """Conductivity, that in the open pore, jump length and radiation at each temperature, shape (4, m).

        Raises
        ------
        InputError
            If a temperature is out of the range of the gas.
        """
        if not (temperatures > 0.0).all():
            raise InputError(f"temperatures must be absolute, found {float(temperatures.min()):g} K")
        below = np.maximum(np.floor(temperatures / SPACING).astype(np.int64) - 1, 1)
        for number in np.unique(below).tolist():
            for step in range(number, number + 4):
                if step not in self._known:
                    self._known[step] = self._at(step * SPACING)
        s = temperatures / SPACING - below
        weights = (
            -(s - 1.0) * (s - 2.0) * (s - 3.0) / 6.0,
            s * (s - 2.0) * (s - 3.0) / 2.0,
            -s * (s - 1.0) * (s - 3.0) / 2.0,
            s * (s - 1.0) * (s - 2.0) / 6.0,
        )
        first, last = int(below.min(initial=1)), int(below.max(initial=1)) + 4
        table = np.array([self._known.get(step, np.full(4, np.nan)) for step in range(first, last)])
        found = sum(w[:, None] * table[below - first + k] for k, w in enumerate(weights))
        return np.asarray(np.maximum(found, 0.0).T)

    def _at(self, temperature: float) -> Floats:
        pores = pores_at(replace(self.conditions, temperature=temperature), self.packing, self.fluid)
        return np.array([pores.conductivity, pores.in_open_pores, pores.jump_length, pores.radiation])


def solid_law(conductivity: Floats, materials: Sequence[tuple[Flags, Property]]) -> Solid:
    """Conductivities of spheres over their temperatures.

    Parameters
    ----------
    conductivity : ndarray, shape (n,) [W/(m K)]
        Of the spheres that have no material.
    materials : sequence of (ndarray of bool, shape (n,), Property)
        Which spheres are of a material, and its conductivity. Temperatures up to `HELD` K beyond the range of a
        property, which a discretization may reach, take the value at the end of the range.

    Returns
    -------
    callable
    """

    def solid(temperatures: Floats) -> Floats:
        found = np.array(conductivity, dtype=np.float64)
        for rows, material in materials:
            t = temperatures[rows]
            inside = np.clip(t, material.low, material.high)
            found[rows] = material.at(np.where(np.abs(inside - t) <= HELD, inside, t))
        return found

    return solid
