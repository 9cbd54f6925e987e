"""What several commands share: reading option words, and writing results without leaving halves behind."""

from __future__ import annotations

import json
import math
from importlib.util import find_spec
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import click

from etc_engine.box import AXES, Box, parse_periodic
from etc_engine.durable.files import replacing
from etc_engine.errors import InputError, OutputError


def parse_box(lengths: str, periodic: str) -> Box:
    """A box from the words of ``--box 1,1`` and ``--periodic xy``."""
    try:
        edges = tuple(float(word) for word in lengths.split(","))
    except ValueError:
        raise InputError(f"--box takes edge lengths separated by commas, such as 1,1: found {lengths!r}") from None
    return Box(edges, parse_periodic(periodic, len(edges)))


def per_axis_and_tensor(tensor: Any, axes: tuple[int, ...]) -> dict[str, Any]:
    """The conductivity along the axes, and the whole tensor where all of its components are known.

    Between walls a heat flow has a conductivity along the axis alone: the other components do not exist.
    """
    found: dict[str, Any] = {"conductivity_per_axis": {AXES[a]: float(tensor[a, a]) for a in axes}}
    if all(math.isfinite(k) for row in tensor.tolist() for k in row):
        found["conductivity_tensor"] = tensor
    return found


def tensor_of(record: dict[str, Any]) -> Any:
    """The tensor of such a record, with NaN for components that do not exist, as netCDF marks what is missing."""
    import numpy as np

    along = np.array(list(record["conductivity_per_axis"].values()))
    whole = np.full((along.size, along.size), np.nan)
    np.fill_diagonal(whole, along)
    return record.get("conductivity_tensor", whole)


def print_json(record: dict[str, Any]) -> None:
    """One JSON object on stdout; NaN becomes null."""
    click.echo(json.dumps(_plain(record)))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


PICTURES = (".png", ".svg", ".pdf", ".jpg")


def check_picture(path: Path) -> None:
    """Refuse a picture whose format is not known, or where matplotlib is not installed.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in PICTURES:
        raise InputError(f"a picture is written as {', '.join(PICTURES)}: found {str(path)!r}")
    if find_spec("matplotlib") is None:
        raise InputError("pictures need matplotlib: install it with pip install '.[plot]' in the folder of etc_engine")


RESULT_MARKS = (b"study_digest", b"study_file")
"""Names of attributes that only the result of a whole study has."""


FOREIGN = (".csv", ".dump", ".html", ".json", ".npy", ".pdf", ".png", ".svg", ".toml", ".txt", ".vtk", ".vtp", ".xyz")
"""Endings of files that are no netCDF."""


def check_netcdf(path: Path) -> None:
    """Refuse the ending of another format for a file that is written as netCDF.

    Raises
    ------
    OutputError
    """
    if path.suffix.lower() in FOREIGN:
        raise OutputError(
            f"the output is written as netCDF: name it {path.with_suffix('.nc').name}, found {path.name!r}"
        )


def check_place(path: Path, *inputs: Path, replaces_result: bool = False) -> None:
    """Refuse an output that cannot be written, or that would destroy an input or a result, before the work begins.

    Parameters
    ----------
    path : Path
    *inputs : Path
    replaces_result : bool
        Whether the command has asked the user already (``--overwrite``) before it replaces the result of a study.

    Raises
    ------
    OutputError
    """
    for source in inputs:
        if path.exists() and source.exists() and path.samefile(source):
            raise OutputError(f"the output {path} is the input itself: it would be lost, choose another name")
    if not replaces_result and _is_result(path):
        raise OutputError(
            f"{path} is the result of a sweep or a transient: it would be lost; choose another name, or remove it first"
        )
    with replacing(path, keep=False):
        pass


def _is_result(path: Path) -> bool:
    """Whether a file is the result of a study. Its bytes are searched: a damaged file may hang the netCDF library."""
    if not path.is_file():
        return False
    try:
        with path.open("rb") as file:
            if not file.read(8).startswith((b"\x89HDF", b"CDF")):
                return False
            with mmap(file.fileno(), 0, access=ACCESS_READ) as content:
                return any(content.find(mark) >= 0 for mark in RESULT_MARKS)
    except (OSError, ValueError):
        return False
