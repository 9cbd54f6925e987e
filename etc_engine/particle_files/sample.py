"""The sample: from the rows of a file to particles in a box; dimension, box and crop are decided here."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.box import AXES, Box, parse_periodic
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.digits import PrintedColumns
from etc_engine.particle_files.table import ParticleTable

FLAT = 1e-9
"""Centres whose heights differ by less than this part of the largest radius lie in one plane."""
SAME = 1e-12
"""Two faces closer than this part of the edge length are one."""
Range = tuple[float, float]


@dataclass(frozen=True)
class Sample:
    """The wanted part of a particle file.

    Parameters
    ----------
    box : tuple of (low, high), optional
        Faces of the box along each axis, in the coordinates of the file; they replace the file's. A low face of
        ``-inf`` makes the other number an edge length, from the file's low corner or from 0.
    periodic : str, optional
        Periodic axes as a word; it replaces the file's.
    crop : tuple of (low, high)
        Part of each axis to keep, in the coordinates of the file; ``-inf`` and ``inf`` stand for the faces of the
        box. A crop may reach beyond a wall: the wall moves. Empty stands for everything.
    dimension : int, optional
        2 for disks, 3 for spheres, where the file does not say.
    frame : int, optional
        Number of the frame from 0, or from the end if negative; the last one by default.
    radius_column : str, optional
        Name of the column of radii, where it has another one than ``radius``.
    unknown_periodic : bool
        Whether axes are periodic where neither the user nor the file says.
    """

    box: tuple[Range, ...] | None = None
    periodic: str | None = None
    crop: tuple[Range, ...] = ()
    dimension: int | None = None
    frame: int | None = None
    radius_column: str | None = None
    unknown_periodic: bool = False


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows of a file, as a reader finds them.

    Parameters
    ----------
    place : str
        The file, and the frame if it has several; for messages.
    positions : ndarray, shape (n, k) [m]
        In the coordinates of the file; k = 2 where the file has no heights.
    radii : ndarray, shape (n,) [m]
    bounds : ndarray, shape (k or 3, 2) [m], optional
        Faces of the file's box.
    periodic : tuple of bool, optional
        Periodic axes of the file's box.
    planar : bool, optional
        Whether the file says that its particles are disks; None where it does not say.
    conductivity, ids, types, temperature, printed, notes
        As in `ParticleTable`.
    scale : float
        Metres per unit of length of the file; box and crop of the user are in units of the file.
    """

    place: str
    positions: Floats
    radii: Floats
    bounds: Floats | None = None
    periodic: tuple[bool, ...] | None = None
    planar: bool | None = None
    conductivity: Floats | None = None
    ids: Ints | None = None
    types: NDArray[np.str_] | None = None
    temperature: Floats | None = None
    printed: PrintedColumns | None = None
    scale: float = 1.0
    notes: tuple[str, ...] = ()

    @property
    def flat(self) -> bool:
        """Whether all centres lie in one plane z = constant, or have no heights."""
        if self.positions.shape[1] == 2:
            return True
        return bool(np.ptp(self.positions[:, 2]) <= FLAT * np.abs(self.radii).max())


