r"""Method ``exact``: every disk cut by all its contact chords, the flux through them resolved in modes.

The flux per unit s through a contact chord, -1 <= s <= 1, is

    q(s) = sum_k c_k R_k(s) (1 - s^2)^(b - 1) / B,    B = int (1 - s^2)^(b - 1) ds,

R_k Gegenbauer polynomials and b the exponent of the corner where the two disks meet. It is equal and opposite on
the two sides, and the temperatures are matched by Galerkin with the same modes. What is left of the error is the
number of modes: every one gains about two digits.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.engines.dtem.element import Elements, condense, packed_starts, refuse_indefinite
from etc_engine.engines.dtem.exact.cut_disk import potentials_at, solve_cut_disk
from etc_engine.engines.dtem.exact.film import Film, contact_film
from etc_engine.engines.dtem.exact.lune import LEVELS, ChordPoints, FluxModes, chord_points
from etc_engine.errors import GeometryError
from etc_engine.laws.disk import position_angles
from etc_engine.medium.sides import ContactSides, refuse_overlap

MODES = 3
"""Flux modes of a contact."""
SMALL_ANGLE = np.radians(7.0)
"""Half-angle up to which the coarsest points serve: the corners of such a lune are nearly smooth."""
POINTS_OF_MODES = ((3, 20), (4, 28), (6, 44))
"""Modes that a number of points serves; beyond the last, 52."""
DIGITS = 12.0
"""Logarithm of the error that the sink at the centre may leave at the points of a chord."""


class Chords(NamedTuple):
    """All chords that cut the disks, sorted by particle.

    Parameters
    ----------
    offsets : ndarray of int, shape (n + 1,)
        Chords of particle p: ``offsets[p]`` to ``offsets[p + 1]``.
    rows : ndarray of int, shape (c,)
        Contact side of each chord, -1 at an insulated one.
    theta, alpha : ndarray, shape (c,) [rad]
    exponents : ndarray, shape (c,)
        b of the flux at its ends.
    levels : ndarray of int, shape (c,)
        Row of `etc_engine.engines.dtem.exact.lune.LEVELS`.
    signs : ndarray, shape (c,)
        Sign of odd modes.
    nodes : ndarray of int, shape (c,)
        Contact of each chord; any at an insulated one.
    film : Film
        What contacts resist.
    """

    offsets: Ints
    rows: Ints
    theta: Floats
    alpha: Floats
    exponents: Floats
    levels: Ints
    signs: Floats
    nodes: Ints
    film: Film


def exact_elements(sides: ContactSides, conductivity: Floats, modes: int = MODES) -> Elements:
    """Conductivity matrices of all disks over (contact, mode).

    Parameters
    ----------
    sides : ContactSides
        With ``cuts``, chords that nothing passes. The temperature jump of a resistance over the contact area follows
        the flux along the contact. That of a resistance given as one number is uniform over it: it acts on mode 0
        alone.
    conductivity : ndarray, shape (n,) [W/(m K)]
    modes : int

    Returns
    -------
    Elements

    Raises
    ------
    GeometryError
        If chords of a disk cross, nearly touch, or are too wide.

    Notes
    -----
    The Neumann problem of the cut disk is solved to about 1e-8 (see
    `etc_engine.engines.dtem.exact.cut_disk`) for any number of modes, in about a millisecond per disk.
    """
    chords = cut_chords(sides, conductivity, modes=modes)
    offsets = modes * sides.offsets
    starts = packed_starts(offsets)
    values = np.zeros(int(starts[-1]))
    bad = _fill(
        sides.offsets,
        chords,
        conductivity,
        modes,
        starts,
        values,
        chord_points(chords.levels),
    )
    refuse_indefinite(bad, sides)
    nodes = (modes * sides.nodes[:, None] + np.arange(modes)).ravel()
    return Elements(modes, offsets, nodes, starts, values)


def exact_potentials(sides: ContactSides, conductivity: Floats, flows: Floats) -> Floats:
    """Weighted mean temperature of every chord above that of its disk's centre, shape (s,), of flows (s, modes).

    Parameters
    ----------
    sides : ContactSides
        All sides of a network; ``cuts`` says which of its wall contacts are insulated chords, the other ones
        without flux are points of the arc.
    conductivity : ndarray, shape (n,) [W/(m K)]
    flows : ndarray, shape (s, modes) [W/m]
    """
    chords, on_arc = chords_of_field(sides, conductivity, flows)
    return _potentials(
        chords,
        conductivity,
        np.ascontiguousarray(flows),
        sides.offsets,
        on_arc,
        chord_points(chords.levels),
    )


def exact_drops(sides: ContactSides, conductivity: Floats, flows: Floats) -> Floats:
    """Weighted mean temperature of every contact above that of the side's face, shape (s,), of flows (s, modes)."""
    film = contact_film(sides, conductivity, edge_exponents(sides, conductivity), flows.shape[1])
    return np.asarray(np.einsum("sm,sm->s", film.blocks[:, 0], flows))


