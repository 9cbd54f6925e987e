r"""The Neumann problem of a disk cut by several chords, from those of its lunes.

The temperature is a sum of lune solutions, one for each chord, T = sum_j N_j[q_j]. Each satisfies the insulated arc
exactly; the flux through chord i is q_i, plus what the other solutions send through it, and must be phi_i:

    q_i + sum_(j /= i) K_ij q_j = phi_i.

With q = phi + g this is an equation of the second kind for a smooth g, whose kernel is analytic as long as the
chords do not touch: a few points a chord (Nystroem) reach round-off.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.engines.dtem.exact.lune import (
    WAVES,
    ChordPoints,
    FluxModes,
    centre_constant,
    chord_transforms,
    chord_weights,
    own_resistances,
)


@njit(cache=True)
def half_plane(z: complex, theta: float, alpha: float) -> tuple[complex, complex]:
    """Image zeta of a point of the lune, and dzeta/dz."""
    first, second = np.exp(1j * (theta - alpha)), np.exp(1j * (theta + alpha))
    power = np.pi / (np.pi - alpha)
    zeta = np.exp(power * np.log((z - first) / (second - z)))
    return zeta, zeta * power * (second - first) / ((z - first) * (second - z))


@njit(cache=True)
def chord_point(s: float, theta: float, alpha: float) -> complex:
    """Point of the chord, from its end at theta - alpha (s = -1) to that at theta + alpha."""
    return (np.cos(alpha) + 1j * s * np.sin(alpha)) * np.exp(1j * theta)


@njit(cache=True)
def source_images(
    alpha: float, s: NDArray[np.float64], images: NDArray[np.float64], lifts: NDArray[np.float64]
) -> complex:
    """Half-plane images of the points of a chord, their ln |zeta_O - image|/pi, and zeta_O itself."""
    power = np.pi / (np.pi - alpha)
    centre = np.exp(1j * power * (np.pi - 2.0 * alpha))
    for m in range(s.size):
        images[m] = ((1.0 + s[m]) / (1.0 - s[m])) ** power
        lifts[m] = np.log(np.abs(centre - images[m])) / np.pi
    return centre


@njit(cache=True)
def _influence(
    z: complex,
    normal: complex,
    chord: tuple[float, float],
    centre: complex,
    images: NDArray[np.float64],
    lifts: NDArray[np.float64],
    flux: NDArray[np.float64],
    potential: NDArray[np.float64],
) -> None:
    """Flux along ``normal`` and temperature at z of unit sources at the points of another chord (theta, alpha).

    T = Re[sink(zeta)] + lift_m - ln|zeta - zeta_m|/pi in the half-plane zeta of the chord, flux its derivative.
    """
    theta, alpha = chord
    zeta, slope = half_plane(z, theta, alpha)
    up, down = zeta - centre, zeta - np.conj(centre)
    sink_flux = (1.0 / up + 1.0 / down) / (2.0 * np.pi)
    sink = np.log(np.abs(up * down)) / (2.0 * np.pi) - centre_constant(alpha)
    turned = slope * normal
    for m in range(images.size):
        apart = zeta - images[m]
        flux[m] = (turned * (sink_flux - 1.0 / (np.pi * apart))).real
        potential[m] = sink + lifts[m] - np.log(np.abs(apart)) / np.pi


@njit(cache=True)
def influence_matrices(
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    level: NDArray[np.int64],
    offsets: NDArray[np.int64],
    s: NDArray[np.float64],
    flux: NDArray[np.float64],
    potential: NDArray[np.float64],
) -> None:
    """Flux per unit s, and temperature, at the points of each chord from unit sources at those of the others."""
    flux[:], potential[:] = 0.0, 0.0
    images, lifts = np.empty(s.shape[1]), np.empty(s.shape[1])
    for j in range(theta.size):
        columns = slice(offsets[j], offsets[j + 1])
        count = offsets[j + 1] - offsets[j]
        centre = source_images(alpha[j], s[level[j], :count], images[:count], lifts[:count])
        for i in range(theta.size):
            if i == j:
                continue
            normal = np.sin(alpha[i]) * np.exp(1j * theta[i])
            for m in range(offsets[i], offsets[i + 1]):
                z = chord_point(s[level[i], m - offsets[i]], theta[i], alpha[i])
                _influence(
                    z,
                    normal,
                    (theta[j], alpha[j]),
                    centre,
                    images[:count],
                    lifts[:count],
                    flux[m, columns],
                    potential[m, columns],
                )


@njit(cache=True)
def potentials_at(
    z: complex,
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    level: NDArray[np.int64],
    offsets: NDArray[np.int64],
    points: ChordPoints,
) -> NDArray[np.float64]:
    """Temperature at a point away from all chords, from unit sources at every chord's points."""
    values, flux = np.empty(offsets[-1]), np.empty(offsets[-1])
    images, lifts = np.empty(points.s.shape[1]), np.empty(points.s.shape[1])
    for j in range(theta.size):
        own = slice(offsets[j], offsets[j + 1])
        count = offsets[j + 1] - offsets[j]
        centre = source_images(alpha[j], points.s[level[j], :count], images[:count], lifts[:count])
        _influence(z, 1.0 + 0.0j, (theta[j], alpha[j]), centre, images[:count], lifts[:count], flux[own], values[own])
    return values


