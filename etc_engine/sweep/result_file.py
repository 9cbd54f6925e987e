"""The result file of a sweep: written whole with a checksum of its data, and read only if it can be.

A process of its own reads each file first, within a time limit (:mod:`etc_engine.durable.apart`). A flipped bit that
leaves the file readable shows in the checksum.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.durable.apart import NETCDF, why_unreadable
from etc_engine.durable.files import replacing
from etc_engine.errors import OutputError

if TYPE_CHECKING:
    import xarray

WITH_ATTRIBUTES = "2:"
"""Begins a checksum that is of the attributes too."""


def checksum(dataset: xarray.Dataset, *, attributes: bool = True) -> str:
    """SHA-256 of the names, dimensions, types and values of all variables, and of the attributes but ``checksum``.

    Parameters
    ----------
    dataset : xarray.Dataset
    attributes : bool
        False for files of earlier versions, whose checksum is of the variables alone.

    Returns
    -------
    str
        In hexadecimal digits; with the attributes, `WITH_ATTRIBUTES` stands before them.
    """
    whole = hashlib.sha256()
    for name in sorted(str(name) for name in dataset.variables):
        variable = dataset.variables[name]
        values = np.asarray(variable.values)
        whole.update(f"{name} {variable.dims} {values.shape} ".encode())
        if values.dtype.kind in "biuf":
            little = values.astype(values.dtype.newbyteorder("<"), copy=False)
            whole.update(little.dtype.str.encode() + np.ascontiguousarray(little).tobytes())
        else:  # words, in whatever way they are held
            whole.update("\0".join(str(value) for value in values.ravel().tolist()).encode())
        if attributes:
            whole.update(_words(variable.attrs))
    if not attributes:
        return whole.hexdigest()
    whole.update(_words(dataset.attrs))
    return WITH_ATTRIBUTES + whole.hexdigest()


def _words(attributes: Mapping[Any, Any]) -> bytes:
    """Attributes as they come back from a file: a list of one value is that value, and a number has no width."""
    held = {str(name): np.ravel(np.asarray(value)).tolist() for name, value in attributes.items() if name != "checksum"}
    return json.dumps(held, sort_keys=True).encode()


def write_dataset(dataset: xarray.Dataset, output: Path) -> None:
    """Write a dataset as netCDF-4 with the attribute ``checksum``, whole or not at all.

    Raises
    ------
    OutputError
        If it cannot be written; nothing is left behind then.
    """
    sealed = dataset.assign_attrs(checksum=checksum(dataset))
    try:
        with replacing(output) as temporary:
            sealed.to_netcdf(temporary, engine="netcdf4", format="NETCDF4", encoding=_encoding(dataset))
    except (OSError, RuntimeError) as error:  # netCDF4 reports a full disk as RuntimeError
        raise OutputError(f"cannot write {output}: {error}; the finished units are safe in its shards") from None


def open_dataset(path: Path) -> xarray.Dataset:
    """The dataset of a sweep in a file, loaded, verified and closed.

    Raises
    ------
    OutputError
        If the file is missing, damaged, or is not the result of a sweep.
    """
    dataset = load_netcdf(path)
    if "study_digest" not in dataset.attrs:
        raise OutputError(f"{path} is not the result of a sweep: it has no attribute study_digest")
    return dataset


def load_netcdf(path: Path) -> xarray.Dataset:
    """Content of a netCDF file, its checksum verified where it has one.

    Raises
    ------
    OutputError
        If the file is missing or damaged.
    """
    import xarray

    trouble = why_unreadable(path, NETCDF)
    if trouble and _is_something_else(path):
        raise OutputError(
            f"cannot read {path}: it is no netCDF file; expected a result of this engine, such as `etc-engine sweep "
            "STUDY.toml -o out.nc` writes; `etc-engine info` says what particle files hold"
        )
    if trouble:
        raise OutputError(f"cannot read {path}: {trouble}")
    try:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as stored:
            dataset = stored.load()
    except OSError as error:
        raise OutputError(f"cannot read {path}: {error.strerror or error}") from None
    except (AttributeError, RuntimeError, ValueError, KeyError, IndexError, UnicodeDecodeError) as error:
        raise OutputError(f"cannot read {path}: it is damaged or no netCDF file ({error})") from None
    written = str(dataset.attrs.get("checksum", ""))
    if written not in ("", checksum(dataset, attributes=written.startswith(WITH_ATTRIBUTES))):
        raise OutputError(
            f"{path} is damaged: its data do not have the checksum that was written with them; take a copy, or run "
            "the study again"
        )
    return dataset


def _is_something_else(path: Path) -> bool:
    """Whether a file that is not empty begins like no netCDF file."""
    try:
        with path.open("rb") as file:
            start = file.read(4)
    except OSError:
        return False
    return bool(start) and not start.startswith((b"\x89HDF", b"CDF"))


def _encoding(dataset: xarray.Dataset) -> dict[str, dict[str, Any]]:
    """NaN is what a missing number is; integers have none, and no attribute should say so."""
    return {str(name): {"_FillValue": None} for name, values in dataset.variables.items() if values.dtype.kind != "O"}