def chords_of_field(sides: ContactSides, conductivity: Floats, flows: Floats) -> tuple[Chords, Floats]:
    """Chords of a whole network with flows (s, modes), and the angle of wall contacts that cut nothing, else NaN."""
    uncut = np.zeros(sides.nodes.size, dtype=np.bool_)
    uncut[sides.of_walls] = ~flows[sides.of_walls].any(axis=1)
    cut_rows = sides.of_walls[sides.cuts.walls]
    chords = cut_chords(sides, conductivity, uncut, cut_rows, modes=flows.shape[1])
    on_arc = np.where(uncut, position_angles(sides.arms), np.nan)
    on_arc[cut_rows] = np.nan
    return chords, on_arc


def cut_chords(
    sides: ContactSides,
    conductivity: Floats,
    uncut: Flags | None = None,
    cut_rows: Ints | None = None,
    *,
    modes: int,
) -> Chords:
    """The chords of all contact sides but the ``uncut`` ones, and the insulated cuts with their rows (-1)."""
    cuts = sides.cuts
    kept = np.arange(sides.nodes.size) if uncut is None else np.flatnonzero(~uncut)
    owner = np.concatenate([sides.particles[kept], cuts.particles])
    order = np.argsort(owner, kind="stable")
    offsets = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=sides.offsets.size - 1))])
    rows = np.concatenate([kept, np.full(cuts.particles.size, -1) if cut_rows is None else cut_rows])[order]
    arms = np.concatenate([sides.arms[kept], cuts.arms])[order]
    theta = position_angles(arms)
    alpha = np.concatenate([sides.alpha[kept], cuts.alpha])[order]
    at_contacts = edge_exponents(sides, conductivity)
    exponents = np.concatenate([at_contacts[kept], np.ones(cuts.particles.size)])[order]
    signs = np.concatenate([sides.mode_signs[kept], np.ones(cuts.particles.size)])[order]
    refuse_overlap(offsets, arms, alpha)
    levels = _choose_levels(offsets, theta, alpha, modes)
    nodes = np.concatenate([sides.nodes[kept], np.zeros(cuts.particles.size, dtype=np.int64)])[order]
    film = contact_film(sides, conductivity, at_contacts, modes)
    return Chords(offsets, rows, theta, alpha, exponents, levels, signs, nodes, film)


def edge_exponents(sides: ContactSides, conductivity: Floats) -> Floats:
    """Exponent b of the flux (1 - s^2)^(b - 1) at the ends of each side's contact, shape (s,).

    Wedges of conductivity kappa_A, kappa_B and angles pi - alpha_A, pi - alpha_B that meet, insulated outside, have
    kappa_A tan(b (pi - alpha_A)) + kappa_B tan(b (pi - alpha_B)) = 0; equal ones b = pi/(2 pi - alpha_A - alpha_B), and
    an isothermal wall b = pi/(2 (pi - alpha_A)).
    """
    a, b = np.pi - sides.alpha[sides.of_contacts].T
    kappa_a, kappa_b = conductivity[sides.particles[sides.of_contacts]].T
    low, high = 0.5 * np.pi / np.maximum(a, b), 0.5 * np.pi / np.minimum(a, b)
    for _ in range(60):  # halving down to round-off; the left side rises through its only zero between the two poles
        middle = 0.5 * (low + high)
        over = kappa_a * np.sin(middle * a) * np.cos(middle * b) + kappa_b * np.cos(middle * a) * np.sin(middle * b)
        low, high = np.where(over > 0.0, middle, low), np.where(over > 0.0, high, middle)
    exponents = 0.5 * np.pi / (np.pi - sides.alpha)
    exponents[sides.of_contacts] = (0.5 * (low + high))[:, None]
    return exponents


def _choose_levels(offsets: Ints, theta: Floats, alpha: Floats, modes: int) -> Ints:
    """The cheapest points that resolve each chord: neighbours' corners, its own, the sink, the modes."""
    enough = min((points for most, points in POINTS_OF_MODES if modes <= most), default=52)
    clearance = _clearances(offsets, theta, alpha)
    levels = np.full(alpha.size, -1, dtype=np.int64)
    for level, (made_for, points) in reversed(list(enumerate(LEVELS))):
        stretch = np.arctanh(1.0 / (1.0 + made_for))
        sink = np.arctan(np.tanh(stretch) / np.tan(alpha)) / stretch
        fit = (clearance >= made_for) & (points * np.arcsinh(sink) >= DIGITS) & (points >= enough)
        levels[fit & ((alpha <= SMALL_ANGLE) | (made_for <= 0.1))] = level
    bad = np.flatnonzero(levels < 0)
    if bad.size:
        particle = int(np.searchsorted(offsets, bad[0], side="right")) - 1
        least = min(made_for for made_for, _ in LEVELS)
        why = (
            f"two contact chords end {clearance[bad[0]]:.2g} half-chords apart, it takes {least:g}"
            if clearance[bad[0]] < least
            else f"the half-angle {np.degrees(alpha[bad[0]]):.4g} degrees of a contact is too wide"
        )
        raise GeometryError(f"particle {particle} is beyond method exact: {why}; use smaller contact angles")
    return levels


