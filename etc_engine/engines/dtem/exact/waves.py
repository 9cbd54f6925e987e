r"""Temperature inside a cut disk, its chords included, from the waves of its lune solutions.

In the strip 0 <= y <= H = pi - alpha of its chord (see `etc_engine.engines.dtem.exact.lune`), a flux
density of transform C - i S is

    N(x + i y) = int_0^inf (C cos kx + S sin kx - C y_O(k)) cosh(k (H - y))/(pi k sinh kH) dk + Q (G(x + i y) - c),

the second term in the bracket being its value at O and G the sink there. It holds up to the chord, where point
sources would not.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.exact.cut_disk import chord_point
from etc_engine.engines.dtem.exact.lune import (
    SINK_WAVES,
    WAVE_STEP,
    WAVES,
    ChordPoints,
    FluxModes,
    centre_constant,
    chord_transforms,
    strip_symbols,
)


@njit(cache=True)
def chord_waves(
    alpha: Floats,
    fluxes: FluxModes,
    levels: Ints,
    offsets: Ints,
    densities: Floats,
    coefficients: Floats,
    points: ChordPoints,
) -> tuple[Floats, Floats]:
    """Transforms (chords, 2, waves) of the flux on each chord, and its net flow and constant (chords, 2).

    ``densities`` are the smooth ones of the loaded disk at the points of its chords, ``coefficients`` the flux
    modes, shape (chords, M).
    """
    modes = coefficients.shape[1]
    transforms = np.zeros((alpha.size, 2, SINK_WAVES))
    constants = np.zeros((alpha.size, 2))
    of_modes = np.empty((modes, WAVES))
    flux, sink = np.empty(SINK_WAVES), np.empty(SINK_WAVES)
    for i in range(alpha.size):
        v = levels[i]
        loaded = False
        for k in range(modes):
            loaded |= coefficients[i, k] != 0.0
        if loaded:
            chord_transforms(fluxes, i, of_modes)
            for k in range(modes):
                for n in range(WAVES):
                    transforms[i, k % 2, n] += coefficients[i, k] * of_modes[k, n]
        net = coefficients[i, 0]
        for m in range(offsets[i + 1] - offsets[i]):
            density = densities[offsets[i] + m]
            net += points.weights[v, m] * density
            for n in range(SINK_WAVES):
                transforms[i, 0, n] += density * points.cosines[v, n, m]
                transforms[i, 1, n] += density * points.sines[v, n, m]
        strip_symbols(alpha[i], points.waves, flux, sink)
        constants[i, 0] = net
        constants[i, 1] = -net * centre_constant(alpha[i])
        for n in range(SINK_WAVES):
            constants[i, 1] -= sink[n] * transforms[i, 0, n]
    return transforms, constants


@njit(cache=True)
def _in_strip(
    x: float,
    y: float,
    alpha: float,
    transforms: Floats,
    net: float,
) -> float:
    """Temperature of one lune solution at a point of its strip, but for its constant."""
    height = np.pi - alpha
    value = 0.0
    turn = np.exp(1j * WAVE_STEP * x)
    wave = np.exp(0.5j * WAVE_STEP * x)
    near, far = np.exp(-WAVE_STEP * y), np.exp(-WAVE_STEP * (2.0 * height - y))
    both = np.exp(-2.0 * WAVE_STEP * height)
    fall, rise, decay = np.sqrt(near), np.sqrt(far), np.sqrt(both)
    for n in range(transforms.shape[1]):
        k = (n + 0.5) * WAVE_STEP
        depth = (fall + rise) / (k * (1.0 - decay))
        value += depth * (transforms[0, n] * wave.real + transforms[1, n] * wave.imag)
        wave *= turn
        fall *= near
        rise *= far
        decay *= both
    # the sink: ln|(zeta - zeta_O)(zeta - conj zeta_O)/zeta| = ln|zeta + 1/zeta - 2 cos(angle)|
    zeta = np.exp(np.pi / height * complex(x, y))
    centre = 2.0 * np.cos(np.pi * (np.pi - 2.0 * alpha) / height)
    return value * WAVE_STEP / np.pi + net * np.log(np.abs(zeta + 1.0 / zeta - centre)) / (2.0 * np.pi)


@njit(cache=True)
def temperature_at(
    z: complex,
    on: int,
    chi: float,
    theta: Floats,
    alpha: Floats,
    transforms: Floats,
    constants: Floats,
) -> float:
    """Kappa times the temperature above O at a point of the disk; if ``on`` >= 0 the point chi of that chord."""
    value = 0.0
    for j in range(theta.size):
        x, y = chi, 0.0
        if j != on:
            first, second = np.exp(1j * (theta[j] - alpha[j])), np.exp(1j * (theta[j] + alpha[j]))
            w = np.log((z - first) / (second - z))
            x, y = w.real, min(max(w.imag, 0.0), np.pi - alpha[j])
        value += constants[j, 1] + _in_strip(x, y, alpha[j], transforms[j], constants[j, 0])
    return value


@njit(cache=True)
def chord_trace(
    on: int,
    chi: Floats,
    theta: Floats,
    alpha: Floats,
    transforms: Floats,
    constants: Floats,
    out: Floats,
) -> None:
    """Kappa times the temperature above O along a chord, at s = tanh(chi/2)."""
    for n in range(chi.size):
        z = chord_point(np.tanh(0.5 * chi[n]), theta[on], alpha[on])
        out[n] = temperature_at(z, on, chi[n], theta, alpha, transforms, constants)
