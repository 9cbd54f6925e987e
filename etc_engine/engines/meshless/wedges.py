r"""Singular harmonics of corners, r^nu sin(nu theta) or r^nu cos(nu theta), as part of an interpolation.

They take up what no smooth function interpolates. Being harmonic, they have the particular solution

    (laplacian - lambda^2) p = r^nu sin(nu theta),   p = - r^nu sin(nu theta) / lambda^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.meshless.domain import Domain, Polygon
from etc_engine.engines.meshless.problem import BoundaryCondition, Dirichlet

#: Exponents from here on are smooth enough for the radial functions.
SMOOTH = 1.0 - 1e-9
#: Directions tried for the cut behind a corner, as parts of the opening outside the body.
CUTS = (0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8)
#: Distance from a vertex, in scaled coordinates, below which a gradient is taken there.
CLOSEST = 1e-9


@dataclass(frozen=True, eq=False)
class Wedge:
    """A corner and the exponents of its singular harmonics.

    Parameters
    ----------
    vertex : ndarray, shape (2,)
    first : float [rad]
        Direction of the edge from which theta is counted, counter-clockwise into the body.
    cut : float [rad]
        Angle from ``first``, clockwise, to the ray outside the body on which theta jumps.
    held : bool
        Whether the temperature is prescribed on that edge: sines then, cosines otherwise.
    exponents : ndarray, shape (m,)
    """

    vertex: Floats
    first: float
    cut: float
    held: bool
    exponents: Floats

    def scaled(self, center: Floats, scale: float) -> Wedge:
        """The wedge in the coordinates (x - center)/scale."""
        return replace(self, vertex=(self.vertex - center) / scale)


def corner_wedges(domain: Domain, boundary: Sequence[BoundaryCondition], corners: Ints) -> tuple[Wedge, ...]:
    """Wedges of the given vertices of a polygon; one without a straight line of sight out of the body is left out."""
    if not isinstance(domain, Polygon):
        return ()
    wedges = []
    for vertex in corners:
        sides = [(domain.edges[vertex], boundary[vertex]), (-domain.edges[vertex - 1], boundary[vertex - 1])]
        if domain.signed_area < 0.0:
            sides.reverse()
        first, last = (float(np.arctan2(edge[1], edge[0])) for edge, _ in sides)
        held, other = (isinstance(condition, Dirichlet) for _, condition in sides)
        opening = float(np.mod(last - first, 2.0 * np.pi))
        exponents = (np.arange(1.0, 5.0) - 0.5 * (held != other)) * np.pi / opening
        singular = exponents[exponents < SMOOTH]
        cut = _free_cut(domain, int(vertex), first, 2.0 * np.pi - opening)
        if cut is not None and singular.size:
            wedges.append(Wedge(domain.vertices[vertex], first, cut, held, singular))
    return tuple(wedges)


def wedge_harmonics(points: Floats, wedges: Sequence[Wedge]) -> tuple[Floats, Floats, Floats]:
    """Values and both derivatives of all singular harmonics at points, each of shape (k, number of them).

    Examples
    --------
    >>> quarter_out = Wedge(np.zeros(2), 0.0, 0.25 * np.pi, True, np.array([2.0 / 3.0]))
    >>> value, along_x, along_y = wedge_harmonics(np.array([[0.0, 8.0]]), [quarter_out])
    >>> round(float(value[0, 0]), 6), round(float(along_x[0, 0]), 6), round(float(along_y[0, 0]), 6)
    (3.464102, -0.166667, 0.288675)
    """
    tables = [[np.empty((len(points), 0))] for _ in range(3)]
    for wedge in wedges:
        x, y = (np.asarray(points) - wedge.vertex).T
        r, phi = np.maximum(np.hypot(x, y), CLOSEST)[:, None], np.arctan2(y, x)
        theta = np.mod(phi - wedge.first + wedge.cut, 2.0 * np.pi) - wedge.cut
        nu, around = wedge.exponents, np.outer(theta, wedge.exponents)
        angular, turning = (np.sin(around), np.cos(around)) if wedge.held else (np.cos(around), -np.sin(around))
        slope = nu * r ** (nu - 1.0)
        cosine, sine = np.cos(phi)[:, None], np.sin(phi)[:, None]
        parts = (
            np.hypot(x, y)[:, None] ** nu * angular,
            slope * (cosine * angular - sine * turning),
            slope * (sine * angular + cosine * turning),
        )
        for table, part in zip(tables, parts, strict=True):
            table.append(part)
    value, along_x, along_y = (np.hstack(table) for table in tables)
    return value, along_x, along_y


def _free_cut(domain: Polygon, vertex: int, first: float, outside: float) -> float | None:
    """Angle of a ray from a vertex that meets the body nowhere else, clockwise from the first edge."""
    low, high = domain.bounds
    steps = np.geomspace(1e-6, 2.0, 2000)[:, None] * float(np.linalg.norm(high - low))
    for part in CUTS:
        angle = first - part * outside
        if not domain.contains(domain.vertices[vertex] + steps * np.array([np.cos(angle), np.sin(angle)])).any():
            return part * outside
    return None
