"""Edges between cells with what happens on them: a gap, a touching point, a contact and its resistance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.dtem.cell.rim_grid import (
    BONDED,
    CORNER,
    CUT,
    FINEST,
    GAP,
    LONGEST,
    NECK,
    TOUCHING,
    EdgeGrid,
    divide_edges,
)
from etc_engine.errors import GeometryError
from etc_engine.structure.laguerre_2d import LaguerreCells

ROUND_OFF_GAP = 1e-8
"""Disks closer than this, or overlapping less, in units of the smaller radius, touch in a point."""


@dataclass(frozen=True, eq=False)
class EdgeContacts:
    """Contacts prescribed on edges; everything else follows from the geometry.

    Parameters
    ----------
    half_angles : ndarray, shape (m, 2) [rad]
        Half-angle of a contact without thickness, seen from both disks; 0 for none.
    necks : ndarray, shape (m,) [m]
        Half-width of a bridge of solid that fills the gap; 0 for none.
    resistances : ndarray, shape (m,) [m K/W]
        Total resistance of the contact per unit thickness; 0 for none.
    uniform_jump : bool
        Whether the temperature jump is the same all over a contact; otherwise a contact has a uniform resistance per
        unit of its area.
    """

    half_angles: Floats
    necks: Floats
    resistances: Floats
    uniform_jump: bool = True

    @staticmethod
    def none(count: int) -> EdgeContacts:
        """No prescribed contact on ``count`` edges."""
        return EdgeContacts(np.zeros((count, 2)), np.zeros(count), np.zeros(count))


class CellEdges(NamedTuple):
    """Geometry of m edges as the cell element needs it (a tuple, for compiled code).

    Attributes
    ----------
    kind : ndarray of int64, shape (m,)
        ``GAP``, ``TOUCHING``, ``CUT``, ``BONDED`` or ``NECK`` of `rim_grid`.
    clearances : ndarray, shape (m, 2) [m]
        h - R on both sides, free of cancellation.
    distances : ndarray, shape (m, 2) [m]
        Distance h of both centres.
    ends : ndarray, shape (m, 2) [m]
        Range of the coordinate along the edge.
    corners : ndarray, shape (m,) [m]
        Half-width of the contact in the common coordinate; 0 for none.
    own_corners : ndarray, shape (m, 2) [m]
        The same point in the coordinate of each side: for a contact without thickness the point on the ray of the rim.
    half_angles : ndarray, shape (m, 2) [rad]
        Half-angles of contacts without thickness; 0 for others.
    resistances : ndarray, shape (m,) [m K/W]
    angles : ndarray, shape (m,) [rad]
        Direction of the normal from the first to the second side.
    widths : ndarray, shape (m,) [m]
        sqrt(gap R_eff), over which a gap opens.
    at_wall : ndarray of bool, shape (m,)
    smaller : ndarray, shape (m,) [m]
        Smaller of the two radii.
    uniform_jump : bool
    """

    kind: Ints
    clearances: Floats
    distances: Floats
    ends: Floats
    corners: Floats
    own_corners: Floats
    half_angles: Floats
    resistances: Floats
    angles: Floats
    widths: Floats
    at_wall: Flags
    smaller: Floats
    uniform_jump: bool


def cell_edges(cells: LaguerreCells, radii: Floats, contacts: EdgeContacts | None = None) -> CellEdges:
    """Edges with their contacts: cut where disks overlap, else as prescribed, else a gap or a touching point.

    Raises
    ------
    GeometryError
        If a prescribed contact is wider than its edge.
    """
    contacts = contacts or EdgeContacts.none(cells.edge_count)
    i = cells.cells[:, 0]
    j = np.where(cells.at_wall, i, cells.cells[:, 1])
    pair = np.column_stack((radii[i], radii[j]))
    smaller = pair.min(axis=1)
    touching = np.abs(cells.gaps) < ROUND_OFF_GAP * smaller
    gaps = np.where(touching, 0.0, cells.gaps)
    apart = cells.distances.sum(axis=1)
    clearances = 0.5 * gaps[:, None] * (gaps[:, None] + 2.0 * pair[:, ::-1]) / apart[:, None]
    distances = pair + clearances
    chord = np.sqrt(np.maximum(-clearances[:, 0] * (pair[:, 0] + distances[:, 0]), 0.0))
    # where the overlap is wider than a prescribed contact, it is the contact
    cut = (gaps < 0.0) & (chord >= (pair * np.sin(contacts.half_angles)).min(axis=1))
    half_angles = np.where(cut[:, None], 0.0, contacts.half_angles)
    bonded = half_angles.max(axis=1) > 0.0
    own = np.where(bonded[:, None], distances * np.tan(half_angles), chord[:, None])
    neck = ~bonded & (gaps >= 0.0) & (contacts.necks > 0.0)
    own = np.where(neck[:, None], contacts.necks[:, None], own)
    kind = np.select([bonded, gaps < 0.0, neck, touching], [BONDED, CUT, NECK, TOUCHING], GAP)
    corners = np.sqrt(own[:, 0] * own[:, 1])
    _refuse_wide(cells, kind, np.maximum(corners, own.max(axis=1)))
    return CellEdges(
        kind.astype(np.int64),
        clearances,
        distances,
        cells.ends,
        corners,
        own,
        half_angles,
        np.where(corners > 0.0, contacts.resistances, 0.0),
        np.arctan2(cells.normals[:, 1], cells.normals[:, 0]),
        np.sqrt(np.maximum(gaps, 0.0) * 2.0 * pair[:, 0] * pair[:, 1] / pair.sum(axis=1)),
        cells.at_wall,
        smaller,
        contacts.uniform_jump,
    )


def release_contacts(edges: CellEdges, rows: Flags) -> CellEdges:
    """The same edges with the marked prescribed contacts taken away; overlaps stay.

    Parameters
    ----------
    edges : CellEdges
    rows : ndarray of bool, shape (m,)
    """
    free = rows & ((edges.kind == BONDED) | (edges.kind == NECK)) & (edges.clearances[:, 0] >= 0.0)
    return edges._replace(
        kind=np.where(free, np.where(edges.widths > 0.0, GAP, TOUCHING), edges.kind),
        corners=np.where(free, 0.0, edges.corners),
        own_corners=np.where(free[:, None], 0.0, edges.own_corners),
        half_angles=np.where(free[:, None], 0.0, edges.half_angles),
        resistances=np.where(free, 0.0, edges.resistances),
    )


def _refuse_wide(cells: LaguerreCells, kind: Ints, corners: Floats) -> None:
    """Raise for a prescribed contact that reaches beyond its edge."""
    room = np.minimum(-cells.ends[:, 0], cells.ends[:, 1])
    wide = np.flatnonzero(((kind == BONDED) | (kind == NECK)) & (corners >= room))
    if wide.size:
        e = int(wide[0])
        i, j = (int(v) for v in cells.cells[e])
        other = f"particle {j}" if j >= 0 else "a wall"
        raise GeometryError(
            f"the contact between particle {i} and {other} is wider ({corners[e]:.4g} on either side of the line of "
            f"centres) than their common Laguerre edge allows ({room[e]:.4g}): use a smaller contact angle"
        )


def grid_edges(
    edges: CellEdges, ratio: Floats, degrees: Ints, *, corner: float = CORNER, longest: float = LONGEST
) -> EdgeGrid:
    """Divide the edges.

    Parameters
    ----------
    edges : CellEdges
    ratio : ndarray, shape (m,)
        k_f over the larger k_s on both sides: it sets the smallest interval at touching points.
    degrees : ndarray of int64, shape (m,)
        An edge gets at least as many intervals as its degree.
    corner : float
        Smallest interval at the ends of a contact, in half-widths.
    longest : float
        Longest interval, in smaller radii.

    Returns
    -------
    EdgeGrid
    """
    fine = np.clip(ratio, FINEST, 0.3) * edges.smaller
    at_corner = np.where(ratio > 0.5, np.maximum(fine, corner * edges.corners), corner * edges.corners)
    at_middle = np.where(edges.kind == NECK, 0.5 * edges.corners, fine * corner / CORNER)
    cap = np.minimum(longest * edges.smaller, 1.0001 * (edges.ends[:, 1] - edges.ends[:, 0]) / degrees)
    widths = np.where(edges.kind == GAP, np.maximum(edges.widths, fine), edges.widths)
    starts, points = divide_edges(
        edges.kind, edges.ends, edges.corners, widths, np.column_stack((at_corner, at_middle)), cap
    )
    return EdgeGrid(starts, points)
