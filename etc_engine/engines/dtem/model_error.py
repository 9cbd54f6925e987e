r"""Estimated error of ``chord``, from its heat flows.

``chord`` is exact for one chord and a far source. Heat that passes a disk along its other contacts finds a segment
cut away there, the flux through a contact is not the uniform one of the mutual resistances, and the temperatures on
the two sides of a contact differ in slope. With the half-chord a_i = sin alpha_i in radii, half the angle
t_ij = (theta_i - theta_j)/2 between two contacts, and G_i = sum_j Q_j cot(t_ij)/(2 pi kappa) the slope of the
temperature along contact i,

    S = sum_i kappa G_i^2 a_i^3 (1 + 7 a_i^4)                                 (segments),
    M = -sum_(i /= j) Q_i Q_j (a_i^2 + a_j^2) cot^2(t_ij)/(4 pi kappa)        (moments of the flux),
    J = sum_contacts pi/4 <kappa> (G_A a_A + G_B a_B)^2                       (slopes; <kappa> the harmonic mean),

the relative error of the conductivity is (c_S S + c_M M - c_J J)/E, E the energy. A disk of close contacts, of weight w
(see `etc_engine.laws.disk_chords`), counts in S and M by 1 - w. There .02 w S is left, and c_J is
1 + .8 alpha + 1.8 alpha^2. Where all terms vanish, as in a straight row, about sin^4(alpha)/500 is left.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numba import njit

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.element import DiskContacts, disk_contacts
from etc_engine.engines.dtem.sphere_error import sphere_error_estimate
from etc_engine.engines.dtem.steady import SteadySolution
from etc_engine.engines.dtem.uneven_film import uneven_film
from etc_engine.errors import InputError
from etc_engine.laws.disk_chords import closeness
from etc_engine.medium.sides import ContactSides

COEFFICIENTS = (0.706, -0.070, 1.288)
"""c_S, c_M, c_J: least squares over ``exact`` solutions of lattices and random packings (studies/accuracy)."""
ALLOWANCE = 0.25
"""Part of the single terms added to their sum, for what the fit leaves."""

CLOSE = 0.02
"""Part of S that disks of close contacts leave."""
CLOSE_SLOPES = (0.8, 1.8)
"""Rise of their c_J over the half-angle and its square; of random packings at half-angles up to 25 degrees."""
FILM_ALLOWANCE: Mapping[int, float] = {2: 0.1, 3: 0.25}
"""Part of the excess resistance of a film added for what its law leaves, by the dimension."""
LEAST = 0.002
"""What sin^4 alpha is multiplied with, averaged over the contacts with their heat flows."""


def chord_error_terms(solution: SteadySolution, load: int = 0) -> Floats:
    """S, M and J over the energy, shape (3,).

    Parameters
    ----------
    solution : SteadySolution
        Of method ``chord``.
    load : int
    """
    return _all_terms(solution, load)[:3]


def _all_terms(solution: SteadySolution, load: int) -> Floats:
    """S, M, J, and S of close contacts over the energy, shape (4,)."""
    sides, energy = solution.sides, float(solution.energies[load, load])
    if energy == 0.0:
        return np.zeros(4)
    kappa = solution.medium.conductivity
    segments, moments, close, slopes = disk_terms(sides, kappa, solution.heat_flows[:, load])
    return np.array([segments, moments, _slope_term(sides, kappa, slopes), close]) / energy


def disk_terms(sides: ContactSides, kappa: Floats, flows: Floats) -> tuple[float, float, float, Floats]:
    """S and M of some disks, S of close contacts, and the slope G a of each side, shape (s,)."""
    slopes, disks = np.zeros(sides.nodes.size), disk_contacts(sides, kappa)
    segments, moments, close = _terms(disks, _weights(disks), np.ascontiguousarray(flows), slopes)
    return segments, moments, close, slopes


def _weights(disks: DiskContacts) -> Floats:
    """Weight of close contacts of every disk."""
    return closeness(disks.offsets, disks.theta, disks.alpha, np.ones(disks.alpha.size, dtype=np.bool_))


def flow_sums(sides: ContactSides, kappa: Floats, flows: Floats) -> Floats:
    """Sums over the sides with their heat flows, of sin^4 alpha, of c_J over that of contacts apart, and of these.

    Shape (3,).
    """
    disks, size = disk_contacts(sides, kappa), np.abs(flows)
    weight, alpha = _weights(disks)[sides.particles], sides.alpha
    rise = (1.0 + alpha * (CLOSE_SLOPES[0] + CLOSE_SLOPES[1] * alpha)) / COEFFICIENTS[2]
    rise = 1.0 - weight + weight * rise
    return np.array([(size * np.sin(alpha) ** 4).sum(), (size * rise).sum(), size.sum()])


def disk_estimate(terms: Floats, sums: Floats) -> float:
    """The estimate for disks, from S, M, J and S of close contacts over the energy and the sums of `flow_sums`."""
    least, rise = np.asarray(sums[:2]) / max(float(sums[2]), np.finfo(float).tiny)
    parts = np.multiply(COEFFICIENTS, terms[:3]) * [1.0, 1.0, -rise]
    return float(abs(parts.sum()) + ALLOWANCE * np.abs(parts).sum() + CLOSE * terms[3] + LEAST * least)


def _slope_term(sides: ContactSides, kappa: Floats, slopes: Floats) -> float:
    """J: an isothermal wall counts as a mirror image of infinite conductivity."""
    own = kappa[sides.particles]
    a, b = own[sides.of_contacts].T
    across = slopes[sides.of_contacts].sum(axis=1)
    at_walls = sides.of_walls
    inner = (a * b / (a + b) * across**2).sum()
    return float(0.5 * np.pi * (inner + (own[at_walls] * slopes[at_walls] ** 2).sum()))


def chord_error_estimate(solution: SteadySolution, load: int = 0) -> float:
    """Estimated relative error of the conductivity by method ``chord``, in magnitude.

    |s + m - j| + (|s| + |m| + |j|)/4 + <sin^4 alpha>/500 with s = c_S S/E, m = c_M M/E, j = c_J J/E, and what a
    resistance of contacts leaves (`film_error`); and .02 S/E of disks of close contacts.

    Parameters
    ----------
    solution : SteadySolution
        Of method ``chord``.
    load : int

    Returns
    -------
    float

    Raises
    ------
    InputError
        If the method is another one.

    Notes
    -----
    Of spheres: see `etc_engine.engines.dtem.sphere_error`. An estimate, not a bound: method
    ``exact`` gives bounds. The disks cut off by insulated walls, and dead ends, which
    ``chord`` leaves out, are not in it.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Medium
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> from etc_engine.engines.dtem.steady import solve_steady
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> solution = solve_steady(Medium(disk, 1.0, bonded_contacts(disk, 0.35)), (0, 1))
    >>> round(chord_error_estimate(solution), 3)
    0.005
    """
    if solution.method != "chord":
        raise InputError(f"the error is estimated for method chord, found a solution by {solution.method}")
    film = film_error(solution, load)
    if solution.sides.dimension == 3:
        kappa, energy = solution.medium.conductivity, float(solution.energies[load, load])
        return film + sphere_error_estimate(solution.sides, kappa, solution.heat_flows[:, load], energy)
    sums = flow_sums(solution.sides, solution.medium.conductivity, solution.heat_flows[:, load])
    return disk_estimate(_all_terms(solution, load), sums) + film


def film_error(solution: SteadySolution, load: int = 0) -> float:
    """Estimated relative error of the conductivity by what the temperature jumps of contacts are taken to be.

    A resistance given as one number is taken as uniform over the contact. A real interface of that resistance has the
    excess D_R (`etc_engine.engines.dtem.uneven_film.uneven_film`), and conducts less by sum Q^2 D_R/E. The excess of a
    resistance over the area is in the solution. `FILM_ALLOWANCE` of both is added.

    Parameters
    ----------
    solution : SteadySolution
    load : int
    """
    sides, kappa, energy = solution.sides, solution.medium.conductivity, float(solution.energies[load, load])
    if energy == 0.0:
        return 0.0
    return film_energy(sides, kappa, solution.heat_flows[:, load]) / energy


def film_energy(sides: ContactSides, kappa: Floats, flows: Floats) -> float:
    """The error of `film_error` times the energy, from the heat flows into the particles at the sides, shape (s,)."""
    included, whole = uneven_film(sides, kappa), uneven_film(sides, kappa, lumped=True)
    left = np.maximum(whole - included, 0.0) + FILM_ALLOWANCE[sides.dimension] * whole
    return float((flows**2 * left).sum())


@njit(cache=True)
def _terms(disks: DiskContacts, weights: Floats, flows: Floats, slopes: Floats) -> tuple[float, float, float]:
    """S and M, and S of close contacts; the slopes G a of all sides into ``slopes``."""
    segments, moments, close = 0.0, 0.0, 0.0
    theta, alpha, kappa = disks.theta, disks.alpha, disks.conductivity
    for p in range(disks.offsets.size - 1):
        for i in range(disks.offsets[p], disks.offsets[p + 1]):
            slope = 0.0
            for j in range(disks.offsets[p], disks.offsets[p + 1]):
                if i != j:
                    cot = 1.0 / np.tan(0.5 * (theta[i] - theta[j]))
                    squares = np.sin(alpha[i]) ** 2 + np.sin(alpha[j]) ** 2
                    slope += 0.5 * flows[j] * cot
                    moments -= (1.0 - weights[p]) * flows[i] * flows[j] * squares * cot**2 / (4.0 * np.pi * kappa[p])
            slopes[i] = slope * np.sin(alpha[i]) / (np.pi * kappa[p])
            a = np.sin(alpha[i])
            own = kappa[p] * slopes[i] ** 2 * a * (1.0 + 7.0 * a**4)
            segments += (1.0 - weights[p]) * own
            close += weights[p] * own
    return segments, moments, close