@njit(cache=True)
def _clearances(offsets: Ints, theta: Floats, alpha: Floats) -> Floats:
    """Distance of each chord's ends to the nearest end of another chord of its disk, in its half-widths."""
    clearance = np.empty(theta.size)
    for a in range(theta.size):
        clearance[a] = np.inf
    for p in range(offsets.size - 1):
        for a in range(offsets[p], offsets[p + 1]):
            for b in range(offsets[p], offsets[p + 1]):
                if a != b:
                    apart = abs(theta[a] - theta[b]) % (2.0 * np.pi)
                    gap = min(apart, 2.0 * np.pi - apart) - alpha[a] - alpha[b]
                    clearance[a] = min(clearance[a], 2.0 * np.sin(0.5 * max(gap, 0.0)) / np.sin(alpha[a]))
    return clearance


@njit(cache=True)
def _fill(
    side_offsets: Ints,
    chords: Chords,
    conductivity: Floats,
    modes: int,
    starts: Ints,
    values: Floats,
    points: ChordPoints,
) -> int:
    """Fill the packed matrices; returns the first particle whose H is not positive definite, or -1."""
    for p in range(side_offsets.size - 1):
        first, contacts = chords.offsets[p], side_offsets[p + 1] - side_offsets[p]
        size = contacts * modes
        if size < 2:
            continue
        every = (chords.offsets[p + 1] - first) * modes
        h = np.empty((every, every))  # the chords of contacts come before those of insulated walls
        solve_cut_disk(*of_disk(chords, p), points, h)
        for a in range(contacts):
            for k in range(modes):
                for b in range(contacts):
                    for l in range(modes):
                        sign = (chords.signs[first + a] if k % 2 else 1.0) * (chords.signs[first + b] if l % 2 else 1.0)
                        h[a * modes + k, b * modes + l] *= sign / conductivity[p]
            row = chords.rows[first + a]
            for k in range(modes):
                for l in range(modes):
                    h[a * modes + k, a * modes + l] += chords.film.blocks[row, k, l]
        work = np.empty((size, size))
        if not condense(h, size, modes, work, values[starts[p] : starts[p + 1]]):
            return p
    return -1


@njit(cache=True)
def _potentials(
    chords: Chords,
    conductivity: Floats,
    flows: Floats,
    side_offsets: Ints,
    arc_points: Floats,
    points: ChordPoints,
) -> Floats:
    modes = flows.shape[1]
    potentials = np.zeros(flows.shape[0])
    for p in range(side_offsets.size - 1):
        first, count = chords.offsets[p], chords.offsets[p + 1] - chords.offsets[p]
        coefficients = np.zeros(count * modes)
        for a in range(count):
            for k in range(modes):
                sign = chords.signs[first + a] if k % 2 else 1.0
                coefficients[a * modes + k] = sign * flows[chords.rows[first + a], k] / conductivity[p]
        if not np.any(coefficients):
            continue
        h = np.empty((count * modes, count * modes))
        theta, alpha, fluxes, levels = of_disk(chords, p)
        starts, _, strengths = solve_cut_disk(theta, alpha, fluxes, levels, points, h)
        means, sources = h @ coefficients, strengths @ coefficients
        for a in range(count):
            row = chords.rows[first + a]
            potentials[row] = means[a * modes] + (chords.film.blocks[row, 0] * flows[row]).sum()
        for side in range(side_offsets[p], side_offsets[p + 1]):
            if not np.isnan(arc_points[side]):
                z = np.exp(1j * arc_points[side])
                potentials[side] = potentials_at(z, theta, alpha, levels, starts, points) @ sources
    return potentials


@njit(cache=True)
def of_disk(chords: Chords, p: int) -> tuple[Floats, Floats, FluxModes, Ints]:
    """Position angles, half-angles, flux modes and levels of the chords of one disk."""
    own = slice(chords.offsets[p], chords.offsets[p + 1])
    profiles = chords.film.profiles
    if profiles.shape[0] > 0:
        profiles = profiles[chords.nodes[own]]
    return chords.theta[own], chords.alpha[own], FluxModes(chords.exponents[own], profiles), chords.levels[own]
