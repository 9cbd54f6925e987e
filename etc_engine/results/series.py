"""A transient on a contact network as a netCDF time series, and as a series of VTK files for ParaView."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.batch.provenance import command_line, engine_commit, engine_version, now, versions
from etc_engine.errors import InputError, OutputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.results.vtk import SPOKES, vtk_cells
from etc_engine.transient.run import Transient
from etc_engine.walls import WALLS

if TYPE_CHECKING:
    import xarray


def series_dataset(transient: Transient, text: str = "") -> xarray.Dataset:
    """Dataset of a transient.

    Parameters
    ----------
    transient : Transient
    text : str
        Of the study file.

    Returns
    -------
    xarray.Dataset
        Dimensions ``time``, ``particle`` and ``wall``; everything per unit thickness. ``stored_heat`` is the sum of
        ``wall_heat`` and ``source_heat``; ``heat_imbalance`` is what is left of that.
    """
    import xarray

    states, system, packing = transient.states, transient.system, transient.network.packing
    rates = np.array([system.heat.rates(state.time, state.temperatures) for state in states])
    heat = np.array([state.heat for state in states])
    means = np.array([system.particle_temperatures(state.temperatures) for state in states])
    capacities = _particle_capacities(transient)
    stored = np.array([state.stored for state in states])
    steps, iterations = np.array([(state.steps, state.iterations) for state in states]).T
    data = {
        "x": ("particle", packing.centers[:, 0], "m", "centre"),
        "y": ("particle", packing.centers[:, 1], "m", "centre"),
        "radius": ("particle", packing.radii, "m", "radius"),
        "heat_capacity": ("particle", capacities, "J m-1 K-1", "heat capacity of the particle per unit thickness"),
        "temperature": (("time", "particle"), means, "K", "mean temperature of the particle"),
        "mean_temperature": ("time", means @ capacities / capacities.sum(), "K", "mean temperature, by heat capacity"),
        "wall_heat_flow": (("time", "wall"), rates[:, :-1], "W m-1", "heat flow from the wall into the particles"),
        "wall_heat": (("time", "wall"), heat[:, :-1], "J m-1", "heat from the wall since the start"),
        "source_heat_flow": ("time", rates[:, -1], "W m-1", "heat flow of the sources"),
        "source_heat": ("time", heat[:, -1], "J m-1", "heat of the sources since the start"),
        "stored_heat": ("time", stored, "J m-1", "heat stored in the particles since the start"),
        "heat_imbalance": ("time", stored - heat.sum(axis=1), "J m-1", "heat stored less heat that came in"),
        "steps": ("time", steps, "1", "steps since the start"),
        "iterations": (
            "time",
            iterations,
            "1",
            "solver iterations since the start",
        ),
    }
    variables = {
        name: (dims, values, {"units": units, "long_name": meaning})
        for name, (dims, values, units, meaning) in data.items()
    }
    study = transient.study
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", np.array([s.time for s in states]), {"units": "s", "long_name": "time", "axis": "T"}),
            "wall": ("wall", list(WALLS[: rates.shape[1] - 1]), {"long_name": "wall of the box"}),
        },
        attrs={
            "Conventions": "CF-1.11",
            "title": f"{study.name}: transient heat conduction through a contact network",
            "source": f"etc_engine {engine_version()}, method {study.conduction.method}",
            "history": f"{now()} {command_line()}",
            "command": command_line(),
            "commit": engine_commit(),
            "versions": json.dumps(versions()),
            "study": text,
            "study_resolved": json.dumps(study.resolved()),
            "study_digest": study.digest(),
            "method": study.conduction.method,
            "scheme": study.time.scheme,
            "box": list(packing.box.lengths),
            "periodic": packing.box.periodic_axes,
            "contacts": transient.network.count,
            "wall_contacts": int(transient.network.walls.size),
        },
    )


def _particle_capacities(transient: Transient) -> NDArray[np.float64]:
    """Heat capacity of each particle: what its temperature adds up, one kelvin at a time, whatever its states."""
    system, n = transient.system, transient.network.packing.count
    rows = system.heat.capacity[system.heat.capacity > 0.0]
    return np.asarray(rows.reshape(n, -1).sum(axis=1))


def write_vtk_series(path: Path, packing: ParticlePacking, series: xarray.Dataset) -> None:
    """Write a ``.pvd`` collection, and beside it a folder of ``.vtp`` files, one an output time.

    Polygons of the particles; cell data ``temperature`` and ``particle``.

    Parameters
    ----------
    path : Path
        Ends in ``.pvd``; the files go into the folder of that name without the ending.
    packing : ParticlePacking
    series : xarray.Dataset
        From `series_dataset`.

    Raises
    ------
    InputError
        If the name does not end in ``.pvd`` or the library ``vtk`` is missing.
    OutputError
        If a file cannot be written.
    """
    if path.suffix != ".pvd":
        raise InputError(f"a VTK series is written to a .pvd file, found {path.name!r}")
    try:
        from vtkmodules.util import numpy_support
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter
    except ImportError:
        raise InputError(
            "writing VTK files needs the library vtk: install the extra with pip install 'etc-engine[vtk]'"
        ) from None
    to_vtk: Any = numpy_support.numpy_to_vtk
    turn = 2.0 * np.pi * np.arange(SPOKES) / SPOKES
    rim = np.stack([np.cos(turn), np.sin(turn), np.zeros(SPOKES)], axis=1)
    centers = np.column_stack([packing.centers, np.zeros(packing.count)])
    data, places = vtkPolyData(), vtkPoints()
    places.SetData(to_vtk((centers[:, None] + packing.radii[:, None, None] * rim).reshape(-1, 3).copy(), deep=True))
    data.SetPoints(places)
    data.SetPolys(vtk_cells([np.arange(packing.count * SPOKES).reshape(-1, SPOKES)]))
    folder = path.with_suffix("")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from None
    entries = []
    for k, time in enumerate(series["time"].values):
        values = {"temperature": series["temperature"].values[k], "particle": np.arange(packing.count)}
        for name, column in values.items():
            array = to_vtk(np.ascontiguousarray(column), deep=True)
            array.SetName(name)
            data.GetCellData().RemoveArray(name)
            data.GetCellData().AddArray(array)
        data.GetCellData().SetActiveScalars("temperature")
        file = folder / f"{folder.name}-{k:05d}.vtp"
        writer = vtkXMLPolyDataWriter()
        writer.SetFileName(str(file))
        writer.SetInputData(data)
        if not writer.Write():
            raise OutputError(f"cannot write {file}")
        entries.append(f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{folder.name}/{file.name}"/>')
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>", *entries]
    path.write_text("\n".join([*lines, "  </Collection>", "</VTKFile>", ""]))
