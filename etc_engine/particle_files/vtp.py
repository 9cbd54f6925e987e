"""Packings as VTK PolyData (.vtp): a point for each particle with its radius, to be drawn as glyphs in ParaView."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from etc_engine.box import Box, parse_periodic
from etc_engine.errors import InputError, OutputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.csv_files import ParticleTable


def write_vtp(path: Path | str, table: ParticleTable) -> None:
    """Write particles as VTK PolyData, bit for bit.

    Points are the centres (z = 0 in two dimensions); point data ``radius`` and, where given, ``conductivity``;
    field data ``box`` (edge lengths) and ``periodic`` (a word).

    Raises
    ------
    InputError
        If the library ``vtk`` is missing.
    OutputError
        If the file cannot be written.
    """
    core, model, files, arrays = _library()
    packing = table.packing
    places = np.zeros((packing.count, 3))
    places[:, : packing.dimension] = packing.centers
    points, vertices, data = core.vtkPoints(), model.vtkCellArray(), model.vtkPolyData()
    points.SetData(arrays.numpy_to_vtk(places, deep=True))
    vertices.SetData(  # a vertex for each point: ParaView draws cells, not bare points
        arrays.numpy_to_vtkIdTypeArray(np.arange(packing.count + 1), deep=True),
        arrays.numpy_to_vtkIdTypeArray(np.arange(packing.count), deep=True),
    )
    data.SetPoints(points)
    data.SetVerts(vertices)
    columns = {"radius": packing.radii, "conductivity": table.conductivity}
    for name, values in columns.items():
        if values is not None:
            _add(data.GetPointData(), name, arrays.numpy_to_vtk(np.ascontiguousarray(values), deep=True))
    _add(data.GetFieldData(), "box", arrays.numpy_to_vtk(np.array(packing.box.lengths), deep=True))
    word = core.vtkStringArray()
    word.InsertNextValue(packing.box.periodic_axes)
    _add(data.GetFieldData(), "periodic", word)
    writer = files.vtkXMLPolyDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(data)
    with _silent(core):
        if not writer.Write():
            raise OutputError(f"cannot write {path}")


def read_vtp(path: Path | str) -> ParticleTable:
    """Particles from a ``.vtp`` file as :func:`write_vtp` lays it out.

    Raises
    ------
    InputError, GeometryError
        If the library ``vtk`` is missing, or the file is missing or holds something else.
    """
    path = Path(path)
    core, _, files, arrays = _library()
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    reader = files.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    with _silent(core):
        reader.Update()
    data = reader.GetOutput()
    if reader.GetErrorCode() or not data.GetNumberOfPoints():
        raise InputError(f"{path} cannot be read as VTK PolyData, or has no points")
    radius, conductivity = (data.GetPointData().GetArray(name) for name in ("radius", "conductivity"))
    lengths, word = (data.GetFieldData().GetAbstractArray(name) for name in ("box", "periodic"))
    if radius is None or lengths is None or word is None:
        raise InputError(
            f"{path} holds no packing: point data 'radius' and field data 'box' and 'periodic' are needed, "
            "as 'etc-engine pack -o packing.vtp' writes them"
        )
    edges = tuple(arrays.vtk_to_numpy(lengths).tolist())
    box = Box(edges, parse_periodic(word.GetValue(0), len(edges)))
    centers = arrays.vtk_to_numpy(data.GetPoints().GetData())[:, : box.dimension]
    packing = ParticlePacking(centers, arrays.vtk_to_numpy(radius), box)
    return ParticleTable(packing, None if conductivity is None else np.array(arrays.vtk_to_numpy(conductivity)))


def require_vtk() -> None:
    """Refuse to go on where the library ``vtk`` is missing.

    Raises
    ------
    InputError
    """
    if find_spec("vtkmodules") is None:
        raise InputError("VTK files need the library vtk: install the extra with pip install 'etc-engine[vtk]'")


def _library() -> tuple[Any, Any, Any, Any]:
    """The modules of vtk for arrays, data sets, files, and numpy's views of arrays."""
    require_vtk()
    names = ("vtkCommonCore", "vtkCommonDataModel", "vtkIOXML", "util.numpy_support")
    core, model, files, arrays = (import_module(f"vtkmodules.{name}") for name in names)
    return core, model, files, arrays


def _add(place: Any, name: str, array: Any) -> None:
    array.SetName(name)
    place.AddArray(array)


@contextmanager
def _silent(core: Any) -> Iterator[None]:
    """Without vtk's own words on stderr: what goes wrong is raised."""
    shown = core.vtkObject.GetGlobalWarningDisplay()
    core.vtkObject.SetGlobalWarningDisplay(0)
    try:
        yield
    finally:
        core.vtkObject.SetGlobalWarningDisplay(shown)
