"""The periodic cell problem on voxels: effective conductivity tensor of an image."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from etc_engine.arrays import Floats
from etc_engine.box import AXES
from etc_engine.engines.voxel.conductivity import VoxelConductivity, voxel_conductivity
from etc_engine.engines.voxel.connectivity import conducting_voxels, joined_voxels
from etc_engine.engines.voxel.green import GradientProjection, gradient_projection
from etc_engine.engines.voxel.iterations import LoadSolution, Projection, solve_conjugate_gradients, solve_eyre_milton
from etc_engine.engines.voxel.walls import WallProjection, wall_projection
from etc_engine.errors import InputError

SOLVERS = ("cg", "eyre-milton")
BOUNDARIES = ("periodic", "walls")
NOTHING = 1e-14
"""A conductivity below this part of the largest counts as 0."""

CUT_OFF = 1e-8
"""Beside insulators, an effective conductivity below this part of the largest of a voxel is the rounding of 0."""

SINGULAR = 1e-11
"""Part of the largest resistivity below which perfect conductors are said to join across the cell."""


@dataclass(frozen=True)
class Scheme:
    """How a cell is solved.

    Parameters
    ----------
    solver : str
        ``cg`` or ``eyre-milton``.
    green : str
        ``rotated`` or ``continuous``, see `etc_engine.engines.voxel.green.gradient_projection`.
    tolerance : float
        Relative error of the conductivity left by the solver.
    threads : int
        Threads of the FFT; the result does not depend on them.
    limit : int
        Most iterations of a load.
    """

    solver: str = "cg"
    green: str = "rotated"
    tolerance: float = 1e-8
    threads: int = 1
    limit: int = 5000


DEFAULT_SCHEME = Scheme()


@dataclass(frozen=True, eq=False)
class CellSolution:
    """Effective conductivity of an image.

    Parameters
    ----------
    tensor : ndarray, shape (d, d) [W/(m K)]
        With walls only the diagonal; the rest is NaN.
    iterations : int
        Most of a load.
    solver_error : float
        Largest estimated relative error that the solver left of a load.
    gradients : tuple of ndarray, shape (d, n1, n2[, n3]) [1/m]
        Where asked for: the temperature gradient under a unit mean gradient along each axis wanted.
    """

    tensor: Floats
    iterations: int
    solver_error: float
    gradients: tuple[Floats, ...] = ()


def solve_cell(
    conductivity: ArrayLike | VoxelConductivity,
    lengths: Sequence[float],
    *,
    boundary: str = "periodic",
    scheme: Scheme = DEFAULT_SCHEME,
    axes: tuple[int, ...] | None = None,
    keep_gradients: bool = False,
) -> CellSolution:
    r"""Effective conductivity tensor of an image of any number of phases.

    .. math:: \nabla \cdot (k \nabla T) = 0, \quad \langle \nabla T \rangle = E, \quad
              k_{eff} E = \langle k \nabla T \rangle

    Parameters
    ----------
    conductivity : array_like, shape (n1, n2[, n3]) or (n1, n2[, n3], d, d) [W/(m K)]
        A number or a symmetric tensor for each voxel. Numbers may be 0, or inf (with ``cg``), but not both together.
    lengths : sequence of float [m]
        Edges of the cell.
    boundary : str
        ``periodic``; or ``walls``: along each axis between two isothermal faces, the others adiabatic. That is the
        periodic cell of the image and its mirror images, solved by sines and cosines at the size of the image.
    scheme : Scheme
    axes : tuple of int, optional
        Load axes wanted, all by default; components between others are NaN.
    keep_gradients : bool
        Whether the gradient fields are returned too.

    Returns
    -------
    CellSolution

    Raises
    ------
    InputError, ConvergenceError

    Notes
    -----
    With perfect conductors the resistivities are solved for fluxes, which is the same discrete problem seen from its
    other side. `tolerance` bounds the change of the polarization with Eyre-Milton, to which the error of the
    conductivity is proportional; conjugate gradients estimate that error itself, which is the square of the
    residual's, and need about half the iterations for it. Where voxels insulate, values below 1e-8 of the largest
    conductivity is rounding, and returned as 0 with no error. So is the conductivity along an axis along which the
    conducting voxels join over corners or edges alone: the discrete operator lets heat through those, which falls
    with the logarithm of the voxel only.

    Examples
    --------
    >>> layers = np.repeat([[1.0], [3.0]], 4, axis=0) * np.ones(4)
    >>> solve_cell(layers, (1.0, 1.0)).tensor.round(9) + 0.0
    array([[1.5, 0. ],
           [0. , 2. ]])
    """
    image = voxel_conductivity(conductivity)
    d = len(image.shape)
    _check_numbers(d, lengths, scheme, axes)
    _check(image, boundary, scheme.solver)
    spacing = tuple(length / count for length, count in zip(lengths, image.shape, strict=True))
    perfect = bool(np.isinf(image.extremes()[1]))
    wanted = tuple(range(d)) if axes is None else axes
    tensor, loads = np.full((d, d), np.nan), []
    for group in (wanted,) if boundary == "periodic" else tuple((axis,) for axis in wanted):
        projection: GradientProjection | WallProjection
        if boundary == "periodic":
            projection = gradient_projection(image.shape, spacing, scheme.green, scheme.threads)
        else:
            projection = wall_projection(image.shape, spacing, group[0], scheme.green, scheme.threads)
        if perfect:
            part, found = _solve_fluxes(image, projection, group, scheme)
        else:
            part, found = _solve_loads(image, projection.onto_gradients, group, scheme, keep_gradients)
            _cut_off(part, found, group, image, boundary)
        known = np.ix_(group, group)
        tensor[known] = part[known]
        loads += found
    kept: tuple[Floats, ...] = ()
    if keep_gradients and not perfect:
        kept = tuple(
            load.fluctuation + np.eye(d)[axis].reshape(d, *(1,) * d) for axis, load in zip(wanted, loads, strict=True)
        )
    return CellSolution(tensor, max(load.iterations for load in loads), max(load.error for load in loads), kept)


LONGEST_EDGE = 1e12
"""Times the shortest edge. The limit of flat cells is reached long before; squares of more would overflow."""


def _check_numbers(d: int, lengths: Sequence[float], scheme: Scheme, axes: tuple[int, ...] | None) -> None:
    tolerance, threads, limit = scheme.tolerance, scheme.threads, scheme.limit
    numbers = all(isinstance(x, (int, float, np.number)) and np.isfinite(float(x)) and x > 0.0 for x in lengths)
    if len(lengths) != d or not numbers:
        raise InputError(f"an image of {d} axes needs as many positive edge lengths, found {tuple(lengths)}")
    if max(lengths) > LONGEST_EDGE * min(lengths):
        raise InputError(
            f"the longest edge of an image may be {LONGEST_EDGE:g} times the shortest, found {tuple(lengths)}: see "
            "whether all of them are in the same unit"
        )
    if not isinstance(tolerance, (int, float, np.number)) or not 0.0 < tolerance < 1.0:
        raise InputError(f"the tolerance must lie between 0 and 1, found {tolerance!r}")
    if not isinstance(threads, (int, np.integer)) or threads < 1:
        raise InputError(f"the FFT needs at least one thread, found {threads!r}")
    if not isinstance(limit, (int, np.integer)) or limit < 1:
        raise InputError(f"a load needs at least one iteration, found {limit!r}")
    known = axes is None or (isinstance(axes, Sequence) and len(axes) > 0 and set(axes) <= set(range(d)))
    if not known or (axes is not None and len(set(axes)) < len(axes)):
        raise InputError(
            f"the load axes of an image of {d} axes are different numbers from 0 to {d - 1}, found {axes!r}"
        )


def _check(image: VoxelConductivity, boundary: str, solver: str) -> None:
    if boundary not in BOUNDARIES:
        raise InputError(f"unknown boundary {boundary!r}: choose {' or '.join(BOUNDARIES)}")
    if solver not in SOLVERS:
        raise InputError(f"unknown solver {solver!r}: choose {' or '.join(SOLVERS)}")
    if min(image.shape) < 2:
        raise InputError(f"an image needs at least 2 voxels along each axis, found {image.shape}")
    least, largest = image.extremes()
    perfect = bool(np.isinf(largest))
    insulates = least == 0.0 or (not perfect and least <= NOTHING * largest)
    if largest == 0.0:
        raise InputError("no voxel of the image conducts: at least one needs a conductivity above 0")
    if perfect and insulates:
        raise InputError(
            "the image holds both insulators (0) and perfect conductors (inf): give one of them a finite conductivity"
        )
    if np.isinf(least):
        raise InputError("every voxel of the image conducts perfectly: there is nothing to solve")
    if solver == "eyre-milton" and (perfect or insulates):
        raise InputError(
            f"Eyre-Milton does not converge with {'perfect conductors (inf)' if perfect else 'insulators (0)'}: "
            "use conjugate gradients (cg)"
        )


def _solve_loads(
    conductivity: VoxelConductivity,
    project: Projection,
    axes: tuple[int, ...],
    scheme: Scheme,
    keep: bool = False,
) -> tuple[Floats, list[LoadSolution]]:
    """A load along each axis. The energy of two loads is the flux of one and its imbalance in the other's gradient."""
    d = len(conductivity.shape)
    solve = solve_conjugate_gradients if scheme.solver == "cg" else solve_eyre_milton
    tensor = np.full((d, d), np.nan)
    loads: list[LoadSolution] = []
    single: dict[int, NDArray[np.float32]] = {}  # enough for a correction of second order
    for axis in axes:
        load = solve(conductivity, project, np.eye(d)[axis], scheme.tolerance, scheme.limit)
        tensor[axis, axis] = load.flux[axis]
        for earlier in axes[: len(loads)]:
            component = load.flux[earlier]
            if load.imbalance is None:
                component = 0.5 * (component + loads[axes.index(earlier)].flux[axis])
            else:
                imbalance = load.imbalance.astype(np.float32)
                component -= np.vdot(single[earlier], imbalance) / conductivity.scalars.size
            tensor[earlier, axis] = tensor[axis, earlier] = component
        if load.imbalance is not None and axis != axes[-1]:
            single[axis] = load.fluctuation.astype(np.float32)
        fluctuation = load.fluctuation if keep else np.zeros(0)
        loads.append(LoadSolution(load.flux, fluctuation, None, load.iterations, load.error))
    return tensor, loads


