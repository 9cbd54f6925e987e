"""A transient on a contact network as a netCDF time series, and as a series of VTK files for ParaView."""

from __future__ import annotations

import json
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES
from etc_engine.durable.provenance import command_line, engine_commit, engine_version, now, versions
from etc_engine.errors import InputError, OutputError
from etc_engine.medium.walls import WALLS
from etc_engine.output.vtk import SPOKES, vtk_cells
from etc_engine.transient.moving import MovingState
from etc_engine.transient.run import Transient

if TYPE_CHECKING:
    import xarray

UNITS = {2: ("W m-1", "J m-1", "J m-1 K-1"), 3: ("W", "J", "J K-1")}
"""Of heat flows, heats and heat capacities, by dimension; in 2D per unit thickness."""


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
        Dimensions ``time``, ``particle`` and ``wall``; of disks all per unit thickness. ``stored_heat`` is the sum of
        ``wall_heat`` and ``source_heat``; ``heat_imbalance`` is what is left of that. Of moving particles, centres and
        radii have the dimension ``time`` too, and ``particle`` holds the ids of the dump.
    """
    import xarray

    states, packing = transient.states, transient.network.packing
    rates, means = _rates_and_means(transient)
    heat = np.array([state.heat for state in states])
    capacities = particle_capacities(transient)
    stored = np.array([state.stored for state in states])
    steps, iterations = np.array([(state.steps, state.iterations) for state in states]).T
    where, centers, radii = _places(transient)
    flow, energy, capacity = UNITS[packing.dimension]
    data = {name: (where, centers[..., axis], "m", "centre") for axis, name in enumerate(AXES[: packing.dimension])}
    data |= {
        "radius": (where, radii, "m", "radius"),
        "heat_capacity": ("particle", capacities, capacity, "heat capacity of the particle"),
        "temperature": (("time", "particle"), means, "K", "mean temperature of the particle"),
        "mean_temperature": ("time", means @ capacities / capacities.sum(), "K", "mean temperature, by heat capacity"),
        "wall_heat_flow": (("time", "wall"), rates[:, :-1], flow, "heat flow from the wall into the particles"),
        "wall_heat": (("time", "wall"), heat[:, :-1], energy, "heat from the wall since the start"),
        "source_heat_flow": ("time", rates[:, -1], flow, "heat flow of the sources"),
        "source_heat": ("time", heat[:, -1], energy, "heat of the sources since the start"),
        "stored_heat": ("time", stored, energy, "heat stored in the particles since the start"),
        "heat_imbalance": ("time", stored - heat.sum(axis=1), energy, "heat stored less heat that came in"),
        "steps": ("time", steps, "1", "steps since the start"),
        "iterations": (
            "time",
            iterations,
            "1",
            "solver iterations since the start",
        ),
    }
    data |= _changes(transient)
    variables = {
        name: (dims, values, {"units": units, "long_name": meaning})
        for name, (dims, values, units, meaning) in data.items()
    }
    return xarray.Dataset(
        variables,
        coords={
            "time": ("time", np.array([s.time for s in states]), {"units": "s", "long_name": "time", "axis": "T"}),
            "wall": ("wall", list(WALLS[: rates.shape[1] - 1]), {"long_name": "wall of the box"}),
            **_ids(transient),
        },
        attrs=_attributes(transient, text),
    )


def _attributes(transient: Transient, text: str) -> dict[str, Any]:
    """Global attributes: where the series comes from."""
    study, box = transient.study, transient.network.packing.box
    return {
        "Conventions": "CF-1.11",
        "title": f"{study.name}: transient heat conduction through a contact network",
        "source": f"etc_engine {engine_version()}, engine {study.conduction.engine}",
        "history": f"{now()} {command_line()}",
        "command": command_line(),
        "commit": engine_commit(),
        "versions": json.dumps(versions()),
        "study": text,
        "study_resolved": json.dumps(study.resolved()),
        "study_digest": study.digest(),
        "engine": study.conduction.engine,
        "method": study.conduction.method_for(box.dimension, study.pores_conduct),
        "scheme": study.time.scheme,
        "box": list(box.lengths),
        "periodic": box.periodic_axes,
        "contacts": transient.network.count,
        "wall_contacts": int(transient.network.walls.size),
    }


def _rates_and_means(transient: Transient) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heat flows and mean temperatures at the output times."""
    system = transient.system
    rates, means = [], []
    for state in transient.states:
        if isinstance(state, MovingState):
            rates.append(state.rates)
            means.append(state.temperatures)
        else:
            rates.append(system.heat.rates(state.time, state.temperatures))
            means.append(system.particle_temperatures(state.temperatures))
    return np.array(rates), np.array(means)


def _ids(transient: Transient) -> dict[str, Any]:
    """The ids of the particles as a coordinate, where their file has them."""
    ids = transient.tables[0].ids if transient.tables else None
    if ids is None or np.unique(ids).size != ids.size:
        return {}
    return {"particle": ("particle", ids, {"long_name": "id of the particle in its file"})}


def _places(transient: Transient) -> tuple[Any, NDArray[np.float64], NDArray[np.float64]]:
    """Dimensions, centres and radii of the particles."""
    packing = transient.network.packing
    if transient.trajectory is None:
        return "particle", packing.centers, packing.radii
    radii = [state.radii for state in transient.states if isinstance(state, MovingState)]
    centers = [packing.centers for packing in transient.trajectory.packings[: len(radii)]]
    return ("time", "particle"), np.array(centers), np.array(radii)


