"""Homogenization of disks and spheres in a matrix by FFT, with an estimate of its error."""

from __future__ import annotations

import time

import numpy as np

from etc_engine.engines.voxel.cell import CellSolution, solve_cell
from etc_engine.engines.voxel.voxelization import check_resolution, smallest_diameter, voxelize
from etc_engine.errors import ConvergenceError
from etc_engine.medium.composite import Composite, Homogenized

COARSEST = 4.0
"""Voxels across the smallest inclusion of the coarsest grid that takes part in the error estimate."""

RINGING_LIMIT = 300
"""Iterations after which the continuous Green operator is left out of the error estimate."""


def homogenize_voxel(
    composite: Composite,
    *,
    resolution: int = 64,
    boundary: str | None = None,
    solver: str = "cg",
    green: str = "rotated",
    voxels: str = "laminate",
    tolerance: float = 1e-8,
    threads: int = 1,
    estimate_error: bool = True,
) -> Homogenized:
    r"""Effective conductivity tensor of disks or spheres in a matrix, by FFT on a regular grid.

    Parameters
    ----------
    composite : Composite
        The geometry inside its box, with images of inclusions across periodic axes, cut at walls.
    resolution : int
        Voxels along the shortest edge of the box.
    boundary : str, optional
        ``periodic``: the cell repeats; ``walls``: along each axis between two isothermal faces, the others adiabatic.
        By default as the box is: walls, if it has any.
    solver, green, tolerance, threads
        As in `etc_engine.engines.voxel.cell.solve_cell`.
    voxels : str
        ``laminate`` or ``binary``, see `etc_engine.engines.voxel.voxelization.voxelize`.
    estimate_error : bool
        Whether the problem is solved on grids of half and a quarter of the resolution too, for
        `relative_error_estimate`: about a quarter (3D) or a half (2D) of the time on top. NaN otherwise.

    Returns
    -------
    Homogenized
        `volume_fraction` is that of the grid.

    Raises
    ------
    InputError
        If the smallest inclusion spans less than 4 voxels, or the solver does not go with the contrast.
    ConvergenceError

    Notes
    -----
    `relative_error_estimate` is not a bound. The error of the grid is of first order in the voxel, with a small
    constant whose sign may change with the grid, so that one difference says too little; the estimate is

    .. math:: \varepsilon = \varepsilon_{solver} +
              \max\big(2 |k_h - k_{2h}|, |k_{2h} - k_{4h}|, |k_h - k^{cont}_{2h}|\big) / k_h

    with the largest over the axes. The second is left out where an inclusion spans less than 4 voxels of size 4h; cont
    is the continuous Green operator, whose error has the other sign (left out at contrast 0 and infinity, where it
    does not converge).

    References
    ----------
    As `etc_engine.engines.voxel.green.gradient_projection` and `etc_engine.engines.voxel.voxelization.voxelize`.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [np.sqrt(0.3 / np.pi)], Box((1.0, 1.0), (True, True)))
    >>> result = homogenize_voxel(Composite(disk, 1.0, 7.7), resolution=32)
    >>> bool(abs(result.tensor[0, 0] / 1.60204759 - 1.0) < result.relative_error_estimate)  # exact: 1.60204759
    True
    """
    start = time.perf_counter()
    check_resolution(composite, resolution)
    box = composite.inclusions.box
    boundary = boundary or ("periodic" if all(box.periodic) else "walls")

    def solve(resolution: int, green: str, limit: int = 5000) -> tuple[CellSolution, float, int]:
        image = voxelize(composite, resolution, voxels)
        solution = solve_cell(
            image.conductivity,
            box.lengths,
            boundary=boundary,
            solver=solver,
            green=green,
            tolerance=tolerance,
            threads=threads,
            limit=limit,
        )
        return solution, image.volume_fraction, image.fractions.size

    fine, fraction, unknowns = solve(resolution, green)
    error = np.nan
    if estimate_error and not np.diag(fine.tensor).any():
        error = 0.0  # nothing conducts
    elif estimate_error:
        half, quarter = (resolution + 1) // 2, (resolution + 3) // 4
        middle = solve(half, green)[0]
        differences = [2.0 * _difference(fine, middle)]
        if smallest_diameter(composite, quarter) >= COARSEST:
            differences.append(_difference(middle, solve(quarter, green)[0]))
        least, largest = composite.contrast
        if least > 0.0 and np.isfinite(largest) and composite.matrix > 0.0:
            try:
                differences.append(_difference(fine, solve(half, "continuous", RINGING_LIMIT)[0]))
            except ConvergenceError:  # a large contrast: the other differences have to do
                differences.append(0.0)
        error = float(max(differences) + fine.solver_error)
    return Homogenized(fine.tensor, fraction, unknowns, fine.iterations, error, time.perf_counter() - start)


def _difference(one: CellSolution, other: CellSolution) -> float:
    """Largest difference along an axis, relative to the first; none along axes that do not conduct."""
    first, second = np.diag(one.tensor), np.diag(other.tensor)
    conducts = first > 0.0
    return float((np.abs(first - second)[conducts] / first[conducts]).max(initial=0.0))
