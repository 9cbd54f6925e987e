"""VTK PolyData of a solve of spheres: their surfaces with the temperature on them, and tubes of heat flow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import OutputError
from etc_engine.medium.field import ParticleField

DETAILED = 3_000
"""Above this many spheres each is a point of its mean temperature, to be drawn as a glyph of its radius."""


def write_sphere_vtp(path: Path, field: ParticleField) -> None:
    """Write spheres and contacts to a ``.vtp`` file.

    Point data ``temperature`` (NaN on the ends of lines) and ``radius`` [m]; cell data ``particle`` (-1 on lines),
    ``mean_temperature`` and ``heat_flow`` [W] (0 on spheres; on lines from the first to the second sphere, in ParaView
    a tube with the heat flow as its radius).

    Parameters
    ----------
    path : path
    field : ParticleField

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    data = vtkPolyData()
    points, temperatures, cells, owner = _surfaces(field)
    lines, flow = _lines(field)
    radii = field.medium.packing.radii
    of_points = np.repeat(np.arange(radii.size), len(points) // radii.size)
    places = vtkPoints()
    places.SetData(numpy_to_vtk(np.concatenate([points, lines.reshape(-1, 3)]), deep=True))
    data.SetPoints(places)
    ends = len(points) + np.arange(2 * len(flow)).reshape(-1, 2)
    surfaces = _cells(cells)
    if cells.shape[1] == 1:
        data.SetVerts(surfaces)
    else:
        data.SetPolys(surfaces)
    data.SetLines(_cells(ends))
    on_lines = np.full(len(flow), np.nan)
    mean = field.particle_temperatures[owner]
    none = np.full(2 * len(flow), np.nan)
    first = cells.shape[1] == 1  # VTK counts vertices, then lines, then polygons
    parts: list[tuple[str, NDArray[Any], Any]] = [
        ("temperature", np.concatenate([temperatures, none]), data.GetPointData()),
        ("radius", np.concatenate([radii[of_points], np.zeros(2 * len(flow))]), data.GetPointData()),
    ]
    for name, on_sphere, on_line in (
        ("particle", owner, np.full(len(flow), -1)),
        ("mean_temperature", mean, on_lines),
        ("heat_flow", np.zeros(len(owner)), flow),
    ):
        parts.append(
            (name, np.concatenate([on_sphere, on_line] if first else [on_line, on_sphere]), data.GetCellData())
        )
    for name, values, place in parts:
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        place.AddArray(array)
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    if not writer.Write():
        raise OutputError(f"cannot write {path}")


def _cells(rows: Ints) -> Any:
    """Cells of one width out of rows of point numbers."""
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray as ids
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    cells = vtkCellArray()
    offsets = rows.shape[1] * np.arange(len(rows) + 1)
    cells.SetData(ids(offsets.astype(np.int64), deep=True), ids(rows.ravel().astype(np.int64), deep=True))
    return cells


def _surfaces(
    field: ParticleField,
) -> tuple[Floats, Floats, Ints, Ints]:
    """Points, their temperatures, cells as rows of point numbers, and the sphere of each cell."""
    packing = field.medium.packing
    everyone = np.arange(packing.count)
    if packing.count > DETAILED or field.inside is None:
        return packing.centers, field.particle_temperatures, everyone[:, None], everyone
    unit, triangles = unit_sphere()
    relative = packing.radii[:, None, None] * unit
    points = (packing.centers[:, None] + relative).reshape(-1, 3)
    owner = np.repeat(everyone, len(unit))
    cells = (triangles + len(unit) * everyone[:, None, None]).reshape(-1, 3)
    temperatures = field.inside(owner, relative.reshape(-1, 3))
    return points, temperatures, cells, np.repeat(everyone, len(triangles))


def _lines(field: ParticleField) -> tuple[Floats, Floats]:
    """Ends of the line of each contact, centre to centre, shape (m, 2, 3), and its heat flow."""
    network = field.medium.links
    start = network.packing.centers[network.pairs[:, 0]]
    return np.stack([start, start + network.branches], axis=1), field.contact_flows


def unit_sphere(halvings: int = 2) -> tuple[Floats, Ints]:
    """Points and triangles of an octahedron whose edges are halved and pushed out to the unit sphere.

    Examples
    --------
    >>> points, triangles = unit_sphere()
    >>> points.shape, triangles.shape
    ((66, 3), (128, 3))
    """
    points = [np.array(p, dtype=np.float64) for p in np.concatenate([np.eye(3), -np.eye(3)])]
    triangles = [(0, 1, 2), (1, 3, 2), (3, 4, 2), (4, 0, 2), (1, 0, 5), (3, 1, 5), (4, 3, 5), (0, 4, 5)]
    for _ in range(halvings):
        known: dict[tuple[int, int], int] = {}
        finer = []
        for corners in triangles:
            middles = []
            for a, b in zip(corners, (*corners[1:], corners[0]), strict=True):
                key = (min(a, b), max(a, b))
                if key not in known:
                    known[key] = len(points)
                    middle = points[a] + points[b]
                    points.append(middle / np.linalg.norm(middle))
                middles.append(known[key])
            (a, b, c), (ab, bc, ca) = corners, middles
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return np.array(points), np.array(triangles, dtype=np.int64)