def _changes(transient: Transient) -> dict[str, tuple[Any, Any, str, str]]:
    """What moving particles do to their contacts."""
    states = [state for state in transient.states if isinstance(state, MovingState)]
    if transient.trajectory is None or not states:
        return {}
    return {
        "id": ("particle", transient.trajectory.ids, "1", "id of the particle in the dump"),
        "particle_contacts": (
            "time",
            [state.contacts for state in states],
            "1",
            "contacts between particles from here on",
        ),
        "opened_contacts": ("time", [state.opened for state in states], "1", "pairs that parted since the time before"),
        "closed_contacts": ("time", [state.closed for state in states], "1", "pairs that met since the time before"),
    }


def particle_capacities(transient: Transient) -> NDArray[np.float64]:
    """Heat capacity of each particle, shape (n,) [J/K, in 2D J/(m K)]; of moving ones that of the whole particle."""
    if transient.trajectory is not None:
        rho_c = np.asarray(transient.study.particles.heat_capacity, dtype=np.float64)
        return np.asarray(transient.network.packing.measures * rho_c)
    return transient.system.capacities


def check_vtk_series(path: Path, *, overwrite: bool = False) -> None:
    """Refuse a place of a VTK series that is not named so, or that holds frames of another one.

    Raises
    ------
    InputError
        If the name does not end in ``.pvd``.
    OutputError
        If the folder of the frames holds ``.vtp`` files already and is not to be overwritten.
    """
    if path.suffix != ".pvd":
        raise InputError(f"a VTK series is written to a .pvd file, found {str(path)!r}")
    folder = path.with_suffix("")
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"cannot write {path}: {folder}, the folder of its frames, is a file")
    if not overwrite and any(folder.glob("*.vtp")):
        raise OutputError(f"{folder} holds .vtp files already: choose another name, or give --overwrite")


def write_vtk_series(path: Path, series: xarray.Dataset) -> None:
    """Write a ``.pvd`` collection, and beside it a folder of ``.vtp`` files, one an output time.

    Polygons of disks, points of spheres with point data ``radius``; cell data ``temperature`` and ``particle``.

    Parameters
    ----------
    path : Path
        Ends in ``.pvd``; the files go into the folder of that name without the ending, in place of former frames.
    series : xarray.Dataset
        From `series_dataset`.

    Raises
    ------
    InputError
        If the name does not end in ``.pvd`` or the library ``vtk`` is missing.
    OutputError
        If a file cannot be written.
    """
    check_vtk_series(path, overwrite=True)
    try:
        from vtkmodules.util import numpy_support
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter
    except ImportError:
        raise InputError(
            "writing VTK files needs the library vtk: install it with pip install '.[vtk]' in the folder of etc_engine"
        ) from None
    to_vtk: Any = numpy_support.numpy_to_vtk
    count, spheres = series.sizes["particle"], "z" in series
    turn = 2.0 * np.pi * np.arange(SPOKES) / SPOKES
    rim = np.zeros((1, 3)) if spheres else np.stack([np.cos(turn), np.sin(turn), np.zeros(SPOKES)], axis=1)
    data = vtkPolyData()
    cells = vtk_cells([np.arange(count * len(rim)).reshape(-1, len(rim))])
    (data.SetVerts if spheres else data.SetPolys)(cells)
    folder = path.with_suffix("")
    try:
        folder.mkdir(exist_ok=True)
        for former in folder.glob(f"{escape(folder.name)}-[0-9][0-9][0-9][0-9][0-9].vtp"):
            former.unlink()
    except OSError as error:
        raise OutputError(f"cannot write {folder}: {error.strerror}") from None
    entries = []
    for k, time in enumerate(series["time"].values):
        place = series.isel(time=k)
        centers = np.column_stack([place["x"], place["y"], place["z"] if spheres else np.zeros(count)])
        points = vtkPoints()
        points.SetData(
            to_vtk((centers[:, None] + place["radius"].values[:, None, None] * rim).reshape(-1, 3), deep=True)
        )
        data.SetPoints(points)
        values = {"temperature": place["temperature"].values, "particle": np.arange(count)}
        for name, column in values.items():
            array = to_vtk(np.ascontiguousarray(column), deep=True)
            array.SetName(name)
            data.GetCellData().RemoveArray(name)
            data.GetCellData().AddArray(array)
        data.GetCellData().SetActiveScalars("temperature")
        if spheres:
            radii = to_vtk(np.ascontiguousarray(place["radius"].values), deep=True)
            radii.SetName("radius")
            data.GetPointData().AddArray(radii)
        file = folder / f"{folder.name}-{k:05d}.vtp"
        writer = vtkXMLPolyDataWriter()
        writer.SetFileName(str(file))
        writer.SetInputData(data)
        if not writer.Write():
            raise OutputError(f"cannot write {file}")
        entries.append(f'    <DataSet timestep="{float(time)!r}" group="" part="0" file="{folder.name}/{file.name}"/>')
    lines = ['<?xml version="1.0"?>', '<VTKFile type="Collection" version="0.1">', "  <Collection>", *entries]
    path.write_text("\n".join([*lines, "  </Collection>", "</VTKFile>", ""]))
