r"""The Neumann problem of a disk cut by one chord, exactly: the building block of method ``exact``.

A unit disk with centre O is cut by the chord z(s) = (cos alpha + i s sin alpha) e^{i theta}, -1 <= s <= 1. The
map w = ln((z - c_1)/(c_2 - z)) takes the rest, a lune, to the strip 0 < Im w < pi - alpha: the chord to the
lower side, Re w = chi = ln((1 + s)/(1 - s)), the arc to the upper one, O to i (pi - 2 alpha). There the
temperature of a flux density q on the chord, balanced by a sink at O, is known:

* for points off the chord by its half-plane image zeta = exp(pi w/(pi - alpha)),
* between two densities on the chord by their Fourier transforms over chi: the strip takes a flux to a
  temperature by the symbol coth(k (pi - alpha))/k.

Temperatures are measured from the regular part of the temperature at O, so that reciprocity holds.

References
----------
Driscoll, Trefethen 2002, Schwarz-Christoffel Mapping, doi:10.1017/CBO9780511546808 (lunes and strips).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints

WAVE_STEP = 0.08
"""Step of the midpoint rule over k; its error exp(-2 pi b/step) is below 1e-17 for b >= 1/2."""
WAVES = 75
"""Wave numbers up to 6, where the transforms of flux modes have fallen to exp(-6 pi)."""
SINK_WAVES = 138
"""Wave numbers up to 11 for smooth densities, whose transforms fall with the distance of the chord from O."""
CHI_STEP = 0.5
"""Step of the trapezoidal rule over chi, where every density decays at least as exp(-|chi|/2)."""
CHI_POINTS = 144
"""Points on the half-line chi > 0, up to 72."""

PROFILE_STEP = 0.4
"""Step over chi of flux modes that are given by values."""
PROFILE_POINTS = 71
"""Points of such a mode on chi >= 0, up to 28, where exp(-chi/2) is below 1e-6."""

LEVELS = (
    (0.5, 20),
    (0.1, 28),
    (1e-2, 44),
    (0.1, 52),
    (1e-3, 64),
    (1e-2, 80),
    (1e-4, 84),
    (1e-3, 108),
    (1e-6, 112),
    (1e-4, 140),
    (1e-6, 180),
)
"""Clearance a set of points is made for, the distance of a neighbouring corner in half-chords, and their number."""


class FluxModes(NamedTuple):
    """Flux modes of the chords of one disk.

    Parameters
    ----------
    exponents : ndarray, shape (chords,)
        b of Gegenbauer modes.
    profiles : ndarray, shape (chords, M, PROFILE_POINTS)
        Instead of these, flux per unit chi times the weight of each point chi >= 0 (see
        `etc_engine.engines.dtem.exact.film`); no rows where Gegenbauer modes hold.
    """

    exponents: Floats
    profiles: Floats


class ChordPoints(NamedTuple):
    """Points on a chord for smooth densities, at levels that crowd them more and more towards its ends.

    s = tanh(X xi)/tanh(X) with Gauss-Legendre points xi; tanh(X) = 1/(1 + clearance) puts the singularity that
    a neighbouring corner leaves on the continued chord at the same distance as the poles of the map.

    Parameters
    ----------
    counts : ndarray of int, shape (levels,)
    xi, s, jacobian, weights : ndarray, shape (levels, points)
        Gauss point, position, ds/dxi, and weight of an integral over s.
    products : ndarray, shape (levels, points, points)
        (2 l + 1)/2 w_m P_l(xi_m): turns the moments of a weight into weights of the points m.
    cosines, sines : ndarray, shape (levels, waves, points)
        Fourier transform over chi, as C - i S, of the density that interpolates 1 at one point and 0 at the rest.
    waves : ndarray, shape (waves,)
    legendre : ndarray, shape (levels, points, PROFILE_POINTS)
        P_l(xi) at the points chi >= 0 of flux modes that are given by values.
    """

    counts: Ints
    xi: Floats
    s: Floats
    jacobian: Floats
    weights: Floats
    products: Floats
    cosines: Floats
    sines: Floats
    waves: Floats
    legendre: Floats


def chord_points(used: Iterable[int] = range(len(LEVELS))) -> ChordPoints:
    """Tables of the levels that are used; those of the others are left empty."""
    levels, widest = len(LEVELS), max(points for _, points in LEVELS)
    waves = np.linspace(0.5, SINK_WAVES - 0.5, SINK_WAVES) * WAVE_STEP
    flat = np.zeros((4, levels, widest))
    products = np.zeros((levels, widest, widest))
    legendre = np.zeros((levels, widest, PROFILE_POINTS))
    profile = np.tanh(0.5 * PROFILE_STEP * np.arange(PROFILE_POINTS))
    transforms = np.zeros((2, levels, SINK_WAVES, widest))
    step = 0.5 * CHI_STEP
    chi = np.arange(-CHI_POINTS, CHI_POINTS + 1) * step
    phases = waves[:, None] * chi
    for level in sorted(set(used)):
        clearance, points = LEVELS[level]
        stretch = np.arctanh(1.0 / (1.0 + clearance))
        xi, w = np.polynomial.legendre.leggauss(points)
        jacobian = stretch / np.cosh(stretch * xi) ** 2 / np.tanh(stretch)
        flat[:, level, :points] = xi, np.tanh(stretch * xi) / np.tanh(stretch), jacobian, w * jacobian
        degree = np.arange(points)
        product = (degree + 0.5) * w[:, None] * np.polynomial.legendre.legvander(xi, points - 1)
        products[level, :points, :points] = product
        at_profile = np.minimum(np.arctanh(profile * np.tanh(stretch)) / stretch, 1.0)
        legendre[level, :points] = np.polynomial.legendre.legvander(at_profile, points - 1).T
        position = np.tanh(0.5 * chi)
        at = np.polynomial.legendre.legvander(np.arctanh(position * np.tanh(stretch)) / stretch, points - 1)
        densities = (
            np.einsum("xl,ml->xm", at, product, optimize=False) * (step * 0.5 / np.cosh(0.5 * chi) ** 2)[:, None]
        )
        for part, wave in enumerate(
            (np.cos(phases), np.sin(phases))
        ):  # einsum: no threaded product, the same bits anywhere
            transforms[part, level, :, :points] = np.einsum("kx,xm->km", wave, densities, optimize=False)
    counts = np.array([points for _, points in LEVELS])
    return ChordPoints(
        counts, flat[0], flat[1], flat[2], flat[3], products, transforms[0], transforms[1], waves, legendre
    )


@njit(cache=True)
def mode_values(s: float, b: float, out: Floats) -> None:
    """Gegenbauer polynomials R_k(s) = C_k(s)/C_k(1) of order b - 1/2, orthogonal under (1 - s^2)^(b - 1)."""
    out[0] = 1.0
    if out.size > 1:
        out[1] = s
    for k in range(1, out.size - 1):
        out[k + 1] = ((2.0 * k + 2.0 * b - 1.0) * s * out[k] - k * out[k - 1]) / (k + 2.0 * b - 1.0)


@njit(cache=True)
def beta_norm(b: float) -> float:
    """Integral of (1 - s^2)^(b - 1) over -1 < s < 1."""
    return np.exp((2.0 * b - 1.0) * np.log(2.0) + 2.0 * log_gamma(b) - log_gamma(2.0 * b))


@njit(cache=True)
def log_gamma(x: float) -> float:
    """Logarithm of the gamma function for x > 0, by Stirling's series after a shift to x >= 10."""
    shift = 0.0
    while x < 10.0:
        shift += np.log(x)
        x += 1.0
    y = 1.0 / (x * x)
    series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y * (1.0 / 1680.0 - y / 1188.0)))) / x
    return (x - 0.5) * np.log(x) - x + 0.5 * np.log(2.0 * np.pi) + series - shift