def make_table(rows: Rows, sample: Sample) -> ParticleTable:
    """Particles in their box.

    Raises
    ------
    InputError, GeometryError
        If there is no box, it does not fit the particles, or the crop is not understood or leaves nothing.

    Notes
    -----
    Faces that a crop makes are walls. They cut the particles that reach over them; a particle whose centre lies
    beyond is left out whole.
    """
    bad = ~np.isfinite(rows.positions).all(axis=1)
    if bad.any():
        row = int(np.flatnonzero(bad)[0])
        found = rows.positions[row].tolist()
        raise InputError(f"{rows.place}: particle {row} has a centre that is not finite: found {found}")
    bounds, periodic, notes = sample_box(rows, sample)
    dimension = len(bounds)
    whole = Box(tuple((bounds[:, 1] - bounds[:, 0]).tolist()), periodic)
    centers = rows.positions[:, :dimension] - bounds[:, 0]
    outside = np.any((centers < 0.0) | (centers > np.asarray(whole.lengths)), axis=1)
    cropped = (False,) * (2 * dimension)
    keep = np.arange(len(centers))
    if sample.crop:
        centers = whole.wrap(centers) + bounds[:, 0]
        bounds, periodic, cropped = _crop(rows, sample.crop, bounds, periodic)
        inside = (centers >= bounds[:, 0]) & (centers <= bounds[:, 1])
        keep = np.flatnonzero(inside.all(axis=1))
        if not keep.size:
            raise InputError(
                f"{rows.place}: no centre lies in the crop {_words(bounds)}, they lie in {_extent(centers)}"
            )
        centers = centers[keep] - bounds[:, 0]
    box = Box(tuple((bounds[:, 1] - bounds[:, 0]).tolist()), periodic)
    columns = {name: getattr(rows, name) for name in ("conductivity", "ids", "types", "temperature")}
    return ParticleTable(
        packing=ParticlePacking(centers, rows.radii[keep], box),
        wrapped=int(outside[keep].sum()) if rows.bounds is None else 0,
        origin=tuple(bounds[:, 0].tolist()),
        printed=rows.printed,
        cropped=cropped,
        notes=(*rows.notes, *notes),
        **{name: None if values is None else values[keep] for name, values in columns.items()},
    )


def sample_box(rows: Rows, sample: Sample) -> tuple[Floats, tuple[bool, ...], tuple[str, ...]]:
    """Faces of the box before a crop, shape (d, 2) [m], its periodic axes, and notes on what decided.

    Raises
    ------
    InputError
        If there is no box, or it does not fit the particles.
    """
    dimension, notes = _dimension(rows, sample)
    return *_faces(rows, sample, dimension), notes


def _crop(
    rows: Rows, crop: tuple[Range, ...], bounds: Floats, periodic: tuple[bool, ...]
) -> tuple[Floats, tuple[bool, ...], tuple[bool, ...]]:
    """Faces and periodic axes after the crop, and which walls it made."""
    if len(crop) != len(bounds):
        raise InputError(f"a crop of a {len(bounds)}D box needs {len(bounds)} ranges low:high, found {len(crop)}")
    faces, flags, cropped = bounds.copy(), list(periodic), []
    for axis, ends in enumerate(crop):
        edge = bounds[axis, 1] - bounds[axis, 0]
        moved = []
        for side, end in enumerate(ends):
            place = end * rows.scale
            moved.append(isfinite(end) and bool(abs(place - bounds[axis, side]) > SAME * edge))
            if moved[side]:
                faces[axis, side] = place
        name, words = AXES[axis], _words(faces[axis : axis + 1])
        if not faces[axis, 0] < faces[axis, 1]:
            raise InputError(f"the crop along {name} must go from low to high, found {words}")
        if flags[axis] and (faces[axis, 0] < bounds[axis, 0] or faces[axis, 1] > bounds[axis, 1]):
            raise InputError(
                f"the crop {words} along {name} goes beyond the periodic box {_words(bounds[axis : axis + 1])}"
            )
        cut = any(moved) and flags[axis]  # walls on either side, where there was a period
        flags[axis] = flags[axis] and not cut
        cropped += [True, True] if cut else moved
    return faces, tuple(flags), tuple(cropped)


def _words(bounds: Floats) -> str:
    return ", ".join(f"{low:g}:{high:g}" for low, high in bounds)


def _extent(centers: Floats) -> str:
    return _words(np.stack([centers.min(axis=0), centers.max(axis=0)], axis=1))


