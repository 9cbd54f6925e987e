"""The two iterations of FFT homogenization for one load: Eyre-Milton, and conjugate gradients."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit

from etc_engine.arrays import Floats
from etc_engine.engines.voxel.conductivity import VoxelConductivity
from etc_engine.errors import ConvergenceError

Field = Floats
Projection = Callable[[Field], Field]

DELAY = 4
"""Steps of conjugate gradients whose decrease of the energy estimates the error left before them."""

LARGE = 1e6
"""A contrast from here on is too large where conjugate gradients do not come to an end."""

WIDE = 100.0
"""Contrast beyond which conjugate gradients are watched longer, and the energy gives the flux along the load."""

VANISHING = 1e-13
"""A conductivity below this part of the mean of the phases counts as 0."""


@dataclass(frozen=True, eq=False)
class LoadSolution:
    """The response of a cell to one mean gradient.

    Parameters
    ----------
    flux : ndarray, shape (d,)
        Mean of the conductivity times the gradient.
    fluctuation : ndarray, shape (d, n1, n2[, n3])
        The gradient without its mean.
    imbalance : ndarray or None, shape as `fluctuation`
        Gradient part of the flux left by the solver, with opposite sign; None where the fluctuation is no gradient.
    iterations : int
    error : float
        Estimated relative error of the conductivity left by the solver.
    """

    flux: Floats
    fluctuation: Field
    imbalance: Field | None
    iterations: int
    error: float


def solve_eyre_milton(
    conductivity: VoxelConductivity, project: Projection, load: Floats, tolerance: float, limit: int
) -> LoadSolution:
    r"""Eyre and Milton's fixed point for the polarization :math:`\tau = (k + k_0) \nabla T`.

    .. math:: \tau \leftarrow 2 k_0 E + (1 - 2 \Gamma) Z \tau, \qquad Z = (k - k_0)(k + k_0)^{-1}, \qquad
              k_0 = \sqrt{k_{min} k_{max}}

    Parameters
    ----------
    conductivity : VoxelConductivity
        Positive and finite everywhere.
    project : callable
        The projection onto gradients.
    load : ndarray, shape (d,) [K/m]
        The mean gradient E.
    tolerance : float
        Stops when a step changes the polarization by less than this part of it.
    limit : int
        Most iterations.

    Returns
    -------
    LoadSolution

    Raises
    ------
    ConvergenceError

    Notes
    -----
    The error falls by :math:`(\sqrt c - 1)/(\sqrt c + 1)` a step at contrast c.

    References
    ----------
    D. J. Eyre and G. W. Milton, Eur. Phys. J. Appl. Phys. 6, 41 (1999), 10.1051/epjap:1999150.
    """
    least, largest = conductivity.extremes()
    reference = float(np.sqrt(least * largest))
    contrast = conductivity.of(lambda k: (k - reference) / (k + reference))
    d, cells = load.size, conductivity.scalars.size
    drive = 2.0 * reference * load
    tau = np.empty((d, *conductivity.shape))
    tau[...] = drive.reshape(d, *(1,) * len(conductivity.shape))
    history = []
    for iteration in range(1, limit + 1):
        image = contrast.apply(tau)
        change, norm = _reflect(tau.reshape(d, -1), image.reshape(d, -1), project(image).reshape(d, -1), drive)
        history.append(float(np.sqrt(change / norm)) if norm > 0.0 else 0.0)
        if history[-1] <= tolerance:
            image = contrast.apply(tau)
            flux = 0.5 * (tau + image).reshape(d, cells).mean(axis=1)
            tau -= image
            tau *= 0.5 / reference
            tau -= load.reshape(d, *(1,) * len(conductivity.shape))
            return LoadSolution(flux, tau, None, iteration, history[-1])
    raise ConvergenceError(
        f"Eyre-Milton: the polarization still changes by {history[-1]:.2g} after {limit} iterations at contrast "
        f"{largest / least:.3g} (wanted {tolerance:g}): use conjugate gradients (cg)",
        history,
    )


def solve_conjugate_gradients(
    conductivity: VoxelConductivity, project: Projection, load: Floats, tolerance: float, limit: int
) -> LoadSolution:
    r"""Conjugate gradients on :math:`\Gamma k (E + e) = 0` in the space of gradients e.

    Parameters
    ----------
    conductivity : VoxelConductivity
        Finite; it may vanish.
    project : callable
        The projection onto gradients (or, with resistivities, onto fluxes).
    load : ndarray, shape (d,) [K/m]
        The mean gradient E.
    tolerance : float
        Stops when the conductivity along the load has an estimated relative error below this.
    limit : int
        Most iterations.

    Returns
    -------
    LoadSolution

    Raises
    ------
    ConvergenceError

    Notes
    -----
    Every step lowers the energy :math:`E \cdot k_{eff} E` by :math:`\alpha |r|^2`. What the last steps gained is
    the error of the conductivity before them (Hestenes and Stiefel); the steps themselves are on top.

    References
    ----------
    J. Zeman, J. Vondřejc, J. Novák and I. Marek, J. Comput. Phys. 229, 8065 (2010), 10.1016/j.jcp.2010.07.010.
    Z. Strakoš and P. Tichý, Electron. Trans. Numer. Anal. 13, 56 (2002).
    """
    d, cells = load.size, conductivity.scalars.size
    uniform = np.empty((d, *conductivity.shape))
    uniform[...] = load.reshape(d, *(1,) * len(conductivity.shape))
    voigt = float(load @ conductivity.mean() @ load)
    residual = -project(conductivity.apply(uniform))
    fluctuation, direction = np.zeros_like(residual), residual.copy()
    square = float(np.vdot(residual, residual)) / cells
    start, energy = square, voigt
    gains: list[float] = []
    least, largest = conductivity.extremes()
    wide = 0.0 < WIDE * least < largest
    while True:
        delay = max(DELAY, len(gains) // 3) if wide else DELAY  # convergence comes in stairs at a large contrast
        settled = len(gains) >= delay and sum(gains[-delay:]) <= tolerance * energy
        if settled or energy <= VANISHING * voigt or square <= 1e-30 * start or start <= 1e-30 * voigt**2:
            break
        if len(gains) == limit:
            raise ConvergenceError(
                f"conjugate gradients: the conductivity still fell by {gains[-1] / energy:.2g} of itself in the last "
                f"of {limit} iterations (wanted {tolerance:g}){_advice(conductivity)}",
                [gain / voigt for gain in gains],
            )
        image = project(conductivity.apply(direction))
        curvature = float(np.vdot(direction, image)) / cells
        if curvature <= 0.0:
            break  # nothing conducts along the direction: rounding is all that is left
        step = square / curvature
        previous = square
        square = _advance(fluctuation.ravel(), residual.ravel(), direction.ravel(), image.ravel(), step) / cells
        _turn(direction.ravel(), residual.ravel(), square / previous)
        gains.append(step * previous)
        energy -= gains[-1]
    uniform += fluctuation
    flux = conductivity.apply(uniform).reshape(d, cells).mean(axis=1)
    if wide:
        # rounding leaves residual and fluctuation not orthogonal: the energy has no error of first order, the flux has
        flux -= float(np.vdot(fluctuation, residual)) / cells / float(load @ load) * load
    error = gains[-1] / energy if gains and energy > VANISHING * voigt else 0.0
    return LoadSolution(flux, fluctuation, residual, len(gains), error)


def _advice(conductivity: VoxelConductivity) -> str:
    """What helps against slow conjugate gradients."""
    least, largest = conductivity.extremes()
    if least > 0.0 and largest >= LARGE * least:
        return (
            f": the contrast {largest / least:.3g} is too large for the iteration: give inf (or 0) for what conducts "
            "so much better (or worse)"
        )
    return ": allow more, or use the rotated Green operator if another one is in use"


@njit(cache=True)
def _reflect(tau, image, gradients, drive):  # type: ignore[no-untyped-def]
    """Replace tau by drive + image - 2 gradients; the squares of its change and of itself."""
    change, norm = 0.0, 0.0
    for a in range(tau.shape[0]):
        for i in range(tau.shape[1]):
            new = drive[a] + image[a, i] - 2.0 * gradients[a, i]
            change += (new - tau[a, i]) ** 2
            norm += new * new
            tau[a, i] = new
    return change, norm


@njit(cache=True)
def _advance(fluctuation, residual, direction, image, step):  # type: ignore[no-untyped-def]
    """A step along the direction; the square of the new residual."""
    square = 0.0
    for i in range(residual.size):
        fluctuation[i] += step * direction[i]
        residual[i] -= step * image[i]
        square += residual[i] * residual[i]
    return square


@njit(cache=True)
def _turn(direction, residual, weight):  # type: ignore[no-untyped-def]
    for i in range(direction.size):
        direction[i] = residual[i] + weight * direction[i]
