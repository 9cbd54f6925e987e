"""Voxels of a medium: exact volume fractions, and a laminate in every voxel that an interface crosses."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.engines.voxel.conductivity import VoxelConductivity
from etc_engine.engines.voxel.pieces import Pieces, find_pieces
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium
from etc_engine.medium.phases import check_phases, of_owners, overlapping_axes

VOXELS = ("laminate", "binary")
FADING = 100.0
"""Contrast of an inclusion to the matrix, or its inverse, beyond which laminates give way to isotropic voxels."""

FEWEST = 4
"""Voxels across the smallest inclusion, at least."""

FIELDS = 7
"""Vector fields that the solver holds at once."""


@dataclass(frozen=True, eq=False)
class VoxelImage:
    """A medium on a regular grid.

    Parameters
    ----------
    conductivity : VoxelConductivity
    volume_fraction : float
        Of the inclusions, as the voxels hold them.
    fractions : ndarray, shape (n1, n2[, n3])
        Of the inclusions in every voxel.
    """

    conductivity: VoxelConductivity
    volume_fraction: float
    fractions: NDArray[np.float64]


def grid_shape(lengths: tuple[float, ...], resolution: int) -> tuple[int, ...]:
    """Voxels along each axis, as cubic as the box allows.

    Examples
    --------
    >>> grid_shape((1.0, 2.0, 1.26), 50)
    (50, 100, 63)
    """
    shortest = min(lengths)
    return tuple(max(round(resolution * length / shortest), resolution) for length in lengths)


def smallest_diameter(medium: Medium, resolution: int) -> float:
    """Diameter of the smallest inclusion in voxels."""
    box = medium.packing.box
    step = max(length / n for length, n in zip(box.lengths, grid_shape(box.lengths, resolution), strict=True))
    return 2.0 * float(medium.packing.radii.min()) / step


def coarsest_resolution(lengths: tuple[float, ...], radius: float) -> int:
    """Least resolution that has `FEWEST` voxels across an inclusion of the radius, in cubic voxels.

    Examples
    --------
    >>> coarsest_resolution((1.0, 2.0), 0.05)
    40
    """
    return int(np.ceil(FEWEST * min(lengths) / (2.0 * radius) * (1.0 - 1e-12)))


def check_resolution(medium: Medium, resolution: int) -> None:
    """Refuse a grid with fewer than `FEWEST` voxels across the smallest inclusion, or that does not fit into memory.

    Raises
    ------
    InputError
    """
    check_memory(medium.packing.box.lengths, resolution)
    spanned = smallest_diameter(medium, resolution)
    if spanned < FEWEST * (1.0 - 1e-12):
        diameter = 2.0 * float(medium.packing.radii.min())
        needed = coarsest_resolution(medium.packing.box.lengths, 0.5 * diameter)
        raise InputError(
            f"resolution {resolution} is too coarse: the smallest inclusion, of diameter {diameter:.6g}, spans "
            f"{spanned:.2g} voxels and {FEWEST} are needed: take a resolution of at least {needed}"
        )


def check_memory(lengths: tuple[float, ...], resolution: int) -> None:
    """Refuse a resolution that is no whole number of at least 1, or whose grid this machine has no memory for.

    Raises
    ------
    InputError
    """
    if not isinstance(resolution, (int, np.integer)) or resolution < 1:
        raise InputError(f"the resolution is a whole number of at least 1, found {resolution!r}")
    shape = grid_shape(lengths, int(resolution))
    needed = FIELDS * len(shape) * 8.0 * float(np.prod([float(count) for count in shape]))
    there = float(os.sysconf("SC_PAGE_SIZE")) * float(os.sysconf("SC_PHYS_PAGES"))
    if needed > there:
        grid = " x ".join(str(count) for count in shape)
        raise InputError(
            f"resolution {resolution} makes a grid of {grid} voxels, which needs about {needed / 1e9:.3g} GB of memory "
            f"where this machine has {there / 1e9:.3g}: use a lower resolution"
        )


def voxelize(medium: Medium, resolution: int = 64, voxels: str = "laminate") -> VoxelImage:
    r"""A medium on a grid of voxels.

    .. math:: k = \langle k \rangle (I - n n^T) + \langle k^{-1} \rangle^{-1} n n^T

    Parameters
    ----------
    medium : Medium
        Its box is filled; periodic axes repeat the inclusions, walls cut them.
    resolution : int
        Voxels along the shortest edge of the box; along the others the number that makes the voxels most nearly cubic.
    voxels : str
        ``laminate``: a voxel that an interface crosses conducts like layers of its phases, in their exact volume
        fractions, normal to the direction from the inclusion's centre to the voxel's. ``binary``: every voxel has the
        conductivity at its centre.

    Returns
    -------
    VoxelImage

    Raises
    ------
    InputError
        If there is no such kind of voxels, or the resolution is below 2.

    Notes
    -----
    Fractions are exact: in closed form where one surface crosses a voxel; where the radical plane of two overlapping
    inclusions does too (that is where `etc_engine.medium.phases.find_owners` divides them), by the kernels behind the
    exact solid fraction. A
    voxel with pieces f_i of several inclusions is one laminate of all their phases and the matrix, normal to the
    principal axis of :math:`\sum f_i (1 - f_i) n_i n_i^T`: right for the thin layer of matrix between two inclusions.
    A voxel that holds part of an insulator (a perfect conductor) is isotropic with the mean conductivity (mean
    resistivity) instead: no heat crosses the interface, so that nothing is gained by a laminate that insulates
    whole voxels along the normal; the error is a tenth. The same holds long before: from a contrast c of 100 to the
    matrix (or 1/100) on, the logarithms of a voxel's conductivities pass by the part 1 - 100/c from the laminate to the
    isotropic mean resistivity (mean conductivity). That supposes that the better conductor (the worse one,
    of disks) does not reach through the cell: where inclusions overlap all the way across, laminates remain.

    References
    ----------
    L. Gélébart and F. Ouaki, J. Comput. Phys. 294, 90 (2015), 10.1016/j.jcp.2015.03.048.
    M. Kabel, D. Merkert and M. Schneider, Comput. Methods Appl. Mech. Eng. 294, 168 (2015), 10.1016/j.cma.2015.06.003.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.medium import Pores
    >>> from etc_engine.packing.particles import ParticlePacking
    >>> disk = ParticlePacking([[0.0, 0.0]], [0.4], Box((1.0, 1.0), (True, True)))
    >>> image = voxelize(Medium(disk, 5.0, pores=Pores(1.0)), 10)
    >>> abs(image.volume_fraction - 0.16 * np.pi) < 1e-14
    True
    """
    if voxels not in VOXELS:
        raise InputError(f"unknown voxels {voxels!r}: choose {' or '.join(VOXELS)}")
    if resolution < 2:
        raise InputError(f"a grid has at least 2 voxels along an edge, found a resolution of {resolution}")
    check_phases(medium)
    shape = grid_shape(medium.packing.box.lengths, resolution)
    pieces = find_pieces(medium.packing, shape)
    fractions = np.bincount(pieces.voxel, pieces.fraction, pieces.owner.size).astype(np.float64)
    fractions[pieces.owner >= 0] = 1.0
    scalars = of_owners(medium, pieces.owner)
    if voxels == "binary":
        central = pieces.central
        scalars[pieces.voxel[central]] = medium.conductivity[pieces.inclusion[central]]
        share = float((pieces.owner >= 0).sum() + np.unique(pieces.voxel[central]).size) / scalars.size
        d = medium.dimension
        plain = VoxelConductivity(
            scalars.reshape(shape), np.zeros(0, dtype=np.int64), np.zeros((0, d)), np.zeros((0, d, d))
        )
        return VoxelImage(plain, share, fractions.reshape(shape))
    layered = VoxelConductivity(scalars.reshape(shape), *_laminates(medium, pieces))
    return VoxelImage(layered, float(fractions.mean()), fractions.reshape(shape))


def _laminates(medium: Medium, pieces: Pieces) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Voxels that an interface crosses: flat numbers, principal conductivities (the normal one first), axes."""
    d = medium.dimension
    rows, of = np.unique(pieces.voxel, return_inverse=True)
    k = medium.conductivity[pieces.inclusion]
    filled = np.minimum(np.bincount(of, pieces.fraction, rows.size), 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        parallel = np.bincount(of, pieces.fraction * k, rows.size)
        parallel += np.where(filled < 1.0, (1.0 - filled) * medium.pores.conductivity, 0.0)
        resistance = np.bincount(of, pieces.fraction / k, rows.size)
        resistance += np.where(filled < 1.0, (1.0 - filled) / medium.pores.conductivity, 0.0)
        series = 1.0 / resistance
    weight = pieces.fraction * (1.0 - pieces.fraction) + 1e-12
    axes = np.empty((rows.size, d, d))
    single = np.bincount(of, minlength=rows.size) == 1
    alone = single[of]
    axes[of[alone]] = _frame(pieces.normal[alone])
    moments = np.zeros((rows.size, d, d))
    np.add.at(
        moments,
        of[~alone],
        weight[~alone, None, None] * pieces.normal[~alone, :, None] * pieces.normal[~alone, None, :],
    )
    axes[~single] = np.linalg.eigh(moments[~single])[1][:, :, ::-1]
    least = np.full(rows.size, medium.pores.conductivity)
    largest = least.copy()
    np.minimum.at(least, of, k)
    np.maximum.at(largest, of, k)
    principal = np.repeat(parallel[:, None], d, axis=1).astype(np.float64)
    principal[:, 0] = np.where(least > 0.0, np.minimum(series, parallel), parallel)
    _fade(principal, medium, least, largest, series, parallel.astype(np.float64))
    principal[np.isinf(largest)] = series[np.isinf(largest), None]
    return rows, principal, axes


def _fade(
    principal: NDArray[np.float64],
    medium: Medium,
    least: NDArray[np.float64],
    largest: NDArray[np.float64],
    series: NDArray[np.float64],
    parallel: NDArray[np.float64],
) -> None:
    """Bring laminates of large finite contrast to isotropic voxels, in place."""
    matrix = medium.pores.conductivity
    if matrix == 0.0:
        return
    ahead, behind = _share_faded(largest / matrix), np.zeros(least.size)
    finite = (least > 0.0) & np.isfinite(largest)
    behind[finite] = _share_faded(matrix / least[finite])
    better = finite & (ahead > 0.0) & (behind == 0.0)
    worse = finite & (behind > 0.0) & (ahead == 0.0)
    if better.any() and not _reach_through(medium, medium.conductivity > FADING * matrix):
        share = ahead[better, None]
        principal[better] = principal[better] ** (1.0 - share) * series[better, None] ** share
    # spheres that touch leave the matrix between them connected, disks cut it off
    if worse.any() and not (medium.dimension == 2 and _reach_through(medium, medium.conductivity * FADING < matrix)):
        share = behind[worse, None]
        principal[worse] = principal[worse] ** (1.0 - share) * parallel[worse, None] ** share


def _share_faded(contrast: NDArray[np.float64]) -> NDArray[np.float64]:
    """Part of the way from the laminate to the isotropic voxel: like 1/c, as k itself comes to its limit."""
    return np.asarray(1.0 - FADING / np.maximum(contrast, FADING))


def _reach_through(medium: Medium, members: NDArray[np.bool_]) -> bool:
    """Whether some of the inclusions overlap all the way across the cell, along any axis."""
    return bool(overlapping_axes(medium.packing, members, medium.packing.box.periodic))


def _frame(normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Orthogonal matrices with the given unit vectors as first columns: Householder reflections."""
    d = normals.shape[1]
    sign = np.where(normals[:, 0] > 0.0, 1.0, -1.0)
    mirror = normals.copy()
    mirror[:, 0] += sign
    scale = 2.0 / (mirror**2).sum(axis=1)
    frames = np.eye(d) - scale[:, None, None] * mirror[:, :, None] * mirror[:, None, :]
    return frames * np.where(np.arange(d) == 0, -sign[:, None], 1.0)[:, None, :]
