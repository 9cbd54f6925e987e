"""Temperature inside spheres, in closed form (see `etc_engine.laws.sphere_field`)."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.laws.sphere_field import sphere_temperatures
from etc_engine.medium.field import ParticleField


def temperatures_inside_spheres(field: ParticleField, method: str, particles: Ints, points: Floats) -> Floats:
    """Temperature at points inside spheres.

    Parameters
    ----------
    field : ParticleField
        Of spheres.
    method : str
        ``standard`` has uniform caps; every other method is drawn with equilibrium disks.
    particles : ndarray of int, shape (q,)
        The sphere of each point.
    points : ndarray, shape (q, 3) [m]
        Position relative to that sphere's centre; a point outside the sphere is taken on it.

    Returns
    -------
    ndarray, shape (q,) [K]
        NaN in spheres without a temperature.

    Notes
    -----
    For pictures: the dents of ``chord`` and the higher flux modes of ``exact`` change heat flows and contact
    temperatures, not the shape of the field drawn here.
    """
    sides, radii = field.sides, field.sides.radii
    scales = (field.medium.conductivity * radii)[sides.particles]
    above = sphere_temperatures(
        particles,
        points / radii[particles, None],
        sides.offsets,
        sides.arms / np.linalg.norm(sides.arms, axis=1, keepdims=True),
        sides.alpha,
        field.flow_modes[:, 0] / scales,
        "standard" if method == "standard" else "chord",
    )
    return np.asarray(field.particle_temperatures[particles] + above)
