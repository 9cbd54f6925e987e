r"""Flux modes of contacts with a resistance over their area: the response of each contact to polynomials.

Over the half-width c of a contact the temperature jumps by r q, q the flux per unit area and r the resistance of a unit
of area. The flux is not singular at the ends then, and crowds there over a distance of about r kappa only. With the
flux y(chi) = q ds/dchi in the strips of both lunes (see `etc_engine.engines.dtem.exact.lune`), the response to a
difference f(s) of the temperatures far away is

    S y + (r/c) 2 cosh^2(chi/2) y = f(s) - Y g(chi),      S = S_A/kappa_A + S_B/kappa_B,  g likewise,

S_A of the symbol coth(k H)/k, Y the whole heat flow, and g_A the temperature that its sink at the centre causes. Mode 0
carries Y = 1 with f constant. The other modes carry Y = 0; they are the responses to Legendre polynomials, less a
constant. They are Galerkin solutions on a uniform grid over chi, where S needs wave numbers up to pi/step, and
everything decays at least as exp(-|chi|/2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.exact.lune import PROFILE_POINTS, PROFILE_STEP, WAVE_STEP, beta_norm, mode_values
from etc_engine.medium.sides import ContactSides

FILM_WAVES = 98
"""Wave numbers up to pi/PROFILE_STEP."""


class Film(NamedTuple):
    """Flux modes of all contacts of a medium of which some resist over their area.

    Parameters
    ----------
    profiles : ndarray, shape (nodes, M, PROFILE_POINTS)
        Flux per unit chi times the weight of each point chi >= 0; even modes are even, odd ones odd. No rows where
        nothing resists: the modes then are Gegenbauer's.
    blocks : ndarray, shape (s, M, M) [m K/W]
        Mean temperature jump at each side, weighted by one mode, of the flux of another one.
    """

    profiles: Floats
    blocks: Floats


def contact_film(sides: ContactSides, conductivity: Floats, exponents: Floats, modes: int) -> Film:
    """Flux modes and resistances of contact sides.

    Parameters
    ----------
    sides : ContactSides
    conductivity : ndarray, shape (n,) [W/(m K)]
    exponents : ndarray, shape (s,)
        Of the flux at the ends of contacts that do not resist.
    modes : int
    """
    blocks = np.zeros((sides.nodes.size, modes, modes))
    blocks[:, 0, 0] = sides.lumped_resistances
    resists = sides.area_resistances > 0.0
    if not resists.any():
        return Film(np.zeros((0, modes, PROFILE_POINTS)), blocks)
    first, second = sides.of_contacts.T
    one = np.empty(sides.of_contacts.shape[0] + sides.of_walls.size, dtype=np.int64)
    other = np.full(one.size, -1)
    one[sides.nodes[first]], other[sides.nodes[first]] = first, second
    one[sides.nodes[sides.of_walls]] = sides.of_walls
    kappa = conductivity[sides.particles]
    resistivities = np.stack([1.0 / kappa[one], np.where(other >= 0, 1.0 / kappa[other], 0.0)], axis=1)
    alphas = np.stack([sides.alpha[one], np.where(other >= 0, sides.alpha[other], 0.0)], axis=1)
    films = np.where(other >= 0, 2.0, 1.0) * sides.area_resistances[one] / sides.reaches[one]
    profiles = np.empty((one.size, modes, PROFILE_POINTS))
    _profiles(alphas, resistivities, films, exponents[one], profiles)
    gram = _gram(profiles)
    share = np.where(resists, sides.area_resistances, 0.0) / np.where(resists, sides.reaches, 1.0)
    blocks += share[:, None, None] * gram[sides.nodes]
    return Film(profiles, blocks)


def flux_densities(profiles: Floats) -> Floats:
    """Flux per unit s at the points chi >= 0 of each mode."""
    return np.asarray(profiles / _weights() * 2.0 * np.cosh(0.5 * _points()) ** 2)


def _points() -> Floats:
    return np.arange(PROFILE_POINTS, dtype=np.float64) * PROFILE_STEP


def _weights() -> Floats:
    weights = np.full(PROFILE_POINTS, 2.0 * PROFILE_STEP)  # of a point and its mirror image
    weights[0] = PROFILE_STEP
    return weights


def _gram(profiles: Floats) -> Floats:
    """Integral of two modes over s, shape (nodes, M, M)."""
    modes = profiles.shape[1]
    gram = np.einsum("nkx,nlx->nkl", flux_densities(profiles), profiles, optimize=False)
    parity = np.arange(modes) % 2
    return np.asarray(gram * (parity[:, None] == parity))


@njit(cache=True)
def _profiles(alphas: Floats, resistivities: Floats, films: Floats, exponents: Floats, out: Floats) -> None:
    """Modes of every contact: Gegenbauer's without a film."""
    points, modes = PROFILE_POINTS, out.shape[1]
    position, widening, weights = np.empty(points), np.empty(points), np.empty(points)
    for x in range(points):
        position[x] = np.tanh(0.5 * PROFILE_STEP * x)
        widening[x] = 2.0 * np.cosh(0.5 * PROFILE_STEP * x) ** 2
        weights[x] = PROFILE_STEP * (1.0 if x == 0 else 2.0)
    waves = np.empty((2 * points - 1, FILM_WAVES))
    for d in range(2 * points - 1):
        for n in range(FILM_WAVES):
            waves[d, n] = np.cos((n + 0.5) * WAVE_STEP * d * PROFILE_STEP)
    values, kernel, sink = np.empty(modes), np.empty(2 * points - 1), np.empty(points)
    matrix, right = np.empty((points, points)), np.empty((points, modes + 1))
    for c in range(films.size):
        if not films[c] > 0.0:
            for x in range(points):
                mode_values(position[x], exponents[c], values)
                density = (0.5 * widening[x]) ** (-exponents[c]) * weights[x] / (2.0 * beta_norm(exponents[c]))
                out[c, :, x] = values * density
            continue
        _kernel(alphas[c], resistivities[c], waves, kernel, sink)
        for parity in range(min(modes, 2)):
            sign = -1.0 if parity else 1.0
            for x in range(points):
                for y in range(x + 1):
                    matrix[x, y] = 0.5 * (kernel[x - y] + sign * kernel[x + y])
                matrix[x, x] += films[c] * widening[x] / weights[x]
                mode_values(position[x], 1.0, values)
                right[x, :modes] = values
                right[x, modes] = sink[x]
            _cholesky_solve(matrix, right)
            if parity == 0:
                flat, towards = right[:, 0].copy(), right[:, modes].copy()  # responses to 1 and to -g
                flat /= flat.sum()
                out[c, 0] = towards + (1.0 - towards.sum()) * flat
            for k in range(2 - parity, modes, 2):
                out[c, k] = right[:, k]
                if parity == 0:
                    out[c, k] -= out[c, k].sum() * flat
                out[c, k] /= np.abs(out[c, k]).sum()


