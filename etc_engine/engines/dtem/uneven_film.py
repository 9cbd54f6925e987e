"""Excess resistance of contacts whose temperature jump follows the flux along them, for methods with one flux mode."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.box import ball_measure
from etc_engine.laws.film import edge_factor, film_excess
from etc_engine.medium.sides import ContactSides


def uneven_film(sides: ContactSides, conductivity: Floats, *, lumped: bool = False) -> Floats:
    """Share of each side in the excess resistance of a film over the contact area, shape (s,) [K/W, in 2D m K/W].

    Half of it on either side of a particle contact, all of it at a wall; see `etc_engine.laws.film`.

    Parameters
    ----------
    sides : ContactSides
    conductivity : ndarray, shape (n,) [W/(m K)]
    lumped : bool
        Whether resistances that are given as one number count as well, as if they were spread over the contact.
    """
    d = sides.dimension
    films = sides.area_resistances
    if lumped:
        films = films + sides.lumped_resistances * ball_measure(sides.reaches, d - 1)
    excess = np.zeros(films.size)
    if not films.any():
        return excess
    resistivity = 1.0 / conductivity[sides.particles]
    both, parts = resistivity.copy(), np.ones(films.size)
    edges = resistivity * edge_factor(sides.alpha, d)
    for values in (both, edges):
        values[sides.of_contacts] = values[sides.of_contacts].sum(axis=1, keepdims=True)
    parts[sides.of_contacts] = 2.0
    rows = np.flatnonzero(films > 0.0)
    reach, both, parts = sides.reaches[rows], both[rows], parts[rows]
    excess[rows] = edges[rows] / parts * film_excess(parts * films[rows] / (both * reach), d) / reach ** (d - 2)
    return excess
