r"""The disk as an element that stores heat: its contacts are nodes, and so is its mean temperature.

**Mean temperature.** A disk of radius R warms at one rate everywhere. Its heat flows no longer cancel: with
S = sum_j Q_j = rho c V dT_o/dt,

    kappa Lap T = S / (pi R^2),      T = S r^2 / (4 pi R^2 kappa) + w,      Lap w = 0.

The first part leads S out of the rim evenly, so that w carries the rest of the flux, which sums to zero. Its value at
the rim is S/(4 pi kappa), its mean over the disk S/(8 pi kappa). The harmonic part follows from the flux by the kernel
-ln|2 sin(x/2)|/(pi kappa), which has no mean: it ignores the even part of the flux, and its own mean over the disk is
zero. Averaged over the arcs,

    T_i - T_o = sum_j h'_ij Q_j + S / (8 pi kappa),

where h' is h without its ln 2. Hence Q = A (T_c - T_o e) with A = (H' + e e^T/(8 pi kappa))^-1, and the element

    [ Q ]   [  A       -A e    ] [ T_c ]
    [-S ] = [ -e^T A    e^T A e] [ T_o ]

is symmetric, positive semi-definite and blind to a common temperature. At rest, S = 0, it is the steady element.

**Dipoles.** What is left out decays slowest where the temperature varies as cos(angle) and sin(angle): that part
follows a change of flux only after R^2 rho c/kappa. Let the storage have such a part too, rho c dT/dt = s r cos(angle).
Then

    kappa Lap T = s r cos  =>  T = [s r^3/(8 kappa) + b r] cos,   flux q = 3 s R^2/8 + kappa b,

and with D the amplitude at the rim of the linear field that fits T best, D = 4/(pi R^3) int T r cos dA,

    D = (R/kappa) (q - 7 s R^2/24),      T(R) = (6/7) D + (1/7) q R/kappa,      dD/dt = s R/(rho c).

The flux of the contacts has q = u . Q/(pi R), u_i the mean of cos(angle) over arc i, and H' holds the quasi-steady
answer u u^T/(pi kappa) of this harmonic. Taking 6/7 of it away and giving it to the state D makes

    T_c = T_o e + (6/7)(D_c u + D_s v) + H'' Q,      H'' = H' + e e^T/(8 pi kappa) - (6/7)(u u^T + v v^T)/(pi kappa),
    (rho c V/4) dD_c/dt = (6/7) u . Q - (6/7) pi kappa D_c,     likewise D_s with v,

symmetric again. It relaxes at the rate 24/7 = 3.429 kappa/(rho c R^2), where the disk's own is j'_11^2 = 3.390.

**Spheres.** The same with kappa Lap T = 3 S/(4 pi R^3): T_i - T_o = sum_j h_ij Q_j + S/(20 pi kappa R), and with r cos
for the dipole, T = [s r^3/(10 kappa) + b r] cos, q = 3 s R^2/10 + kappa b, D = (R/kappa)(q - 8 s R^2/35):

    T(R) = (7/8) D + (1/8) q R/kappa,      q = 3 u . Q/(4 pi R^2),      dD/dt = s R/(rho c),
    (rho c V/5) dD/dt = (7/8) u . Q - (7/8) (4 pi kappa R/3) D,

at the rate 35/8 = 4.375 kappa/(rho c R^2), where the sphere's own is j'_1^2 = 4.333. The law of the dimension
(`etc_engine.laws.by_dimension`) holds these constants.

**States as temperatures.** The mean and the dipoles are those of d + 1 equal parts of the particle in the directions
v_k of a simplex, thirds of a disk and quarters of a sphere,

    T_k = T_o + sqrt(d/(d + 2)) D . v_k,      each of the heat capacity rho c V/(d + 1):

the capacity stays diagonal, the heat is 1 . C T, and a common temperature is still one without flow.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.dtem.element import Elements, Resistances, cholesky_inverse, packed_starts
from etc_engine.engines.dtem.methods import find_method, flux_modes
from etc_engine.errors import GeometryError, InputError
from etc_engine.laws.by_dimension import law_of, length_scales
from etc_engine.medium.sides import ContactSides

SIMPLEX: Mapping[int, Floats] = {
    2: np.stack([np.cos(2.0 * np.pi * np.arange(3) / 3.0), np.sin(2.0 * np.pi * np.arange(3) / 3.0)]),
    3: np.array([[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, 1.0, -1.0], [1.0, -1.0, -1.0, 1.0]]) / np.sqrt(3.0),
}
"""Directions of the parts of a particle, shape (d, d + 1)."""


def readings_of_parts(dimension: int) -> Floats:
    """(T_o, D) of the temperatures of the d + 1 parts of a particle, shape (d + 1, d + 1)."""
    parts = dimension + 1
    slope = np.sqrt(dimension * (dimension + 2.0)) / parts
    return np.concatenate([np.full((1, parts), 1.0 / parts), slope * SIMPLEX[dimension]])


def storing_elements(
    sides: ContactSides,
    conductivity: Floats,
    method: str,
    *,
    dipoles: bool = False,
    modes: int | None = None,
) -> Elements:
    """Elements of all particles over their contacts and their states, which are temperatures that store heat.

    Parameters
    ----------
    sides : ContactSides
    conductivity : ndarray, shape (n,) [W/(m K)]
    method : str
        A name of `etc_engine.engines.dtem.methods.METHODS`, but for ``exact``.
    dipoles : bool
        d + 1 states per particle, its parts; otherwise one, its mean.
    modes : int, optional
        Flux modes of a contact, with ``arc``.

    Returns
    -------
    Elements
        Rows of a particle: its contacts, modes fastest, then its states. Nodes: M times the contact plus the mode, and
        after all contacts the states by particle. ``modes`` is M. ``apply`` returns the heat into the particle at
        the contacts, and what the states lose.

    Raises
    ------
    GeometryError
        If H' + e e^T/(8 pi kappa), or H'' with dipoles, of a particle is not positive definite.
    InputError
        If the method has no such form.
    """
    dimension = sides.dimension
    variant, modes = find_method(method, dimension), flux_modes(method, modes, dimension)
    if variant.resistances is None:
        raise InputError(f"method {method} has no transient form: choose chord, arc, standard or enhanced")
    h = variant.resistances(sides, conductivity, modes)
    scales = conductivity * length_scales(sides.radii, dimension)
    elements, bad = with_states(h, sides.offsets, sides.nodes, scales, dimension, dipoles=dipoles)
    if bad >= 0:
        raise GeometryError(_indefinite(bad, sides, method, dipoles))
    return elements


def with_states(
    h: Resistances,
    contact_offsets: Ints,
    contact_nodes: Ints,
    scales: Floats,
    dimension: int,
    *,
    dipoles: bool,
) -> tuple[Elements, int]:
    """Elements over contacts and states from resistance matrices.

    Parameters
    ----------
    h : Resistances
    contact_offsets, contact_nodes : ndarray of int, shape (n + 1,), (s,)
        Sides of each particle, and the contact of each side.
    scales : ndarray, shape (n,)
        kappa R^(d-2).
    dimension : int
    dipoles : bool

    Returns
    -------
    Elements
    int
        First particle without a positive definite matrix, or -1.
    """
    law, modes, states = law_of(dimension), h.modes, dimension + 1 if dipoles else 1
    count = contact_offsets.size - 1
    contact_rows = modes * np.diff(contact_offsets)
    offsets = np.concatenate([[0], np.cumsum(contact_rows + states)])
    starts = packed_starts(offsets)
    values = np.zeros(int(starts[-1]))
    bad = _fill(
        modes * contact_offsets,
        h,
        np.ascontiguousarray(scales),
        (law.warming, law.harmonic, law.share),
        readings_of_parts(dimension) if dipoles else np.ones((1, 1)),
        starts,
        values,
    )
    size = modes * (contact_nodes.max(initial=-1) + 1)
    nodes = np.empty(int(offsets[-1]), dtype=np.int64)
    is_state = np.ones(nodes.size, dtype=np.bool_)
    shift = states * np.repeat(np.arange(count), contact_rows)
    at = np.arange(modes * contact_nodes.size) + shift
    is_state[at] = False
    nodes[at] = (modes * contact_nodes[:, None] + np.arange(modes)).ravel()
    nodes[is_state] = size + np.arange(states * count)
    return Elements(modes, offsets, nodes, starts, values), int(bad)


def _indefinite(particle: int, sides: ContactSides, method: str, dipoles: bool) -> str:
    own = slice(sides.offsets[particle], sides.offsets[particle + 1])
    widest = np.degrees(sides.alpha[own].max())
    cure = "leave the dipoles out, use smaller contact angles" if dipoles else "use smaller contact angles"
    return (
        f"particle {particle} with {own.stop - own.start} contact(s) of half-angles up to {widest:.4g} degrees has no "
        f"positive definite resistance to heat that it stores (method {method}"
        f"{', with dipoles' if dipoles else ''}): {cure} or, if that is the geometry, method standard"
    )


@njit(cache=True)
def _fill(
    offsets: Ints,
    h: Resistances,
    scales: Floats,
    constants: tuple[float, float, float],
    readings: Floats,
    starts: Ints,
    values: Floats,
) -> int:
    """Fill the packed matrices; returns the first particle without a positive definite one, or -1.

    A = (H' + warming e e^T/scale - share harmonic sum_d u_d u_d^T/scale)^-1 and G = e W_0 + share sum_d u_d W_d, joined
    to the element of `_join`. ``scales`` are kappa R^(d-2), ``constants`` warming, harmonic and share of the law;
    ``readings`` turns the states into (T_o) or (T_o, D).
    """
    warming, harmonic, share = constants
    states, modes, moments = readings.shape[0], h.modes, h.moments
    for p in range(offsets.size - 1):
        first, n = offsets[p], offsets[p + 1] - offsets[p]
        a = h.values[h.starts[p] : h.starts[p + 1]].copy().reshape((n, n))
        g = np.zeros((n, states))  # temperature of each row by the states alone
        for i in range(n):
            if i % modes == 0:
                for k in range(states):
                    g[i, k] += readings[0, k]
            for d in range(1, states):
                for k in range(states):
                    g[i, k] += share * moments[first + i, d - 1] * readings[d, k]
            for j in range(n):
                if i % modes == 0 and j % modes == 0:
                    a[i, j] += warming / scales[p]
                for d in range(states - 1):
                    a[i, j] -= share * harmonic / scales[p] * moments[first + i, d] * moments[first + j, d]
        if not cholesky_inverse(a, n):
            return p
        _join(a, g, readings, share * scales[p] / harmonic, values[starts[p] : starts[p + 1]])
    return -1


@njit(cache=True)
def _join(
    a: Floats,
    g: Floats,
    readings: Floats,
    relaxation: float,
    out: Floats,
) -> None:
    """The element [A, -A G; -G^T A, G^T A G + W^T w W], row by row into ``out``; W reads the dipoles."""
    n, states = g.shape
    size = n + states
    for i in range(n):
        for j in range(n):
            out[i * size + j] = a[i, j]
        for k in range(states):
            value = 0.0
            for j in range(n):
                value -= a[i, j] * g[j, k]
            out[i * size + n + k] = value
            out[(n + k) * size + i] = value
    for k in range(states):
        for l in range(k + 1):
            value = 0.0
            for i in range(n):
                value -= g[i, k] * out[i * size + n + l]
            for d in range(1, states):
                value += relaxation * readings[d, k] * readings[d, l]
            out[(n + k) * size + n + l] = value
            out[(n + l) * size + n + k] = value
