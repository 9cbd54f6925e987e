"""Contacts that a DEM code found: who touches whom and through how wide a contact comes from its contact dump."""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.contact import Elastic, effective_modulus, effective_radius, radius_from_area, reach_from_force
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import overlap_walls, perfect_contacts
from etc_engine.packing.particles import ParticlePacking

RULE = "given"
WIDTHS = ("area", "force")


def given_contacts(packing: ParticlePacking, rows: Ints, reach: Floats) -> ContactNetwork:
    r"""Contacts between given particles, of given half-width.

    .. math:: \sin\alpha_i = c / R_i

    Parameters
    ----------
    packing : ParticlePacking
    rows : ndarray of int, shape (m, 2)
        Row numbers of the particles of each contact.
    reach : ndarray, shape (m,) [m]
        Radius c of the contact disk of spheres, half-width of that of disks; contacts of width 0 are left out.

    Returns
    -------
    ContactNetwork
        Sorted by i, then j. A contact across a periodic face is with the nearest image.

    Raises
    ------
    InputError
        If a row is not there, or a width is not a number.
    GeometryError
        If a contact is as wide as a particle, or given twice.

    Notes
    -----
    A dump of pairs says nothing of walls: their contacts are those that the walls cut out of the particles.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> packing = ParticlePacking([[0.3, 0.5], [0.7, 0.5]], [0.2, 0.2], Box((1.0, 1.0)))
    >>> given_contacts(packing, np.array([[1, 0]]), np.array([0.1])).angles.round(4)
    array([[0.5236, 0.5236]])
    """
    if rows.size and not (rows.min() >= 0 and rows.max() < packing.count):
        raise InputError(f"contacts name the rows {rows.min()} to {rows.max()} of {packing.count} particles")
    if not (np.isfinite(reach) & (reach >= 0.0)).all():
        bad = int(np.flatnonzero(~(np.isfinite(reach) & (reach >= 0.0)))[0])
        raise InputError(f"the width of contact {bad} must be a number and not negative, found {reach[bad]}")
    rows, reach = np.sort(rows[reach > 0.0], axis=1), reach[reach > 0.0]
    order = np.lexsort((rows[:, 1], rows[:, 0]))
    rows, reach = rows[order], reach[order]
    shifts = packing.box.image_shift(packing.centers[rows[:, 1]] - packing.centers[rows[:, 0]])
    same = np.flatnonzero((np.diff(rows, axis=0) == 0).all(axis=1))
    if same.size:
        i, j = rows[same[0]]
        raise GeometryError(f"the contact of particles {i} and {j} is given twice: give the contacts of one moment")
    ratio = reach[:, None] / packing.radii[rows]
    if (ratio >= 1.0).any():
        wide = int(np.flatnonzero((ratio >= 1.0).any(axis=1))[0])
        i, j = rows[wide]
        raise GeometryError(
            f"the contact of particles {i} and {j} has a half-width of {reach[wide]:.6g}, as wide as their radii "
            f"{packing.radii[i]:.6g} and {packing.radii[j]:.6g}"
        )
    return perfect_contacts(packing, (rows, shifts, np.arcsin(ratio)), overlap_walls(packing), RULE)


def reach_of_contacts(
    packing: ParticlePacking,
    rows: Ints,
    *,
    area: Floats | None = None,
    force: Floats | None = None,
    material: Elastic | None = None,
) -> Floats:
    r"""Half-width of contacts from their area or their force.

    :math:`c = \sqrt{A/\pi}` from the area, or the Hertzian width of the true material under the normal force.

    Parameters
    ----------
    packing : ParticlePacking
        Of spheres, for areas.
    rows : ndarray of int, shape (m, 2)
    area : ndarray, shape (m,), optional [m2]
    force : ndarray, shape (m, 3) or (m,), optional [N]
        As a vector, of which the component along the line of centres counts, or that component.
    material : Elastic, optional
        Of all particles; needed with ``force``.

    Returns
    -------
    ndarray, shape (m,) [m]

    Raises
    ------
    InputError
        If neither or both are given, or what one needs is missing.

    References
    ----------
    K. L. Johnson, Contact Mechanics (1985), chapter 4.
    """
    if (area is None) == (force is None):
        raise InputError("the width of contacts comes from their area or from their force: give one of them")
    if area is not None:
        if packing.dimension == 2:
            raise InputError("contact areas are for spheres: use the force for disks")
        return radius_from_area(area)
    if material is None:
        raise InputError("the width of a contact under a force needs Young's modulus and Poisson's ratio")
    assert force is not None
    normal = np.abs(force)
    if force.ndim == 2:
        branches = packing.box.minimum_image(packing.centers[rows[:, 1]] - packing.centers[rows[:, 0]])
        directions = branches / np.linalg.norm(branches, axis=1)[:, None]
        normal = np.abs((force[:, : packing.dimension] * directions).sum(axis=1))
    radii = effective_radius(packing.radii[rows[:, 0]], packing.radii[rows[:, 1]])
    return reach_from_force(normal, radii, effective_modulus(material, material), packing.dimension)
