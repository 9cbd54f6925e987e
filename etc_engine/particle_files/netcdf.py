"""Packings as netCDF: particles with labels and units, the box and where the packing comes from as attributes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.box import AXES, Box, parse_periodic
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.csv_files import ParticleTable

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
    general = {
        "Conventions": "CF-1.11",
        "title": f"packing of {packing.count} {'disks' if packing.dimension == 2 else 'spheres'}",
        "box": list(packing.box.lengths),
        "periodic": packing.box.periodic_axes,
    }
    return xarray.Dataset(variables, attrs=general | dict(attributes or {}))


def write_netcdf(path: Path | str, table: ParticleTable, attributes: Mapping[str, Any] | None = None) -> None:
    """Write particles as netCDF, bit for bit, as :func:`packing_dataset` lays them out."""
    dataset = packing_dataset(table, attributes)
    plain: dict[str, Any] = {str(name): {"_FillValue": None} for name in dataset.variables}  # nothing is missing
    dataset.to_netcdf(path, engine="netcdf4", encoding=plain)


def read_netcdf(path: Path | str) -> ParticleTable:
    """Particles from a netCDF file with their box, as ``pack`` and ``solve`` write them.

    Raises
    ------
    InputError, GeometryError
        If the file is missing or no netCDF, a variable or attribute is missing, or a particle is not valid.
    """
    import xarray

    path = Path(path)
    try:
        with xarray.open_dataset(path, engine="netcdf4", decode_times=False) as dataset:
            dataset.load()
    except FileNotFoundError:
        raise InputError(f"there is no file {path}") from None
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
    columns = {
        name: np.asarray(dataset[name].values, dtype=np.float64)
        for name in (*names, "conductivity")
        if name in dataset and dataset[name].dims == ("particle",)
    }
    centers = np.stack([columns[axis] for axis in AXES[: box.dimension]], axis=1)
    return ParticleTable(ParticlePacking(centers, columns["radius"], box), columns.get("conductivity"))


def _box(path: Path, attributes: Mapping[str, Any]) -> Box:
    if "box" not in attributes or "periodic" not in attributes:
        raise InputError(f"{path} holds no packing: the attributes 'box' and 'periodic' are missing")
    lengths = np.atleast_1d(attributes["box"]).tolist()
    return Box(tuple(lengths), parse_periodic(str(attributes["periodic"]), len(lengths)))
