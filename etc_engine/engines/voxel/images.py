"""Homogenization of a voxel image: phases by label, conductivities by phase."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.engines.voxel.cell import CellSolution, Scheme, solve_cell
from etc_engine.errors import ConvergenceError, InputError
from etc_engine.medium.pores import check_conductivity

LARGEST_REFINED = 8_000_000
"""Most voxels of the refined image from which the error is estimated."""
RINGING_LIMIT = 300
"""Iterations after which the continuous Green operator is given up."""


def image_conductivity(labels: Ints, phases: Mapping[int, float]) -> Floats:
    """Conductivity of each voxel.

    Parameters
    ----------
    labels : ndarray of int, shape (n1, n2[, n3])
    phases : mapping of int to float [W/(m K)]
        Conductivity by label.

    Returns
    -------
    ndarray, shape (n1, n2[, n3]) [W/(m K)]

    Raises
    ------
    InputError
        If a label has no conductivity, or a conductivity is given for a label that the image does not hold, is
        negative or no number.

    Examples
    --------
    >>> image_conductivity(np.array([[0, 1], [1, 0]]), {0: 1.0, 1: 3.0}).tolist()
    [[1.0, 3.0], [3.0, 1.0]]
    """
    found = np.unique(labels)
    missing = [int(label) for label in found if int(label) not in phases]
    if missing:
        raise InputError(
            f"the image has the labels {', '.join(map(str, found.tolist()))}: the conductivity of "
            f"{', '.join(map(str, missing))} is missing"
        )
    unknown = sorted(set(phases) - set(found.tolist()))
    if unknown:
        raise InputError(
            f"the image has the labels {', '.join(map(str, found.tolist()))}, but conductivities are given for "
            f"{', '.join(map(str, unknown))} too: leave those out, or see whether this is the right image"
        )
    for label, value in phases.items():
        check_conductivity(value, f"label {label}")
    values = np.array([phases[int(label)] for label in found])
    return np.asarray(values[np.searchsorted(found, labels)])


def homogenize_image(
    labels: Ints,
    phases: Mapping[int, float],
    lengths: tuple[float, ...],
    *,
    boundary: str = "periodic",
    solver: str = "cg",
    tolerance: float = 1e-8,
    threads: int = 1,
) -> tuple[CellSolution, float]:
    r"""Effective conductivity tensor of a voxel image, and an estimate of its discretization error.

    Parameters
    ----------
    labels : ndarray of int, shape (n1, n2[, n3])
    phases : mapping of int to float [W/(m K)]
    lengths : tuple of float [m]
        Edges of the image.
    boundary, solver, tolerance, threads
        As in `etc_engine.engines.voxel.cell.solve_cell` and `etc_engine.engines.voxel.cell.Scheme`.

    Returns
    -------
    solution : CellSolution
    relative_error : float
        :math:`2 \max |k_h - k_{h/2}| / k_h` against the image with every voxel halved, for the error falls with the
        first power of h. An image whose halved voxels are more than 8 million is compared with the continuous Green
        operator instead; NaN if that does not converge.

    Raises
    ------
    InputError, ConvergenceError

    Notes
    -----
    The voxels are taken as they are: cubes with sharp faces. What the image lost of the true interfaces is not in the
    estimate.

    Examples
    --------
    >>> layers = np.repeat([[0], [1]], 4, axis=0) * np.ones((1, 4), dtype=int)
    >>> solution, error = homogenize_image(layers, {0: 1.0, 1: 3.0}, (1.0, 1.0))
    >>> np.diag(solution.tensor).round(9).tolist(), error < 1e-6
    ([1.5, 2.0], True)
    """
    conductivity = image_conductivity(labels, phases)

    def solve(values: Floats, green: str, limit: int = 5000) -> CellSolution:
        scheme = Scheme(solver, green, tolerance, threads, limit)
        return solve_cell(values, lengths, boundary=boundary, scheme=scheme)

    found = solve(conductivity, "rotated")
    if not np.diag(found.tensor).any():
        return found, 0.0  # nothing conducts
    d = labels.ndim
    other, factor = None, 2.0
    if conductivity.size * 2**d <= LARGEST_REFINED:
        other = solve(np.asarray(np.kron(conductivity, np.ones((2,) * d)), dtype=np.float64), "rotated")
    elif conductivity.min() > 0.0 and np.isfinite(conductivity).all():
        factor = 1.0
        with suppress(ConvergenceError):
            other = solve(conductivity, "continuous", RINGING_LIMIT)
    if other is None:
        return found, float("nan")
    first, second = np.diag(found.tensor), np.diag(other.tensor)
    conducts = first > 0.0
    difference = (np.abs(first - second)[conducts] / first[conducts]).max(initial=0.0)
    return found, float(factor * difference + tolerance)