@njit(cache=True)
def _kernel(alphas: Floats, resistivities: Floats, waves: Floats, kernel: Floats, sink: Floats) -> None:
    """Temperature difference at a distance in steps of chi from a unit source on both sides, and -g at all points.

    The symbols are those of `etc_engine.engines.dtem.exact.lune.strip_symbols`.
    """
    flux, towards = np.zeros(FILM_WAVES), np.zeros(FILM_WAVES)
    for side in range(2):
        if resistivities[side] > 0.0:
            height = np.pi - alphas[side]
            for n in range(FILM_WAVES):
                k = (n + 0.5) * WAVE_STEP
                decay = np.exp(-2.0 * k * height)
                factor = resistivities[side] * WAVE_STEP / np.pi / ((1.0 - decay) * k)
                flux[n] += factor * (1.0 + decay)
                towards[n] += factor * (np.exp(-k * (np.pi - 2.0 * alphas[side])) + np.exp(-k * np.pi))
    for d in range(kernel.size):
        kernel[d] = (waves[d] * flux).sum()
    for x in range(sink.size):
        sink[x] = (waves[x] * towards).sum()


@njit(cache=True)
def _cholesky_solve(a: Floats, b: Floats) -> None:
    """Solve a x = b for several right-hand sides, given the lower triangle of a; x replaces b."""
    n = a.shape[0]
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        a[j, j] = np.sqrt(a[j, j])
        for i in range(j + 1, n):
            value = a[i, j]
            for k in range(j):
                value -= a[i, k] * a[j, k]
            a[i, j] = value / a[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
