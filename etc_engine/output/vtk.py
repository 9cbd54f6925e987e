"""VTK PolyData of a single solve, for ParaView: disks with their inner temperature, contacts with their heat flow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError, OutputError
from etc_engine.medium.field import ParticleField
from etc_engine.output.sphere_vtk import write_sphere_vtp

RINGS, SPOKES = 6, 36
"""A disk is drawn as this many rings of quadrilaterals, finer towards its boundary, around a fan."""
DETAILED = 20_000
"""Above this many particles, and where nothing is known inside them, each is one polygon of its mean temperature."""


def write_vtp(path: Path, field: ParticleField) -> None:
    """Write a ``.vtp`` file: polygons of the particles, lines of the contacts.

    Point data ``temperature``; cell data ``particle`` (-1 on lines), ``mean_temperature`` and ``heat_flow`` (0 on
    polygons, from the first to the second particle on lines).

    Raises
    ------
    InputError
        If the name does not end in ``.vtp`` or the library ``vtk`` is missing.
    OutputError
        If the file cannot be written.
    """
    if path.suffix != ".vtp":
        raise InputError(f"VTK PolyData is written to a .vtp file, found {path.name!r}")
    try:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData
        from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter
    except ImportError:
        raise InputError(
            "writing VTK files needs the library vtk: install it with pip install '.[vtk]' in the folder of etc_engine"
        ) from None
    if field.medium.dimension == 3:
        write_sphere_vtp(path, field)
        return
    points, temperature, polygons, owner = _disks(field)
    lines, flow = _contacts(field)
    ends = np.concatenate([points, lines.reshape(-1, 2)])
    mean = np.concatenate([np.full(len(flow), np.nan), field.particle_temperatures[owner]])
    data = vtkPolyData()
    places = vtkPoints()
    places.SetData(numpy_to_vtk(np.column_stack([ends, np.zeros(len(ends))]), deep=True))
    data.SetPoints(places)
    data.SetLines(vtk_cells([len(points) + np.arange(2 * len(flow)).reshape(-1, 2)]))
    data.SetPolys(vtk_cells(polygons))
    pad = np.full(2 * len(flow), np.nan)
    for name, values, place in (
        ("temperature", np.concatenate([temperature, pad]), data.GetPointData()),
        ("particle", np.concatenate([np.full(len(flow), -1), owner]), data.GetCellData()),
        ("mean_temperature", mean, data.GetCellData()),
        ("heat_flow", np.concatenate([flow, np.zeros(len(owner))]), data.GetCellData()),
    ):
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        place.AddArray(array)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    if not writer.Write():
        raise OutputError(f"cannot write {path}")


def vtk_cells(groups: list[Ints]) -> Any:
    """Cells of VTK out of lists of point numbers, each list of one width."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    offsets = np.concatenate([[0], *[np.full(len(g), g.shape[1]) for g in groups]]).cumsum()
    cells = vtkCellArray()
    cells.SetData(
        numpy_to_vtkIdTypeArray(offsets.astype(np.int64), deep=True),
        numpy_to_vtkIdTypeArray(np.concatenate([g.ravel() for g in groups]).astype(np.int64), deep=True),
    )
    return cells


def _disks(
    field: ParticleField,
) -> tuple[Floats, Floats, list[Ints], Ints]:
    """Points, their temperatures, polygons as lists of point numbers by width, and the particle of each polygon."""
    packing = field.medium.packing
    turn = 2.0 * np.pi * np.arange(SPOKES) / SPOKES
    rim = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    if packing.count > DETAILED or field.inside is None:
        points = (packing.centers[:, None] + packing.radii[:, None, None] * rim).reshape(-1, 2)
        polygons = np.arange(len(points)).reshape(-1, SPOKES)
        return points, np.repeat(field.particle_temperatures, SPOKES), [polygons], np.arange(packing.count)
    depth = np.sin(0.5 * np.pi * np.arange(1, RINGS + 1) / RINGS)
    unit = np.concatenate([[[0.0, 0.0]], (depth[:, None, None] * rim).reshape(-1, 2)])
    ring = 1 + np.arange(SPOKES)
    ahead = 1 + (np.arange(SPOKES) + 1) % SPOKES
    fan = np.stack([np.zeros_like(ring), ring, ahead], axis=1)
    quads = [
        np.stack([ring, ring + SPOKES, ahead + SPOKES, ahead], axis=1) + inner * SPOKES for inner in range(RINGS - 1)
    ]
    base = np.arange(packing.count)[:, None, None] * len(unit)
    triangles = (fan + base).reshape(-1, 3)
    quadrilaterals = (np.concatenate(quads) + base).reshape(-1, 4)
    particle = np.repeat(np.arange(packing.count), len(unit))
    offsets = packing.radii[particle, None] * np.tile(unit, (packing.count, 1))
    temperature = field.inside(particle, offsets)
    owner = np.concatenate(
        [np.repeat(np.arange(packing.count), SPOKES), np.repeat(np.arange(packing.count), SPOKES * (RINGS - 1))]
    )
    return packing.centers[particle] + offsets, temperature, [triangles, quadrilaterals], owner


def _contacts(field: ParticleField) -> tuple[Floats, Floats]:
    """Ends of the line of each contact, centre to centre, shape (m, 2, 2), and its heat flow."""
    network = field.medium.links
    start = network.packing.centers[network.pairs[:, 0]]
    return np.stack([start, start + network.branches], axis=1), field.contact_flows
