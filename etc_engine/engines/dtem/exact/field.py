"""Temperature inside the disks of method ``exact``, from the waves of their chords."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.exact.cut_disk import solve_cut_disk
from etc_engine.engines.dtem.exact.element import Chords, chords_of_field, of_disk
from etc_engine.engines.dtem.exact.lune import ChordPoints, chord_points
from etc_engine.engines.dtem.exact.waves import chord_waves, temperature_at
from etc_engine.medium.sides import ContactSides


@njit(cache=True)
def loaded_waves(
    chords: Chords, p: int, flows: Floats, conductivity: float, points: ChordPoints
) -> tuple[bool, Floats, Floats, Floats]:
    """Whether disk p carries heat, its waves (see `chord_waves`), and the mean temperature over each chord and mode."""
    modes = flows.shape[1]
    first, count = chords.offsets[p], chords.offsets[p + 1] - chords.offsets[p]
    coefficients, loaded = np.zeros((count, modes)), False
    for a in range(count):
        row = chords.rows[first + a]
        for k in range(modes):
            if row >= 0:
                coefficients[a, k] = (chords.signs[first + a] if k % 2 else 1.0) * flows[row, k] / conductivity
                loaded |= coefficients[a, k] != 0.0
    if not loaded:
        return False, np.zeros((0, 2, 1)), np.zeros((0, 2)), np.zeros(0)
    theta, alpha, fluxes, levels = of_disk(chords, p)
    h = np.empty((count * modes, count * modes))
    offsets, densities, _ = solve_cut_disk(theta, alpha, fluxes, levels, points, h)
    load = coefficients.ravel()
    transforms, constants = chord_waves(alpha, fluxes, levels, offsets, densities @ load, coefficients, points)
    return True, transforms, constants, h @ load


def exact_temperatures(
    sides: ContactSides,
    conductivity: Floats,
    flows: Floats,
    particles: Ints,
    points: Floats,
) -> Floats:
    """Temperature at points inside cut disks above that of their centres, shape (q,).

    Parameters
    ----------
    sides : ContactSides
        All sides of a network, with ``cuts``.
    conductivity : ndarray, shape (n,) [W/(m K)]
    flows : ndarray, shape (s, modes) [W/m]
    particles : ndarray of int, shape (q,)
    points : ndarray, shape (q, 2)
        Position from the particle's centre in its radii; a point beyond a chord takes its value on the chord.
    """
    chords, _ = chords_of_field(sides, conductivity, flows)
    order = np.argsort(particles, kind="stable")
    z = points[order, 0] + 1j * points[order, 1]
    values = np.zeros(particles.size)
    flows = np.ascontiguousarray(flows)
    values[order] = _inside(chords, conductivity, flows, particles[order], z, chord_points(chords.levels))
    return values


@njit(cache=True)
def _inside(
    chords: Chords,
    conductivity: Floats,
    flows: Floats,
    particles: Ints,
    z: NDArray[np.complex128],
    points: ChordPoints,
) -> Floats:
    values = np.zeros(z.size)
    start = 0
    while start < z.size:
        p = particles[start]
        end = start
        while end < z.size and particles[end] == p:
            end += 1
        loaded, transforms, constants, _ = loaded_waves(chords, p, flows, conductivity[p], points)
        if loaded:
            theta, alpha, _, _ = of_disk(chords, p)
            for q in range(start, end):
                if abs(z[q]) > 1e-9:  # the sinks at the centre cancel there
                    values[q] = temperature_at(z[q], -1, 0.0, theta, alpha, transforms, constants)
        start = end
    return values