@njit(cache=True)
def mode_weights(
    b: float,
    level: int,
    points: ChordPoints,
    out: Floats,
) -> None:
    """Weights of the points that integrate a smooth function against phi_k(s) = R_k(s) (1 - s^2)^(b-1)/B, (M, points).

    The moments of P_l under (1 - xi^2)^(b - 1)/B follow M_(l+2)/M_l = (l/2 + 1 - b)(l + 1)/((2b + l + 1)(l/2 + 1)).
    """
    xi, s, jacobian, products = points.xi[level], points.s[level], points.jacobian[level], points.products[level]
    count = out.shape[1]
    moments = np.zeros(count)
    moments[0] = 1.0
    for l in range(0, count - 2, 2):
        moments[l + 2] = moments[l] * (0.5 * l + 1.0 - b) * (l + 1.0) / ((2.0 * b + l + 1.0) * (0.5 * l + 1.0))
    values = np.empty(out.shape[0])
    for m in range(count):
        weight = 0.0
        for l in range(0, count, 2):
            weight += products[m, l] * moments[l]
        ratio = (1.0 - s[m] * s[m]) / (1.0 - xi[m] * xi[m])
        weight *= ratio ** (b - 1.0) * jacobian[m]
        mode_values(s[m], b, values)
        for k in range(out.shape[0]):
            out[k, m] = weight * values[k]


@njit(cache=True)
def chord_weights(fluxes: FluxModes, chord: int, level: int, points: ChordPoints, out: Floats) -> None:
    """Weights of the points that integrate a smooth function against the flux modes of a chord, (M, points)."""
    if fluxes.profiles.shape[0] == 0:
        mode_weights(fluxes.exponents[chord], level, points, out)
        return
    profile, products, legendre = fluxes.profiles[chord], points.products[level], points.legendre[level]
    out[:] = 0.0
    for k in range(out.shape[0]):
        for l in range(k % 2, out.shape[1], 2):
            moment = 0.0
            for x in range(PROFILE_POINTS):
                moment += profile[k, x] * legendre[l, x]
            for m in range(out.shape[1]):
                out[k, m] += products[m, l] * moment


