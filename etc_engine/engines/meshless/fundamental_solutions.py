"""Fundamental solutions K_0(lambda |x - y|) from sources outside the domain, and where to put them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import k0e, k1e, kve

from etc_engine.arrays import Floats
from etc_engine.engines.meshless.domain import Domain
from etc_engine.errors import GeometryError

Field = NDArray

#: A source closer to the body than this part of the wanted offset is left out (re-entrant corners).
CROWDED = 0.6
#: A source closer to the boundary than this part of the domain radius counts as lying on it.
ON_BOUNDARY = 1e-7


def fundamental_solutions(points: Floats, sources: Floats, nearest: Floats, lam: complex) -> tuple[Field, Field, Field]:
    """Scaled fundamental solutions K_0(lambda r)/K_0(lambda d) and their gradients.

    Each source's function is one at the distance d of the boundary point nearest to it, so that no
    column underflows however large lambda grows.

    Parameters
    ----------
    points : ndarray, shape (k, 2)
        Positions.
    sources : ndarray, shape (m, 2)
        Source points, outside the domain.
    nearest : ndarray, shape (m,)
        Distance d of each source from the domain.
    lam : float or complex
        lambda, Re lambda > 0.

    Returns
    -------
    tuple of ndarray, shape (k, m)
        Values, derivatives along x and along y.

    References
    ----------
    Cao, Qin and Zhao (2010), Recent Patents on Space Technology 2, 41, Eq. 36.

    Examples
    --------
    >>> fundamental_solutions(np.array([[1.0, 0.0]]), np.array([[3.0, 0.0]]), np.array([2.0]), 900.0)[0]
    array([[1.]])
    """
    offset = points[:, None, :] - sources
    r = np.linalg.norm(offset, axis=2)
    reference = _scaled(0, lam * nearest)
    decay = np.exp(-lam * (r - nearest))
    value = _scaled(0, lam * r) / reference * decay
    slope = -lam * _scaled(1, lam * r) / reference * decay / r
    return value, slope * offset[:, :, 0], slope * offset[:, :, 1]


def _scaled(order: int, z: Field) -> Field:
    """K_order(z) e^z."""
    if np.iscomplexobj(z):
        return np.asarray(kve(order, z))
    return np.asarray(k0e(z) if order == 0 else k1e(z))


def offset_sources(domain: Domain, points: Floats, normals: Floats, offset: float) -> Floats:
    """Sources at a distance along the outward normals, shape (<= k, 2) [m].

    Candidates that another edge's body would crowd (behind a re-entrant corner) are left out.

    Raises
    ------
    GeometryError
        If nothing is left.
    """
    candidates = points + offset * normals
    clearance = domain.edge_distances(candidates).min(axis=1)
    kept = candidates[~domain.contains(candidates) & (clearance >= CROWDED * offset)]
    if len(kept) == 0:
        raise GeometryError(f"no source fits outside the body at a distance of {offset:g} m: choose a smaller one")
    return np.asarray(kept)


def factor_sources(domain: Domain, points: Floats, factor: float, center: Floats | None = None) -> Floats:
    """Sources x + factor (x - center) for boundary points x (Cao et al. 2010, Eq. 39), shape (k, 2) [m].

    The centre is the deepest point of the star kernel unless it is given: from any other point some
    sources would fall on or inside the boundary.

    Raises
    ------
    GeometryError
        If the domain has no star kernel and no centre is given.
    """
    if center is None:
        center = domain.star_center()
    if center is None:
        raise GeometryError(
            "the body is not star-shaped, so no centre keeps scaled sources outside: place them along the "
            "normals (source_offset) instead"
        )
    return np.asarray(points + factor * (points - np.asarray(center, dtype=float)))


def clearance_of_sources(domain: Domain, sources: Floats, radius: float) -> Floats:
    """Distance of each source from the body, shape (m,) [m].

    Raises
    ------
    GeometryError
        If a source lies inside the body or on its boundary; the message names the first.
    """
    clearance = domain.edge_distances(sources).min(axis=1)
    bad = domain.contains(sources) | (clearance <= ON_BOUNDARY * radius)
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        place = "on the boundary of" if clearance[first] <= ON_BOUNDARY * radius else "inside"
        raise GeometryError(
            f"source {first} at {np.round(sources[first], 9).tolist()} lies {place} the body "
            f"({int(bad.sum())} of {len(sources)} do): sources must lie outside; move the centre into the "
            "star kernel or use an offset along the normals"
        )
    return np.asarray(clearance)
