"""Packings as VTK PolyData (.vtp): a point for each particle with its radius, to be drawn as glyphs in ParaView."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from etc_engine.box import AXES, Box, parse_periodic
from etc_engine.errors import InputError, OutputError
from etc_engine.particle_files.columns import find_layout
from etc_engine.particle_files.digits import EXACT, SINGLE, Digits, PrintedColumn, PrintedColumns
from etc_engine.particle_files.sample import Rows, Sample, make_table
from etc_engine.particle_files.streams import read_opening
from etc_engine.particle_files.table import ParticleTable

LEGACY = b"# vtk DataFile"
XML = (b"<?xml", b"<VTKFile")


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


def read_vtp(path: Path | str, sample: Sample | None = None) -> ParticleTable:
    """Particles from a VTK file: ``.vtp`` of this engine or of others, ``.vtu``, or the legacy format.

    Raises
    ------
    InputError, GeometryError
        If the library ``vtk`` is missing, or the file is missing or holds something else.
    """
    chosen = sample or Sample()
    return make_table(vtk_rows(Path(path), chosen), chosen)


def vtk_rows(path: Path, sample: Sample) -> Rows:
    """Rows of a VTK file: its points, and their data ``radius``.

    Raises
    ------
    InputError

    Notes
    -----
    Files of this engine hold the box; files of others do not, and often hold points in single precision, which
    counts as a printed step of 1.2e-7 of each coordinate.
    """
    data = _points(path)
    arrays = _library()[3]
    places = data.GetPoints().GetData()
    numbers = data.GetPointData().GetNumberOfArrays()
    held = [data.GetPointData().GetAbstractArray(k) for k in range(numbers)]
    columns = {array.GetName(): array for array in held if array is not None and array.GetNumberOfComponents() == 1}
    layout = find_layout(str(path), [*AXES, *map(str, columns)], sample.radius_column)
    names = [*AXES, *columns]
    radius = columns[names[layout.radius]]
    found = {key: columns[names[column]] for key, column in layout.others.items()}
    bounds, periodic = _own_box(data, arrays)
    half = 0.5 if layout.halved else 1.0
    return Rows(
        place=str(path),
        positions=arrays.vtk_to_numpy(places).astype(np.float64)[:, : 3 if bounds is None else len(bounds)],
        radii=half * arrays.vtk_to_numpy(radius).astype(np.float64),
        bounds=bounds,
        periodic=periodic,
        planar=None if bounds is None else len(bounds) == 2,
        printed=_single(places, radius),
        **{key: _values(key, array, arrays) for key, array in found.items()},
    )


def _points(path: Path) -> Any:
    """The data set of points of a file in XML or the legacy format."""
    core, _, files, _ = _library()
    if not path.is_file():
        raise InputError(f"there is no file {path}")
    opening = read_opening(path)
    if opening.startswith(LEGACY):
        reader = import_module("vtkmodules.vtkIOLegacy").vtkGenericDataObjectReader()
        reader.ReadAllScalarsOn()
        reader.ReadAllFieldsOn()
    elif b"UnstructuredGrid" in opening:
        reader = files.vtkXMLUnstructuredGridReader()
    else:
        reader = files.vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    with _silent(core):
        reader.Update()
        data = reader.GetOutput()
    points = data.GetPoints() if data is not None and hasattr(data, "GetPoints") else None
    if reader.GetErrorCode() or points is None or not points.GetNumberOfPoints():
        raise InputError(f"{path} cannot be read as VTK points (PolyData or UnstructuredGrid), or has no points")
    return data


def _own_box(data: Any, arrays: Any) -> tuple[Any, tuple[bool, ...] | None]:
    """Faces of the box and its periodic axes, where this engine wrote the file."""
    lengths, word = (data.GetFieldData().GetAbstractArray(name) for name in ("box", "periodic"))
    if lengths is None or word is None:
        return None, None
    edges = arrays.vtk_to_numpy(lengths)
    box = Box(tuple(edges.tolist()), parse_periodic(str(word.GetValue(0)), len(edges)))
    return np.stack([np.zeros(box.dimension), np.array(box.lengths)], axis=1), box.periodic


def _single(places: Any, radius: Any) -> PrintedColumns | None:
    """Steps of numbers in single precision."""
    if places.GetDataTypeSize() != 4 and radius.GetDataTypeSize() != 4:
        return None
    digits = {4: Digits(0, 0, SINGLE)}
    exact = Digits(EXACT, EXACT)
    point = PrintedColumn(digits.get(places.GetDataTypeSize(), exact))
    return PrintedColumns(
        (point,) * 3, PrintedColumn(digits.get(radius.GetDataTypeSize(), exact)), "write points in double precision"
    )


def _values(key: str, array: Any, arrays: Any) -> Any:
    """A column of point data, as its key wants it."""
    if key == "types":
        return np.array([str(array.GetVariantValue(k).ToString()) for k in range(array.GetNumberOfValues())])
    return arrays.vtk_to_numpy(array).astype(np.int64 if key == "ids" else np.float64)


def require_vtk() -> None:
    """Refuse to go on where the library ``vtk`` is missing.

    Raises
    ------
    InputError
    """
    if find_spec("vtkmodules") is None:
        raise InputError(
            "VTK files need the library vtk: install it with pip install '.[vtk]' in the folder of etc_engine"
        )


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
    cutoff = core.vtkLogger.GetCurrentVerbosityCutoff()
    core.vtkObject.SetGlobalWarningDisplay(0)
    core.vtkLogger.SetStderrVerbosity(core.vtkLogger.VERBOSITY_OFF)
    try:
        yield
    finally:
        core.vtkObject.SetGlobalWarningDisplay(shown)
        core.vtkLogger.SetStderrVerbosity(core.vtkLogger.ConvertToVerbosity(int(cutoff)))