@njit(cache=True)
def chord_transforms(fluxes: FluxModes, chord: int, out: Floats) -> None:
    """Fourier transforms over chi of the flux modes of a chord, (M, waves): cosine even ones, sine odd ones."""
    if fluxes.profiles.shape[0] == 0:
        mode_transforms(fluxes.exponents[chord], out)
        return
    profile = fluxes.profiles[chord]
    out[:] = 0.0
    for x in range(PROFILE_POINTS):
        chi = x * PROFILE_STEP
        turn = np.exp(1j * WAVE_STEP * chi)
        wave = np.exp(0.5j * WAVE_STEP * chi)
        for n in range(out.shape[1]):
            for k in range(out.shape[0]):
                out[k, n] += profile[k, x] * (wave.imag if k % 2 else wave.real)
            wave *= turn


@njit(cache=True)
def mode_transforms(b: float, out: Floats) -> None:
    """Fourier transforms over chi of the flux modes, (M, waves): cosine ones of even modes, sine ones of odd modes."""
    modes = out.shape[0]
    values = np.empty(modes)
    scale = CHI_STEP / beta_norm(b)
    out[:] = 0.0
    for x in range(CHI_POINTS + 1):
        chi = x * CHI_STEP
        density = scale * np.cosh(0.5 * chi) ** (-2.0 * b) * (0.5 if x == 0 else 1.0)
        mode_values(np.tanh(0.5 * chi), b, values)
        turn = np.exp(1j * WAVE_STEP * chi)
        wave = np.exp(0.5j * WAVE_STEP * chi) * density
        for n in range(out.shape[1]):
            for k in range(modes):
                out[k, n] += values[k] * (wave.imag if k % 2 else wave.real)
            wave *= turn


@njit(cache=True)
def centre_constant(alpha: float) -> float:
    """Half-plane image of O: (ln |dzeta/dz| + ln(2 Im zeta))/(2 pi) there."""
    height = np.pi - alpha
    angle = np.pi * (np.pi - 2.0 * alpha) / height
    # dw/dz = (c_2 - c_1)/((z - c_1)(c_2 - z)) has modulus 2 sin(alpha) at O
    return (np.log(2.0 * np.pi * np.sin(alpha) / height) + np.log(2.0 * np.sin(angle))) / (2.0 * np.pi)


@njit(cache=True)
def strip_symbols(alpha: float, waves: Floats, flux: Floats, sink: Floats) -> None:
    """Midpoint weights of coth(kH)/k, and of cosh(k (H - y_O))/(k sinh(kH)), H = pi - alpha, y_O = pi - 2 alpha."""
    height = np.pi - alpha
    for n in range(waves.size):
        k = waves[n]
        decay = np.exp(-2.0 * k * height)
        flux[n] = WAVE_STEP / np.pi * (1.0 + decay) / ((1.0 - decay) * k)
        sink[n] = WAVE_STEP / np.pi * (np.exp(-k * (np.pi - 2.0 * alpha)) + np.exp(-k * np.pi)) / ((1.0 - decay) * k)


@njit(cache=True)
def own_resistances(
    alpha: float,
    level: int,
    points: ChordPoints,
    modes: Floats,
    between: Floats,
    towards: Floats,
) -> None:
    """Kappa times the mean temperature, weighted by flux mode k, of unit densities on the same chord of a lone lune.

    ``between`` (M, M) for flux modes, ``towards`` (M, points) for the densities interpolated from the points.
    The double pole of the symbols at k = 0 belongs to the net flows; the midpoint rule integrates 1/k^2 too
    high by pi^2/step, which is taken off.
    """
    waves, weights, cosines, sines = points.waves, points.weights[level], points.cosines[level], points.sines[level]
    count = modes.shape[0]
    height = np.pi - alpha
    flux, sink = np.empty(waves.size), np.empty(waves.size)
    strip_symbols(alpha, waves, flux, sink)
    pole = 0.5 * np.pi / (WAVE_STEP * height)
    constant = centre_constant(alpha)
    to_sink = np.zeros(count)
    for k in range(0, count, 2):
        for n in range(modes.shape[1]):
            to_sink[k] -= sink[n] * modes[k, n]
    to_sink[0] += pole
    for k in range(count):
        for l in range(count):
            value = 0.0
            if (k + l) % 2 == 0:
                for n in range(modes.shape[1]):
                    value += flux[n] * modes[k, n] * modes[l, n]
            if k == 0 and l == 0:
                value -= pole + constant
            if l == 0:
                value += to_sink[k]
            if k == 0:
                value += to_sink[l]
            between[k, l] = value
    for m in range(points.counts[level]):
        net = weights[m]
        point_to_sink = pole * net
        for n in range(waves.size):
            point_to_sink -= sink[n] * cosines[n, m]
        for k in range(count):
            value = net * to_sink[k]
            for n in range(modes.shape[1]):
                value += flux[n] * modes[k, n] * (sines[n, m] if k % 2 else cosines[n, m])
            if k == 0:
                value += point_to_sink - net * (pole + constant)
            towards[k, m] = value
