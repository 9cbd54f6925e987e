"""A section through a medium and the heat flux in it, for pictures and points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import map_coordinates

from etc_engine.arrays import Floats
from etc_engine.engines.voxel.cell import DEFAULT_SCHEME, Scheme, solve_cell
from etc_engine.engines.voxel.voxelization import check_resolution, voxelize
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium


@dataclass(frozen=True, eq=False)
class Section:
    """Fields in a plane of constant z (of disks: everywhere), under a unit mean gradient along x.

    Parameters
    ----------
    extent : tuple of float [m]
        Edges of the section along x and y.
    fractions : ndarray, shape (n1, n2)
        Volume fraction of the inclusions.
    flux : ndarray, shape (n1, n2) [W/m2]
        Magnitude of the heat flux.
    height : float, optional [m]
        The plane's z; none of disks.
    """

    extent: tuple[float, float]
    fractions: Floats
    flux: Floats
    height: float | None = None


def solve_section(
    medium: Medium,
    *,
    resolution: int = 64,
    boundary: str = "periodic",
    voxels: str = "laminate",
    scheme: Scheme = DEFAULT_SCHEME,
) -> Section:
    """Heat flux in a section of a medium, of spheres where the inclusions fill the largest area.

    Parameters
    ----------
    medium, resolution, boundary, voxels, scheme
        As in `etc_engine.engines.voxel.homogenize.homogenize_voxel`.

    Returns
    -------
    Section

    Raises
    ------
    InputError, ConvergenceError
        Also if an inclusion conducts perfectly: fluxes inside it are not known.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.3], Box((1.0, 1.0), (True, True)))
    >>> solve_section(Medium(disk, 1.0, pores=Pores(1.0)), resolution=16).flux.max().round(12)
    np.float64(1.0)
    """
    check_resolution(medium, resolution)
    if np.isinf(medium.conductivity).any():
        raise InputError("a picture of the flux needs finite conductivities: give the inclusions a large one")
    image = voxelize(medium, resolution, voxels)
    lengths = medium.packing.box.lengths
    solution = solve_cell(image.conductivity, lengths, boundary=boundary, scheme=scheme, keep_gradients=True, axes=(0,))
    flux = np.sqrt((image.conductivity.apply(np.ascontiguousarray(solution.gradients[0])) ** 2).sum(axis=0))
    if medium.dimension == 3:
        layer = int(np.argmax(image.fractions.sum(axis=(0, 1)).round(9)))  # of layers alike the first
        height = (layer + 0.5) * lengths[2] / flux.shape[2]
        return Section((lengths[0], lengths[1]), image.fractions[:, :, layer], flux[:, :, layer], height)
    return Section((lengths[0], lengths[1]), image.fractions, flux)


def section_of(medium: Medium, method: str, options: Mapping[str, Any]) -> Section:
    """The section for the options of the engine table; ``method`` is the kind of voxels."""
    given = dict(options)
    scheme = Scheme(**{key: given.pop(key) for key in ("solver", "green", "threads") if key in given})
    boundary = given.pop("boundary", None) or ("periodic" if all(medium.box.periodic) else "walls")
    return solve_section(medium, boundary=boundary, voxels=method, scheme=scheme, **given)


def temperature_between_walls(gradients: Floats, axis: int, length: float) -> Floats:
    """Temperature in the voxels of a cell between walls, 0 at the low one, for a unit mean gradient.

    Parameters
    ----------
    gradients : ndarray, shape (d, n1, n2[, n3])
        Of the load along the axis, from `etc_engine.engines.voxel.cell.solve_cell` with walls.
    axis : int
        Normal of the isothermal walls.
    length : float [m]
        Distance of the walls.

    Returns
    -------
    ndarray, shape (n1, n2[, n3]) [K]
        For a mean gradient of 1 K/m.

    Examples
    --------
    >>> temperature_between_walls(np.ones((2, 2, 3)), 1, 6.0)[0]
    array([1., 3., 5.])
    """
    along = gradients[axis] * (length / gradients.shape[1 + axis])
    return np.asarray(np.cumsum(along, axis=axis) - 0.5 * along)


def sample(field: Floats, points: ArrayLike, lengths: tuple[float, ...]) -> Floats:
    """Values at points, linear between the centres of the voxels.

    Parameters
    ----------
    field : ndarray, shape (n1, n2[, n3])
    points : array_like, shape (m, d) [m]
    lengths : tuple of float [m]
        Edges of the cell.

    Returns
    -------
    ndarray, shape (m,)

    Examples
    --------
    >>> sample(np.array([[1.0, 2.0], [3.0, 4.0]]), [[0.25, 0.5]], (1.0, 1.0))
    array([1.5])
    """
    places = np.asarray(points, dtype=np.float64) / np.asarray(lengths) * np.array(field.shape) - 0.5
    return np.asarray(map_coordinates(field, places.T, order=1, mode="nearest"))
