"""Packings as netCDF: particles with labels and units, the box and where the packing comes from as attributes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES, Box, parse_periodic
from etc_engine.durable.apart import NETCDF, why_unreadable
from etc_engine.errors import InputError
from etc_engine.particle_files.digits import EXACT, SINGLE, Digits, PrintedColumn, PrintedColumns
from etc_engine.particle_files.sample import Rows, Sample, make_table
from etc_engine.particle_files.table import ParticleTable

if TYPE_CHECKING:
    import xarray


def packing_dataset(table: ParticleTable, attributes: Mapping[str, Any] | None = None) -> xarray.Dataset:
    """Dataset of particles: ``x``, ``y``, ``z`` in 3D, ``radius`` and, where given, ``conductivity``.

    Parameters
    ----------
    table : ParticleTable
    attributes : mapping, optional
        Global attributes beside ``box`` (edge lengths [m]) and ``periodic`` (axes): seed, command, ...

    Returns
    -------
    xarray.Dataset
        One dimension, ``particle``.
    """
    import xarray

    packing = table.packing
    data = {AXES[axis]: (packing.centers[:, axis], "m", "centre") for axis in range(packing.dimension)}
    data["radius"] = (packing.radii, "m", "radius")
    if table.conductivity is not None:
        data["conductivity"] = (table.conductivity, "W m-1 K-1", "conductivity of the particle")
    variables = {
        name: ("particle", values, {"long_name": meaning, "units": units})
        for name, (values, units, meaning) in data.items()
    }
    if table.types is not None:
        variables["type"] = ("particle", table.types.astype(object), {"long_name": "type of the particle"})
    general = {
        "Conventions": "CF-1.11",
        "title": f"packing of {packing.count} {'disks' if packing.dimension == 2 else 'spheres'}",
        "box": list(packing.box.lengths),
        "periodic": packing.box.periodic_axes,
    }
    return with_ids(xarray.Dataset(variables, attrs=general | dict(attributes or {})), table)


def with_ids(dataset: xarray.Dataset, table: ParticleTable) -> xarray.Dataset:
    """The dataset with the ids of the particles as the coordinate ``particle``, and their low corner in the file."""
    if table.origin and any(table.origin):
        dataset = dataset.assign_attrs(origin=list(table.origin))
    if table.ids is None:
        return dataset
    return dataset.assign_coords(particle=("particle", table.ids, {"long_name": "id of the particle in its file"}))


def write_netcdf(path: Path | str, table: ParticleTable, attributes: Mapping[str, Any] | None = None) -> None:
    """Write particles as netCDF, bit for bit, as :func:`packing_dataset` lays them out."""
    dataset = packing_dataset(table, attributes)
    plain: dict[str, Any] = {str(name): {"_FillValue": None} for name in dataset.variables}  # nothing is missing
    dataset.to_netcdf(path, engine="netcdf4", encoding=plain)


def read_netcdf(path: Path | str, sample: Sample | None = None) -> ParticleTable:
    """Particles from a netCDF file with their box, as ``pack`` and ``solve`` write them.

    Raises
    ------
    InputError, GeometryError
        If the file is missing or no netCDF, a variable or attribute is missing, or a particle is not valid.
    """
    return make_table(netcdf_rows(Path(path)), sample or Sample())


def netcdf_rows(path: Path) -> Rows:
    """Rows of a netCDF file.

    Raises
    ------
    InputError
    """
    check_netcdf(path)
    return netcdf_part(path, 0, 1)


def check_netcdf(path: Path) -> None:
    """Refuse a file that the library cannot read to its end.

    Raises
    ------
    InputError
    """
    if not path.exists():
        raise InputError(f"there is no file {path}")
    trouble = why_unreadable(path, NETCDF)
    if trouble:
        raise InputError(f"{path} cannot be read as netCDF: {trouble}")


def netcdf_part(path: Path, part: int, parts: int) -> Rows:
    """Rows of one of several equal parts of a netCDF file that can be read.

    Raises
    ------
    InputError
    """
    import xarray

    try:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as whole:
            count = whole.sizes.get("particle", 0)
            first, last = (count * (part + k) // parts for k in (0, 1))
            dataset = (whole.isel(particle=slice(first, last)) if count else whole).load()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"{path} cannot be read as netCDF: {error}") from None
    box = _box(path, dataset.attrs)
    names = [*AXES[: box.dimension], "radius"]
    missing = [name for name in names if name not in dataset or dataset[name].dims != ("particle",)]
    if missing:
        raise InputError(
            f"{path} holds no packing: a {box.dimension}D box needs {', '.join(names)} along the dimension "
            f"'particle', found no {', '.join(missing)}"
        )
    held = {name: np.asarray(dataset[name].values) for name in dataset if dataset[name].dims == ("particle",)}
    ids = dataset.coords["particle"].values if "particle" in dataset.coords else held.get("id")
    return Rows(
        place=str(path),
        positions=np.stack([held[axis].astype(np.float64) for axis in AXES[: box.dimension]], axis=1),
        radii=held["radius"].astype(np.float64),
        bounds=np.stack([np.zeros(box.dimension), np.array(box.lengths)], axis=1),
        periodic=box.periodic,
        planar=box.dimension == 2,
        conductivity=held["conductivity"].astype(np.float64) if "conductivity" in held else None,
        ids=None if ids is None else ids.astype(np.int64),
        types=held["type"].astype(np.str_) if "type" in held else None,
        printed=_single([held[axis] for axis in AXES[: box.dimension]], held["radius"]),
    )


def _single(places: list[NDArray[Any]], radius: NDArray[Any]) -> PrintedColumns | None:
    """Steps of numbers in single precision, which only others write."""
    columns = [
        PrintedColumn(Digits(0, 0, SINGLE) if a.dtype == np.float32 else Digits(EXACT, EXACT))
        for a in (*places, radius)
    ]
    if all(a.dtype != np.float32 for a in (*places, radius)):
        return None
    return PrintedColumns(tuple(columns[:-1]), columns[-1], "write the file in double precision")


def _box(path: Path, attributes: Mapping[str, Any]) -> Box:
    if "box" not in attributes or "periodic" not in attributes:
        raise InputError(f"{path} holds no packing: the attributes 'box' and 'periodic' are missing")
    lengths = np.atleast_1d(attributes["box"]).tolist()
    return Box(tuple(lengths), parse_periodic(str(attributes["periodic"]), len(lengths)))
