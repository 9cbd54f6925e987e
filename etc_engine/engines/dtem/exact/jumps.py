r"""Jumps of the temperature of ``exact`` across contacts, and the energy of removing them.

The fluxes of the method balance in every disk and across every contact; its temperatures T_p, harmonic in every
disk, agree across a contact in the mean over every flux mode, but jump by J(s) in between: beyond r q(s), where the
contact resists over its area. Take half of the jump
away on either side (all of it at a wall) by adding to T_p a field v_p with those values on the chords of p. The
result is continuous, and its energy is

    E(T + v) = E(T) + sum_p kappa_p int |grad v_p|^2,

because the mixed term sum_p int q_p v_p runs over flux modes times jumps and vanishes. Any v_p will do for a
bound; the one taken here, in the strip x + i y of each chord (see `etc_engine.engines.dtem.exact.lune`), is

    v = J(x) (1 - a(x) min(y/Y, 1)),

with Y so small, and a = 1 up to |x| so large, that it vanishes on the other contact chords.

A resistance over the area may take the jump instead of v_p: with r_p the part of r on either side (all of it at a
wall), int J^2/r_p over the contact, J being the part of the jump on that side. The cheaper of the two counts.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.exact.cut_disk import chord_point
from etc_engine.engines.dtem.exact.element import Chords, cut_chords, of_disk
from etc_engine.engines.dtem.exact.field import loaded_waves
from etc_engine.engines.dtem.exact.film import flux_densities
from etc_engine.engines.dtem.exact.lune import PROFILE_STEP, ChordPoints, chord_points
from etc_engine.engines.dtem.exact.waves import chord_trace
from etc_engine.engines.dtem.steady import SteadySolution
from etc_engine.medium.sides import ContactSides

STEP = PROFILE_STEP
"""Step along chi; the jump and its fourth-order differences are smooth at the scale 1/modes."""
REACH = 50
"""Points on either side, up to chi = 20, where the jump is constant to 1e-5 of itself."""
SHARE = 0.95
"""Part of the sampled distance to other chords that is used."""
SAMPLES = 33
"""Points of another chord."""


def jump_energies(solution: SteadySolution, load: int = 0) -> Floats:
    """Energy it takes to make the temperatures of ``exact`` continuous, by particle, shape (n,) [W K/m].

    Parameters
    ----------
    solution : SteadySolution
        Of method ``exact``.
    load : int
    """
    sides, kappa = solution.sides, solution.medium.conductivity
    chords = cut_chords(sides, kappa, modes=solution.modes)
    chi = np.linspace(-REACH, REACH, 2 * REACH + 1) * STEP
    deviations = np.zeros((sides.nodes.size, chi.size))
    flows = np.ascontiguousarray(solution.flows[:, :, load])
    _deviations(chords, kappa, flows, chi, chord_points(chords.levels), deviations)
    films = np.where(sides.area_resistances > 0.0, sides.area_resistances / sides.reaches, 0.0)
    if chords.film.profiles.size:
        deviations += films[:, None] * _densities(chords, sides, flows)
        deviations -= np.einsum("sm,sm->s", chords.film.blocks[:, 0], flows)[:, None]
        deviations += (sides.lumped_resistances * flows[:, 0])[:, None]
    jumps = deviations.copy()
    first, second = sides.of_contacts.T
    jumps[first] = 0.5 * (deviations[first] - deviations[second, ::-1])
    jumps[second] = 0.5 * (deviations[second] - deviations[first, ::-1])
    slopes = np.zeros_like(jumps)
    slopes[:, 2:-2] = (8.0 * (jumps[:, 3:-1] - jumps[:, 1:-3]) - jumps[:, 4:] + jumps[:, :-4]) / (12.0 * STEP)
    return _extension_energies(chords, kappa, chi, jumps, slopes, films)


def _densities(chords: Chords, sides: ContactSides, flows: Floats) -> Floats:
    """Flux per unit s into the particle along every contact side, at the points of the jumps, shape (s, points)."""
    half = flux_densities(chords.film.profiles)[sides.nodes, :, : REACH + 1]
    odd = np.arange(flows.shape[1]) % 2 == 1
    coefficients = flows * np.where(odd, sides.mode_signs[:, None], 1.0)
    even_part = np.einsum("sm,smx->sx", np.where(odd, 0.0, coefficients), half)
    odd_part = np.einsum("sm,smx->sx", np.where(odd, coefficients, 0.0), half)
    return np.concatenate([(even_part - odd_part)[:, :0:-1], even_part + odd_part], axis=1)


@njit(cache=True)
def _deviations(
    chords: Chords,
    conductivity: Floats,
    flows: Floats,
    chi: Floats,
    points: ChordPoints,
    out: Floats,
) -> None:
    """Temperature along the chord of every contact side above its weighted mean there."""
    modes = flows.shape[1]
    for p in range(chords.offsets.size - 1):
        first, count = chords.offsets[p], chords.offsets[p + 1] - chords.offsets[p]
        loaded, transforms, constants, means = loaded_waves(chords, p, flows, conductivity[p], points)
        if not loaded:
            continue
        theta, alpha, _, _ = of_disk(chords, p)
        for a in range(count):
            row = chords.rows[first + a]
            if row >= 0:
                chord_trace(a, chi, theta, alpha, transforms, constants, out[row])
                for n in range(chi.size):
                    out[row, n] -= means[a * modes]


@njit(cache=True)
def _extension_energies(
    chords: Chords,
    conductivity: Floats,
    chi: Floats,
    jumps: Floats,
    slopes: Floats,
    films: Floats,
) -> Floats:
    """Energy of an extension of all jumps of each particle, (sum of the roots of one at a time) squared.

    Where a contact resists over its area and that is cheaper, the energy of the jump in the resistance, r_p/c.
    """
    energies = np.zeros(chords.offsets.size - 1)
    for p in range(energies.size):
        total, in_films = 0.0, 0.0
        for a in range(chords.offsets[p], chords.offsets[p + 1]):
            row = chords.rows[a]
            if row >= 0:
                reach, depth = _free_strip(chords, p, a)
                energy = _least_extension(np.pi - chords.alpha[a], reach, depth, chi, jumps[row], slopes[row])
                film = np.inf
                if films[row] > 0.0:
                    film = 0.0
                    for n in range(chi.size):
                        film += jumps[row, n] ** 2 / np.cosh(0.5 * chi[n]) ** 2
                    film = 0.5 * STEP * film / films[row]
                if film < conductivity[p] * energy:
                    in_films += film
                else:
                    total += np.sqrt(energy)
        energies[p] = conductivity[p] * total**2 + in_films
    return energies


@njit(cache=True)
def _free_strip(chords: Chords, p: int, a: int) -> tuple[float, float]:
    """Largest |x| and smallest y of the other contact chords of particle p in the strip of chord a."""
    reach, depth = 0.0, np.pi - chords.alpha[a]
    first = np.exp(1j * (chords.theta[a] - chords.alpha[a]))
    second = np.exp(1j * (chords.theta[a] + chords.alpha[a]))
    for b in range(chords.offsets[p], chords.offsets[p + 1]):
        if b == a or chords.rows[b] < 0:
            continue
        for n in range(SAMPLES):
            z = chord_point(2.0 * n / (SAMPLES - 1.0) - 1.0, chords.theta[b], chords.alpha[b])
            w = np.log((z - first) / (second - z))
            reach, depth = max(reach, abs(w.real)), min(depth, w.imag)
    return reach / SHARE, depth * SHARE


@njit(cache=True)
def _least_extension(
    height: float,
    reach: float,
    depth: float,
    chi: Floats,
    jump: Floats,
    slope: Floats,
) -> float:
    """Smallest energy int |grad v|^2 among a few depths Y and ramps of a(x)."""
    least = np.inf
    for part in (1.0, 0.7, 0.5, 0.35, 0.25, 0.15):
        for ramp in (1.0, 2.0, 4.0, 8.0):
            y = part * depth
            mean, square = height - 0.5 * y, height - 2.0 * y / 3.0  # of min(y/Y, 1) across the strip
            energy = 0.0
            for n in range(chi.size):
                ratio = (abs(chi[n]) - reach) / ramp
                a = min(max(1.0 - ratio, 0.0), 1.0)
                fall = 0.0 if ratio <= 0.0 or ratio >= 1.0 else -np.sign(chi[n]) / ramp
                energy += slope[n] ** 2 * (height - 2.0 * a * mean + a * a * square)
                energy += jump[n] ** 2 * (fall * fall * square + a * a / y)
                energy -= 2.0 * jump[n] * slope[n] * fall * (mean - a * square)
            least = min(least, energy * (chi[1] - chi[0]))
    return least
