r"""Effective thermal diffusivity of a packing, from how fast it warms up.

The wall at x = 0 (or at x = L) of a packing at temperature 0 is set to 1 and the opposite wall is insulated. A
homogeneous slab of diffusivity a then has the mean temperature (Carslaw and Jaeger 1959, chapter III)

    M(Fo) = 1 - sum_{n>=0} 8/((2n+1)^2 pi^2) exp(-(2n+1)^2 pi^2 Fo/4),      Fo = a t/L^2,

and the a for which M follows the packing's mean is its effective diffusivity. In the limit of many particles it is
the steady conductivity over the heat capacity, k_eff/(rho c)_eff.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar
from scipy.sparse.csgraph import connected_components

from etc_engine.arrays import Floats
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium
from etc_engine.medium.walls import WALLS, FixedTemperature
from etc_engine.realization import effective_conductivity, transient_system
from etc_engine.solvers.marching import march

TERMS = 200
SHORT = 1e-4
"""Below this Fourier number the far wall is out of reach and M = 2 sqrt(Fo/pi)."""
WINDOW = (0.2, 0.95)
"""Mean temperatures that are fitted: the front has passed the wall's particles, and something is left to happen."""


def slab_mean(fourier: ArrayLike) -> Floats:
    """Mean temperature of a slab after a unit step at one wall, the other insulated.

    Parameters
    ----------
    fourier : array_like
        Fourier numbers a t/L^2.

    Returns
    -------
    ndarray

    References
    ----------
    Carslaw, Jaeger 1959, Conduction of Heat in Solids, 2nd edition, chapter III.

    Examples
    --------
    >>> slab_mean([0.0, 0.1, 10.0]).round(6)
    array([0.      , 0.356823, 1.      ])
    """
    fourier = np.asarray(fourier, dtype=np.float64)
    odd = 2.0 * np.arange(TERMS) + 1.0
    decay = np.exp(-0.25 * (np.pi * odd) ** 2 * fourier[..., None])
    late = 1.0 - (8.0 / (np.pi * odd) ** 2 * decay).sum(axis=-1)
    return np.where(fourier < SHORT, 2.0 * np.sqrt(np.maximum(fourier, 0.0) / np.pi), late)


def fit_diffusivity(times: ArrayLike, means: ArrayLike, length: float) -> tuple[float, float]:
    """Diffusivity whose slab follows mean temperatures best, and the root-mean-square misfit.

    min_a sum_k (M(a t_k/L^2) - M_k)^2 over the means in `WINDOW`.

    Parameters
    ----------
    times : array_like, shape (m,) [s]
        Since the step.
    means : array_like, shape (m,)
        Mean temperature over the step.
    length : float [m]

    Returns
    -------
    diffusivity : float [m2/s]
    misfit : float

    Raises
    ------
    InputError
        If fewer than three means lie in the window.

    Examples
    --------
    >>> t = np.linspace(0.1, 5.0, 20)
    >>> round(fit_diffusivity(t, slab_mean(0.2 * t / 4.0), 2.0)[0], 9)
    0.2
    """
    times, means = np.asarray(times, dtype=np.float64), np.asarray(means, dtype=np.float64)
    used = (means >= WINDOW[0]) & (means <= WINDOW[1])
    if used.sum() < 3:
        raise InputError(
            f"a fit needs at least three mean temperatures between {WINDOW[0]} and {WINDOW[1]} of the step, found "
            f"{int(used.sum())}: choose other output times"
        )
    t, wanted = times[used] / length**2, means[used]

    def misfit(log_a: float) -> float:
        return float(np.mean((slab_mean(np.exp(log_a) * t) - wanted) ** 2))

    guesses = [np.log(brentq(lambda fo, m=m: slab_mean(fo) - m, 0.0, 10.0) / s) for s, m in zip(t, wanted, strict=True)]
    bounds = (min(guesses) - 1e-9, max(guesses) + 1e-9)  # the best lies between those that meet one mean each
    best = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-12})
    return float(np.exp(best.x)), float(np.sqrt(misfit(best.x)))


