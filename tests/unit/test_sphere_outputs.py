"""Pictures and VTK surfaces of beds of spheres."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine import Box, Medium, ParticlePacking, effective_conductivity, field_along, overlap_contacts
from etc_engine.output.figures.field import save_field
from etc_engine.output.figures.spheres import draw_view, slice_axes, slice_place, slice_temperatures
from etc_engine.output.sphere_vtk import unit_sphere
from etc_engine.output.vtk import write_vtp


def array_of(periodic: bool, n: int = 3) -> ParticlePacking:
    centers = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5
    return ParticlePacking(centers, np.full(n**3, 0.52), Box((float(n),) * 3, (periodic,) * 3))


def field_of(packing: ParticlePacking, engine: str = "dtem", method: str = "chord"):
    medium = Medium(packing, 2.0, overlap_contacts(packing))
    result = effective_conductivity(medium, engine=engine, method=method)
    return field_along(medium, result, engine=engine, method=method, axis=2)


@pytest.mark.parametrize("method", ["chord", "standard", "exact"])
def test_temperatures_inside_meet_at_the_contacts(method):
    field = field_of(array_of(False), method=method)
    packing, network = field.medium.packing, field.medium.links
    first, second = network.pairs.T
    towards = 0.4999 * network.branches
    near = field.inside(first, towards), field.inside(second, -towards)
    assert near[0] == pytest.approx(near[1], abs=0.015)
    assert near[0] == pytest.approx(field.contact_temperatures, abs=0.015)
    centre = field.inside(np.arange(packing.count), np.zeros((packing.count, 3)))
    assert centre == pytest.approx(field.particle_temperatures, abs=1e-12)


@pytest.mark.parametrize("periodic", [False, True])
def test_the_slice_falls_along_the_load_and_is_empty_between_spheres(periodic):
    field = field_of(array_of(periodic))
    assert slice_axes(field.axis) == (0, 2, 1)
    image = slice_temperatures(field, 90, 1.5)
    assert image.shape == (90, 90)
    assert np.isnan(image[0, 0]) == (not periodic) or np.isnan(image[29:31, 29:31]).any()
    column = image[:, 15]
    assert np.isfinite(column).all()
    assert (np.diff(column) < 0.0).all() if not periodic else (np.diff(column) > 0.0).all()
    if periodic:  # a mean gradient of one
        assert column[75] - column[15] == pytest.approx(2.0, abs=1e-6)
    assert image[:, 15] == pytest.approx(image[:, 75], abs=1e-6)


@pytest.mark.parametrize("periodic", [False, True])
def test_the_slice_is_put_through_a_layer_and_not_between_two(periodic):
    """Two layers: the middle of the box, y = 1, is between them. Of three, the middle is in one."""
    two, three = array_of(periodic, 2), array_of(periodic, 3)
    assert abs(slice_place(two, 1) - 1.0) == pytest.approx(0.5, abs=0.011)
    assert slice_place(three, 1) == pytest.approx(1.5, abs=0.016)
    field = field_of(two)
    through, between = (np.isfinite(slice_temperatures(field, 60, y)).mean() for y in (slice_place(two, 1), 1.0))
    assert through > 0.7
    assert between < 0.2


def test_the_view_shows_the_sphere_in_front():
    two = ParticlePacking([[1.0, 1.0, 1.0], [1.5, 0.35, 1.35]], [0.4, 0.4], Box((3.0, 3.0, 3.0)))
    colours = np.array([[1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
    image, frame = draw_view(two, colours, 200)
    assert max(image.shape[:2]) == 201
    assert frame[0] < frame[1]
    assert frame[2] < frame[3]
    red = (image[..., 0] > image[..., 2]).sum()
    blue = (image[..., 2] > image[..., 0]).sum()
    assert blue > 1.5 * red > 0
    assert image[0, 0, 3] == 0.0


@pytest.mark.parametrize(("engine", "method"), [("dtem", "chord"), ("pipe", "holm")])
def test_picture_and_vtk_are_written_and_read_back(tmp_path, engine, method):
    field = field_of(array_of(False), engine, method)
    save_field(tmp_path / "bed.png", field, "bed")
    assert (tmp_path / "bed.png").stat().st_size > 20_000
    write_vtp(tmp_path / "bed.vtp", field)
    pytest.importorskip("vtkmodules")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "bed.vtp"))
    reader.Update()
    data = reader.GetOutput()
    count, contacts = field.medium.packing.count, field.medium.links.count
    of = {
        name: vtk_to_numpy(data.GetCellData().GetArray(name)) for name in ("particle", "heat_flow", "mean_temperature")
    }
    on_line = of["particle"] < 0
    assert on_line.sum() == contacts
    assert of["heat_flow"][on_line] == pytest.approx(field.contact_flows)
    assert of["mean_temperature"][~on_line] == pytest.approx(field.particle_temperatures[of["particle"][~on_line]])
    temperatures = vtk_to_numpy(data.GetPointData().GetArray("temperature"))
    known = temperatures[np.isfinite(temperatures)]
    assert known.size == count * (len(unit_sphere()[0]) if engine == "dtem" else 1)
    assert -1e-6 < known.min() < known.max() < 1.0 + 1e-6


def test_the_unit_sphere_is_closed_and_faces_outwards():
    points, triangles = unit_sphere(3)
    a, b, c = points[triangles[:, 0]], points[triangles[:, 1]], points[triangles[:, 2]]
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(4.0 / 3.0 * np.pi, rel=0.03)
    assert (np.einsum("ij,ij->i", a, np.cross(b, c)) > 0.0).all()