@njit(cache=True)
def solve_in_place(a: NDArray[np.float64], b: NDArray[np.float64]) -> bool:
    """Solve a x = b for several right-hand sides, by rows with partial pivoting; x replaces b."""
    n, loads = b.shape
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[pivot, k]):
                pivot = i
        if not abs(a[pivot, k]) > 0.0:
            return False
        if pivot != k:
            for j in range(k, n):
                a[k, j], a[pivot, j] = a[pivot, j], a[k, j]
            for j in range(loads):
                b[k, j], b[pivot, j] = b[pivot, j], b[k, j]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            if factor != 0.0:
                for j in range(k + 1, n):
                    a[i, j] -= factor * a[k, j]
                for j in range(loads):
                    b[i, j] -= factor * b[k, j]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            factor = a[i, k]
            for j in range(loads):
                b[i, j] -= factor * b[k, j]
        for j in range(loads):
            b[i, j] /= a[i, i]
    return True


@njit(cache=True)
def solve_cut_disk(
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    fluxes: FluxModes,
    level: NDArray[np.int64],
    points: ChordPoints,
    h: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Kappa H over (chord, mode) into ``h``, and the densities behind it: g_i + sum_j K_ij g_j = -sum_j K_ij phi_j.

    Returns the offsets of each chord's points, the smooth densities g at them, and the strengths of the point
    sources that stand for phi + g away from their own chord, both of shape (points, chords * modes).
    """
    chords, modes = theta.size, fluxes.profiles.shape[1]
    offsets = np.zeros(chords + 1, dtype=np.int64)
    for i in range(chords):
        offsets[i + 1] = offsets[i] + points.counts[level[i]]
    total = offsets[chords]
    flux, potential = np.empty((total, total)), np.empty((total, total))
    influence_matrices(theta, alpha, level, offsets, points.s, flux, potential)

    of_modes = np.zeros((total, chords * modes))
    densities = np.zeros((total, chords * modes))
    weight = np.empty((modes, points.s.shape[1]))
    for j in range(chords):
        v, count = level[j], offsets[j + 1] - offsets[j]
        chord_weights(fluxes, j, v, points, weight[:, :count])
        for m in range(count):
            for k in range(modes):
                of_modes[offsets[j] + m, j * modes + k] = weight[k, m]
            for i in range(total):
                for k in range(modes):
                    densities[i, j * modes + k] -= flux[i, offsets[j] + m] * weight[k, m]
                flux[i, offsets[j] + m] *= points.weights[v, m]
    for i in range(total):
        flux[i, i] += 1.0
    solve_in_place(flux, densities)

    strengths = of_modes.copy()
    for j in range(chords):
        for m in range(offsets[j], offsets[j + 1]):
            weight_here = points.weights[level[j], m - offsets[j]]
            for column in range(chords * modes):
                strengths[m, column] += weight_here * densities[m, column]
    _own_parts(alpha, fluxes, level, offsets, points, densities, h)
    for i in range(chords):
        for m in range(offsets[i], offsets[i + 1]):
            for n in range(total):
                if potential[m, n] != 0.0:
                    for k in range(modes):
                        factor = of_modes[m, i * modes + k] * potential[m, n]
                        for column in range(chords * modes):
                            h[i * modes + k, column] += factor * strengths[n, column]
    return offsets, densities, strengths


@njit(cache=True)
def _own_parts(
    alpha: NDArray[np.float64],
    fluxes: FluxModes,
    level: NDArray[np.int64],
    offsets: NDArray[np.int64],
    points: ChordPoints,
    densities: NDArray[np.float64],
    h: NDArray[np.float64],
) -> None:
    """Part of kappa H that the densities of a chord cause on that chord itself."""
    modes = fluxes.profiles.shape[1]
    transforms = np.empty((modes, WAVES))
    between, towards = np.empty((modes, modes)), np.empty((modes, points.s.shape[1]))
    h[:] = 0.0
    for i in range(alpha.size):
        v, count = level[i], offsets[i + 1] - offsets[i]
        chord_transforms(fluxes, i, transforms)
        own_resistances(alpha[i], v, points, transforms, between, towards)
        for k in range(modes):
            for l in range(modes):
                h[i * modes + k, i * modes + l] += between[k, l]
            for m in range(count):
                for column in range(h.shape[1]):
                    h[i * modes + k, column] += towards[k, m] * densities[offsets[i] + m, column]
