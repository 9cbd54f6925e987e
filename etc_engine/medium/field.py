"""Temperatures and heat flows of every particle and contact under one load, in the same terms for all engines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from etc_engine.arrays import Floats, Ints
from etc_engine.box import AXES
from etc_engine.medium.medium import Medium
from etc_engine.medium.sides import ContactSides

Inside = Callable[[Ints, Floats], Floats]
"""(particle of each point, position relative to its centre [m]) -> temperature [K]."""


@dataclass(frozen=True, eq=False)
class ParticleField:
    """Temperatures and heat flows of one load on a whole contact network.

    Parameters
    ----------
    medium : Medium
    axis : int
        Of the load: walls at temperature 1 (low end) and 0 (far end), or a mean gradient of 1 along a periodic axis.
    sides : ContactSides
        All contact sides of the network.
    particle_temperatures : ndarray, shape (n,) [K]
        Mean temperature of each particle; NaN where no contacts lead to a spanning cluster or a driven wall.
        Along a periodic axis the particle's home image, mean gradient included.
    contact_temperatures : ndarray, shape (m,) [K]
        Mean temperature of each particle contact, seen from its first particle.
    wall_temperatures : ndarray, shape (w,) [K]
        Temperature of each wall contact.
    contact_flows : ndarray, shape (m,) [W, in 2D W/m]
        Heat flow from the first particle of each contact to the second.
    wall_flows : ndarray, shape (w,) [W, in 2D W/m]
        Heat flow from the particle into each wall.
    face_temperatures : ndarray, shape (m, 2) [K]
        Temperature of the face of each particle contact on either particle, T_contact - R_c Q_into / 2, in the
        frame of the first particle. Equal where there is no contact resistance.
    flow_modes : ndarray, shape (s, M)
        Flux modes into the particle at each side; mode 0 is the heat flow.
    inside : callable, optional
        Temperature at points inside particles, of engines that know it.
    reach : ndarray, shape (n,), optional [m]
        Distance from each centre up to which ``inside`` knows the temperature of the pores too; a point belongs to the
        particle of least power |x - x_i|^2 - R_i^2.
    """

    medium: Medium
    axis: int
    sides: ContactSides
    particle_temperatures: Floats
    contact_temperatures: Floats
    wall_temperatures: Floats
    contact_flows: Floats
    wall_flows: Floats
    face_temperatures: Floats
    flow_modes: Floats
    inside: Inside | None = None
    reach: Floats | None = None

    def __repr__(self) -> str:
        """Load axis, particles and links."""
        size = f"{self.particle_temperatures.size} particles and {self.contact_flows.size} links"
        return f"<ParticleField: load along {AXES[self.axis]}, {size}>"
