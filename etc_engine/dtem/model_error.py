r"""What ``chord`` is estimated to miss, from its own heat flows.

``chord`` is exact for one chord and a far source. Heat that passes a disk along its other contacts finds a segment
cut away there, the flux through a contact has moments of its own, and the temperatures on the two sides of a
contact differ in slope. With a_i = sin alpha_i the half-chords and d_ij = 2 sin(theta_ij/2) the distances of the
contacts, both in radii, G_i = sum_j Q_j cot(theta_ij/2)/(2 pi kappa) the slope of the temperature along contact i,

    S = sum_i kappa G_i^2 a_i^3                                             (segments),
    M_n = -sum_(i /= j) Q_i Q_j u_n(a_i/d_ij, a_j/d_ij)/(pi kappa)          (moments),
        u_3 = x^3 + y^3,  u_4 = x^2 y^2,
    J = sum_contacts pi/4 <kappa> (G_A a_A + G_B a_B)^2                     (slopes; <kappa> the harmonic mean),

the error of the conductivity relative to its value is c_S S + c_3 M_3 + c_4 M_4 - c_J J over the energy.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from etc_engine.dtem.sides import ContactSides
from etc_engine.dtem.steady import SteadySolution
from etc_engine.errors import InputError

COEFFICIENTS = (1.09, -0.42, 2.87, 1.28)
"""c_S, c_3, c_4, c_J: least squares over ``exact`` solutions of lattices and random packings (studies/accuracy)."""
ALLOWANCE = 0.3
"""Part of the single terms added to their sum, for what the fit leaves."""


def chord_error_terms(solution: SteadySolution, load: int = 0) -> NDArray[np.float64]:
    """S, M_3, M_4 and J over the energy, shape (4,).

    Parameters
    ----------
    solution : SteadySolution
        Of method ``chord``.
    load : int
    """
    sides, energy = solution.sides, float(solution.energies[load, load])
    if energy == 0.0:
        return np.zeros(4)
    kappa = solution.material.conductivity
    slopes = np.zeros(sides.nodes.size)
    flows = np.ascontiguousarray(solution.heat_flows[:, load])
    terms = np.array(_terms(sides.offsets, sides.theta, sides.alpha, flows, kappa, slopes))
    return np.append(terms, _slope_term(sides, kappa, slopes)) / energy


def _slope_term(sides: ContactSides, kappa: NDArray[np.float64], slopes: NDArray[np.float64]) -> float:
    """J: an isothermal wall counts as a mirror image of infinite conductivity."""
    own = kappa[sides.particles]
    a, b = own[sides.of_contacts].T
    across = slopes[sides.of_contacts].sum(axis=1)
    at_walls = sides.of_walls
    inner = (a * b / (a + b) * across**2).sum()
    return float(0.5 * np.pi * (inner + (own[at_walls] * slopes[at_walls] ** 2).sum()))


def chord_error_estimate(solution: SteadySolution, load: int = 0) -> float:
    """Estimated relative error of the conductivity by method ``chord``, in magnitude.

    |c_S S + c_3 M_3 + c_4 M_4 - c_J J| + 0.3 (|c_S S + c_3 M_3 + c_4 M_4| + c_J J), terms of `chord_error_terms`.

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
    An estimate, not a bound: method ``exact`` gives bounds. The disks cut off by insulated walls, and dead ends, which
    ``chord`` leaves out, are not in it.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.contacts import bonded_contacts
    >>> from etc_engine.dtem.steady import solve_steady
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> round(chord_error_estimate(solve_steady(bonded_contacts(disk, 0.35), (0, 1))), 3)
    0.007
    """
    if solution.method != "chord":
        raise InputError(f"the error is estimated for method chord, found a solution by {solution.method}")
    *even, slopes = np.multiply(COEFFICIENTS, chord_error_terms(solution, load))
    return float(abs(sum(even) - slopes) + ALLOWANCE * (abs(sum(even)) + slopes))


@njit(cache=True)
def _terms(
    offsets: NDArray[np.int64],
    theta: NDArray[np.float64],
    alpha: NDArray[np.float64],
    flows: NDArray[np.float64],
    conductivity: NDArray[np.float64],
    slopes: NDArray[np.float64],
) -> tuple[float, float, float]:
    """S, M_3 and M_4; the slopes G a of all sides into ``slopes``."""
    segments, third, fourth = 0.0, 0.0, 0.0
    for p in range(offsets.size - 1):
        for i in range(offsets[p], offsets[p + 1]):
            slope = 0.0
            for j in range(offsets[p], offsets[p + 1]):
                if i == j:
                    continue
                half = 0.5 * (theta[i] - theta[j])
                slope += 0.5 * flows[j] / np.tan(half)
                x, y = (np.sin(alpha[i]) / (2.0 * np.sin(half))) ** 2, (np.sin(alpha[j]) / (2.0 * np.sin(half))) ** 2
                product = -flows[i] * flows[j] / (np.pi * conductivity[p])
                third += product * (x**1.5 + y**1.5)
                fourth += product * x * y
            slopes[i] = slope * np.sin(alpha[i]) / (np.pi * conductivity[p])
            segments += conductivity[p] * slopes[i] ** 2 * np.sin(alpha[i])
    return segments, third, fourth