def _dimension(rows: Rows, sample: Sample) -> tuple[int, tuple[str, ...]]:
    """2 or 3, and a note where heights decide."""
    wanted = sample.dimension
    if wanted is not None and sample.box is not None and len(sample.box) != wanted:
        raise InputError(f"a box of {len(sample.box)} edges does not fit dimension {wanted}")
    heights = rows.positions.shape[1] == 3
    if wanted is None and sample.box is not None:
        wanted = len(sample.box)
        if wanted == 2 and heights and rows.flat and np.abs(rows.positions[:, 2]).max() > _slack(rows):
            raise InputError(
                f"{rows.place} has heights (z = {rows.positions[0, 2]:g}): a 2D box needs x,y and radius alone; give "
                "a 3D box, or --dimension 2 for disks"
            )
    if wanted == 3 and not heights:
        raise InputError(f"{rows.place} has no heights (z), which spheres in a 3D box need: give a 2D box")
    if wanted == 2 and not rows.flat:
        low, high = rows.positions[:, 2].min(), rows.positions[:, 2].max()
        raise InputError(
            f"{rows.place}: the centres have heights from {low:.6g} to {high:.6g}, so they are no disks: "
            "give a 3D box, or --dimension 3"
        )
    if wanted is not None:
        return wanted, ()
    if not heights or rows.planar:
        return 2, ()
    if rows.planar is None and rows.bounds is not None and len(rows.bounds) == 3 and rows.flat:
        return _flat_dimension(rows, rows.bounds[2])
    return 3, ()


def _slack(rows: Rows) -> float:
    return FLAT * float(np.abs(rows.radii).max())


def _flat_dimension(rows: Rows, slab: Floats) -> tuple[int, tuple[str, ...]]:
    """Dimension of one layer in a 3D box: disks in the slab that LAMMPS keeps about z = 0 in two dimensions, else
    spheres.

    A two-dimensional run of LAMMPS has a box that is periodic along z and holds the plane z = 0, and every centre
    lies in it.
    """
    slack = _slack(rows)
    planar = (
        bool(rows.periodic and rows.periodic[2])
        and slab[0] < -slack
        and slab[1] > slack
        and bool((np.abs(rows.positions[:, 2]) <= slack).all())
    )
    if planar:
        return 2, (
            "all heights are 0 in a box that is periodic along z, as in a two-dimensional run: the particles are taken "
            "for disks (--dimension 3 for spheres)",
        )
    return 3, (
        f"all centres lie at the height {rows.positions[0, 2]:g} of a 3D box: they are taken for spheres "
        "(--dimension 2 for disks)",
    )


def _faces(rows: Rows, sample: Sample, dimension: int) -> tuple[Floats, tuple[bool, ...]]:
    """Faces of the box, shape (d, 2), and its periodic axes."""
    if sample.box is None and rows.bounds is None:
        raise InputError(
            f"{rows.place} has no box, and --box is missing: give its edge lengths, such as "
            f"--box {','.join('1' * dimension)}, or its faces as low:high"
        )
    if sample.box is None:
        assert rows.bounds is not None
        bounds = np.array(rows.bounds[:dimension])
    else:
        bounds = np.array(sample.box, dtype=np.float64) * rows.scale
        corner = np.zeros(dimension) if rows.bounds is None else rows.bounds[:dimension, 0]
        lengths = bounds[:, 0] == -inf
        bounds[lengths] = np.stack([corner, corner + bounds[:, 1]], axis=1)[lengths]
        for axis, (low, high) in enumerate(bounds.tolist()):
            if sample.box[axis][0] > -inf and not (isfinite(low) and isfinite(high) and low < high):
                raise InputError(f"the box along {AXES[axis]} must go from low to high, found {low:g}:{high:g}")
    if sample.periodic is not None:
        return bounds, parse_periodic(sample.periodic, dimension)
    if rows.periodic is None or rows.bounds is None:
        return bounds, (sample.unknown_periodic,) * dimension
    flags = []
    for axis in range(dimension):
        edge = rows.bounds[axis, 1] - rows.bounds[axis, 0]
        flags.append(rows.periodic[axis] and bool(np.abs(bounds[axis] - rows.bounds[axis]).max() <= SAME * edge))
    return bounds, tuple(flags)