@dataclass(frozen=True, eq=False)
class Diffusivity:
    """Diffusivity of a packing from a transient, and from its steady state.

    Parameters
    ----------
    transient : float [m2/s]
        Of the slab that follows the transient.
    misfit : float
        Root-mean-square difference of the mean temperatures over the step.
    steady : float [m2/s]
        k_eff/(rho c)_eff.
    conductivity : float [W/(m K)]
        k_eff, of the same pipe network between the same two walls.
    heat_capacity : float [J/(m3 K)]
        (rho c)_eff: of the particles joined to the heated wall, over the box.
    times : ndarray, shape (m,) [s]
    means : ndarray, shape (m,)
        Mean temperature of these particles, weighted with their heat capacities.
    """

    transient: float
    misfit: float
    steady: float
    conductivity: float
    heat_capacity: float
    times: Floats
    means: Floats


def effective_diffusivity(
    medium: Medium,
    *,
    method: str = "chord",
    heated: str = "left",
    tolerance: float = 1e-4,
) -> Diffusivity:
    """Effective diffusivity along x of a packing between walls, by the pipe network.

    Parameters
    ----------
    medium : Medium
        Walled along x, with contacts and heat capacities.
    method : str
        As in `etc_engine.engines.pipe.steady.pipe_conductivity`.
    heated : str
        The wall of the step, ``left`` or ``right``. Particles near it weigh more, so that the two walls give
        different values for an inhomogeneous packing.
    tolerance : float
        Of the adaptive steps, over the step of the wall's temperature.

    Returns
    -------
    Diffusivity

    Raises
    ------
    InputError
        If the box is periodic along x, or no path of contacts leads from wall to wall.

    Notes
    -----
    Particles without a path to a wall stay cold; they count neither in the means nor in (rho c)_eff.

    Examples
    --------
    >>> from etc_engine import Box, Medium, ParticlePacking, bonded_contacts
    >>> x = np.arange(40) + 0.5
    >>> row = ParticlePacking(np.stack([x, np.full(40, 0.5)], axis=1), np.full(40, 0.5), Box((40.0, 1.0)))
    >>> found = effective_diffusivity(Medium(row, 1.0, bonded_contacts(row, 0.1), heat_capacity=1.0))
    >>> bool(abs(found.transient / found.steady - 1.0) < 2e-3)
    True
    """
    box, network = medium.box, medium.links
    if heated not in ("left", "right"):
        raise InputError(f"the heated wall is left or right, found {heated!r}")
    if box.periodic[0]:
        raise InputError("the diffusivity along x is measured between two walls; the box is periodic along x")
    k = float(effective_conductivity(medium, engine="pipe", method=method, axes=(0,)).tensor[0, 0])
    if k == 0.0:
        raise InputError("no path of contacts leads from wall to wall: there is no effective diffusivity")
    system = transient_system(medium, {heated: FixedTemperature(1.0)}, engine="pipe", method=method)
    labels = system.state_temperatures(connected_components(system.heat.conductance, directed=False)[1])[:, 0]
    joined = np.isin(labels, labels[network.wall_particles[network.walls == WALLS.index(heated)]])
    shares = np.where(joined, system.capacities, 0.0)
    heat_capacity = float(shares.sum() / box.volume)
    scale = box.lengths[0] ** 2 * heat_capacity / k
    times = scale * np.concatenate([[0.0], np.geomspace(3e-3, 2.0, 60)])
    states = march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=tolerance)
    means = np.array([shares @ system.particle_temperatures(state.temperatures) for state in states]) / shares.sum()
    alpha, misfit = fit_diffusivity(times, means, box.lengths[0])
    return Diffusivity(alpha, misfit, k / heat_capacity, k, heat_capacity, times, means)
