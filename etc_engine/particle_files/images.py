"""Voxel images: labels of phases on a regular grid, from NumPy, TIFF or raw files."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Ints
from etc_engine.durable import apart
from etc_engine.errors import InputError

NUMPY = b"\x93NUMPY"
TIFF = (b"II*\x00", b"MM\x00*", b"II+\x00", b"MM\x00+")
MOST_LABELS = 256
"""An image with more different values is one of grey levels, not of phases."""
TYPES = ("uint8", "uint16", "int16", "uint32", "int32", "float32", "float64")


@dataclass(frozen=True, eq=False)
class LabelImage:
    """Which phase each voxel belongs to.

    Parameters
    ----------
    labels : ndarray of int, shape (n1, n2[, n3])
        Along x, y and z.
    phases : tuple of int
        The different labels, rising.
    """

    labels: Ints
    phases: tuple[int, ...]

    @property
    def fractions(self) -> tuple[float, ...]:
        """Volume fraction of each phase."""
        counts = np.array([np.count_nonzero(self.labels == phase) for phase in self.phases])
        return tuple((counts / self.labels.size).tolist())


def is_image(path: Path | str, *, raw: bool = False) -> bool:
    """Whether a file is a voxel image, by its first bytes; a raw one by its ending, or because a shape is given."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            opening = file.read(6)
    except OSError:
        return False
    return raw or opening == NUMPY or opening[:4] in TIFF or path.suffix.lower() == ".raw"


def read_image(path: Path | str, shape: Sequence[int] = (), kind: str = "uint8") -> LabelImage:
    """Labels of the voxels of an image.

    Parameters
    ----------
    path : path
        ``.npy``: an array with the axes x, y and z in this order. TIFF: pages along z, rows along y, columns along
        x. Raw: x runs fastest, then y, then z.
    shape : sequence of int
        Voxels of a raw file along x, y and z.
    kind : str
        Type of the numbers of a raw file, little-endian.

    Returns
    -------
    LabelImage

    Raises
    ------
    InputError
        If the file is no such image, or it has one phase or grey levels.
    """
    path = Path(path)
    try:
        with path.open("rb") as file:
            opening = file.read(6)
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or error}") from None
    if opening == NUMPY:
        values = _numpy(path)
    elif opening[:4] in TIFF:
        values = _tiff(path)
    else:
        values = _raw(path, shape, kind)
    if values.ndim not in (2, 3) or min(values.shape, default=0) < 1:
        raise InputError(f"{path}: an image has two or three axes, found the shape {values.shape}")
    return _labelled(path, values)


def _labelled(path: Path, values: NDArray[np.generic]) -> LabelImage:
    if values.dtype.kind not in "buif":
        raise InputError(f"{path}: labels of phases are whole numbers, found {values.dtype}")
    if values.dtype.kind == "f" and not (np.isfinite(values).all() and (np.rint(values) == values).all()):
        raise InputError(f"{path}: labels of phases are whole numbers, found fractions: label the grey levels first")
    phases = np.unique(values)
    if phases.size > MOST_LABELS:
        raise InputError(
            f"{path} has {phases.size} different values: label its phases first (at most {MOST_LABELS} are understood)"
        )
    if phases.size < 2:
        raise InputError(f"{path} holds one phase only, of label {phases[0]}: there is nothing to homogenize")
    return LabelImage(np.ascontiguousarray(values, dtype=np.int64), tuple(int(phase) for phase in phases))


def _numpy(path: Path) -> NDArray[np.generic]:
    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except Exception as error:  # a damaged header raises errors of many kinds
        raise InputError(f"{path} cannot be read as a NumPy array: {error}") from None


def _tiff(path: Path) -> NDArray[np.generic]:
    if find_spec("tifffile") is None:
        raise InputError(
            "TIFF needs the library tifffile: install it with pip install '.[images]' in the folder of etc_engine"
        )
    trouble = apart.why_unreadable(path, apart.TIFF)
    if trouble:
        raise InputError(f"{path} cannot be read as TIFF: {trouble}")
    tifffile = import_module("tifffile")
    logger = logging.getLogger("tifffile")
    quiet, logger.disabled = logger.disabled, True  # what goes wrong is raised
    try:
        pages = np.asarray(tifffile.imread(path))
    except Exception as error:  # the library raises errors of many kinds for damaged files
        raise InputError(f"{path} cannot be read as TIFF: {error}") from None
    finally:
        logger.disabled = quiet
    if pages.ndim == 4 and pages.shape[-1] in (3, 4):
        raise InputError(f"{path} is a colour image: labels of phases are one number per voxel")
    return pages.T


def _raw(path: Path, shape: Sequence[int], kind: str) -> NDArray[np.generic]:
    if not shape:
        raise InputError(f"{path} is no .npy or TIFF image; if it is a raw one, give its shape, such as 100,100,100")
    if kind not in TYPES:
        raise InputError(f"numbers of a raw image are one of {', '.join(TYPES)}, found {kind!r}")
    dtype = np.dtype(kind).newbyteorder("<")
    wanted = int(np.prod([int(n) for n in shape], dtype=object)) * dtype.itemsize
    found = path.stat().st_size
    if min(shape) < 1 or wanted != found:
        raise InputError(
            f"{path} has {found} bytes, {' x '.join(map(str, shape))} voxels of {kind} need {wanted}: "
            "check the shape and the type of the numbers"
        )
    return np.fromfile(path, dtype=dtype).reshape(tuple(shape)[::-1]).T
