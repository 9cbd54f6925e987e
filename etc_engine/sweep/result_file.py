"""The result file of a sweep: written whole with a checksum of its data, and read only if it can be.

A damaged HDF5 file can keep the netCDF library busy for ever or end the process, so that a process of its own reads
each file first, within a time limit. A flipped bit that leaves the file readable shows in the checksum.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.durable.files import replacing
from etc_engine.errors import OutputError

if TYPE_CHECKING:
    import xarray

SECONDS, BYTES_PER_SECOND = 30.0, 5e6
"""Time a file may take to be read: so long, and the time of its bytes at this rate."""

READER = """
import sys, netCDF4
with netCDF4.Dataset(sys.argv[1]) as file:
    for variable in file.variables.values():
        variable[...]
"""


def checksum(dataset: xarray.Dataset) -> str:
    """SHA-256 of the names, dimensions, types and values of all variables, coordinates included; attributes are not."""
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
    return whole.hexdigest()


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
    """What is in a netCDF file, its checksum verified where it has one.

    Raises
    ------
    OutputError
        If the file is missing or damaged.
    """
    import xarray

    refuse_unreadable(path)
    try:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as stored:
            dataset = stored.load()
    except OSError as error:
        raise OutputError(f"cannot read {path}: {error.strerror or error}") from None
    except (AttributeError, RuntimeError, ValueError, KeyError, IndexError, UnicodeDecodeError) as error:
        raise OutputError(f"cannot read {path}: it is damaged or no netCDF file ({error})") from None
    if dataset.attrs.get("checksum", "") not in ("", checksum(dataset)):
        raise OutputError(
            f"{path} is damaged: its data do not have the checksum that was written with them; take a copy, or run "
            "the study again"
        )
    return dataset


def refuse_unreadable(path: Path) -> None:
    """Refuse a file that the netCDF library cannot read to its end within a time limit, in a process of its own.

    Raises
    ------
    OutputError
    """
    try:
        size = path.stat().st_size
    except OSError as error:
        raise OutputError(f"cannot read {path}: {error.strerror}") from None
    limit = SECONDS + size / BYTES_PER_SECOND
    try:
        done = subprocess.run(
            [sys.executable, "-c", READER, str(path)], capture_output=True, text=True, timeout=limit, check=False
        )
    except subprocess.TimeoutExpired:
        raise OutputError(
            f"cannot read {path}: the netCDF library does not come to an end within {limit:.0f} s, the file is damaged"
        ) from None
    if done.returncode:
        said = (done.stderr.strip().splitlines() or [f"the reading process ended with {done.returncode}"])[-1]
        raise OutputError(f"cannot read {path}: it is damaged or no netCDF file ({said})")


def _encoding(dataset: xarray.Dataset) -> dict[str, dict[str, Any]]:
    """NaN is what a missing number is; integers have none, and no attribute should say so."""
    return {str(name): {"_FillValue": None} for name, values in dataset.variables.items() if values.dtype.kind != "O"}