def _cut_off(
    tensor: Floats, loads: list[LoadSolution], axes: tuple[int, ...], image: VoxelConductivity, boundary: str
) -> None:
    """Make 0 the conductivity along an axis that nothing conducts along: rounding, and paths over corners alone."""
    least, largest = image.extremes()
    if least > NOTHING * largest:
        return
    joined = joined_voxels(conducting_voxels(image, NOTHING * largest), periodic=boundary == "periodic")
    for number, axis in enumerate(axes):
        if axis not in joined or tensor[axis, axis] <= CUT_OFF * largest:
            tensor[axis, list(axes)] = tensor[list(axes), axis] = 0.0
            loads[number] = replace(loads[number], error=0.0)


def _solve_fluxes(
    image: VoxelConductivity,
    projection: GradientProjection | WallProjection,
    axes: tuple[int, ...],
    scheme: Scheme,
) -> tuple[Floats, list[LoadSolution]]:
    """Mean fluxes along each axis through the resistivities, which vanish in perfect conductors."""
    d = len(image.shape)
    with np.errstate(divide="ignore"):  # scalars of anisotropic voxels are not used and may be 0
        resistivity = image.of(np.reciprocal)
    if isinstance(projection, GradientProjection):
        axes = tuple(range(d))  # the inverse takes them all
    found, loads = _solve_loads(resistivity, projection.onto_fluxes, axes, replace(scheme, solver="cg"))
    known = np.ix_(axes, axes)
    if np.linalg.eigvalsh(found[known])[0] <= SINGULAR * float(np.diag(resistivity.mean()).max()):
        along = AXES[axes[int(np.argmin(np.diag(found[known])))]]
        raise InputError(
            f"perfect conductors (inf) join across the cell along {along}: the effective conductivity is infinite; "
            "give them a finite conductivity"
        )
    found[known] = np.linalg.inv(found[known])
    return found, loads
