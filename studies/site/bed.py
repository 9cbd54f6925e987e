"""Draw the bed on the first page: poured Li2TiO3 pebbles in helium between a hot floor and a cold lid.

Run ``python studies/site/bed.py bed.png`` from the project's folder, with the extras ``vtk`` and ``gas``.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  # registers the renderer
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader
from vtkmodules.vtkRenderingAnnotation import vtkScalarBarActor
from vtkmodules.vtkRenderingCore import (
    vtkActor,
    vtkColorTransferFunction,
    vtkPolyDataMapper,
    vtkRenderer,
    vtkRenderWindow,
    vtkWindowToImageFilter,
)

BED = Path(__file__).parents[1] / "pebble_bed" / "beds" / "bed_0.dump"
SOLVE = (
    "--crop ,,0:0.0095 --axis z --rule hertz --simulated-modulus 1e8 --youngs-modulus 126e9 --poisson-ratio 0.24 "
    "--material Li2TiO3 --gas helium --pressure 1e5 --temperature 900 --accommodation 0.43 --emissivity 0.8"
)


def spheres_of(particles: Path, colours: vtkColorTransferFunction) -> vtkActor:
    """Return the spheres of the file, coloured by their temperature."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(particles))
    reader.Update()
    data = reader.GetOutput()
    data.GetPointData().SetActiveScalars("radius")
    ball = vtkSphereSource()
    ball.SetRadius(1.0)
    ball.SetThetaResolution(48)
    ball.SetPhiResolution(32)
    spheres = vtkGlyph3D()
    spheres.SetInputData(data)
    spheres.SetSourceConnection(ball.GetOutputPort())
    spheres.SetScaleModeToScaleByScalar()
    spheres.SetScaleFactor(1.0)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(spheres.GetOutputPort())
    mapper.SetScalarModeToUsePointFieldData()
    mapper.SelectColorArray("temperature")
    mapper.SetLookupTable(colours)
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetSpecular(0.25)
    actor.GetProperty().SetSpecularPower(20.0)
    return actor


def colour_bar(colours: vtkColorTransferFunction) -> vtkScalarBarActor:
    """Return the legend."""
    bar = vtkScalarBarActor()
    bar.SetLookupTable(colours)
    bar.SetTitle("T, scaled")
    bar.SetNumberOfLabels(3)
    bar.SetLabelFormat("%.1f")
    bar.UnconstrainedFontSizeOn()
    for text in (bar.GetTitleTextProperty(), bar.GetLabelTextProperty()):
        text.SetColor(0.1, 0.1, 0.1)
        text.SetFontSize(24)
        text.ShadowOff()
        text.ItalicOff()
        text.BoldOff()
    bar.SetPosition(0.85, 0.2)
    bar.SetWidth(0.11)
    bar.SetHeight(0.6)
    return bar


def draw(particles: Path, picture: str) -> None:
    """Render the file as a picture."""
    colours = vtkColorTransferFunction()
    for value, rgb in ((0.0, (0.10, 0.30, 0.62)), (0.5, (0.93, 0.91, 0.86)), (1.0, (0.76, 0.20, 0.13))):
        colours.AddRGBPoint(value, *rgb)
    renderer = vtkRenderer()
    renderer.SetBackground(1.0, 1.0, 1.0)
    renderer.AddActor(spheres_of(particles, colours))
    renderer.AddViewProp(colour_bar(colours))
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(960, 720)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetViewUp(0.0, 0.0, 1.0)
    camera.SetPosition(1.0, -2.2, 0.9)
    camera.SetFocalPoint(0.0, 0.0, 0.0)
    renderer.ResetCamera()
    camera.Zoom(1.28)
    window.Render()
    image = vtkWindowToImageFilter()
    image.SetInput(window)
    writer = vtkPNGWriter()
    writer.SetFileName(picture)
    writer.SetInputConnection(image.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        field = Path(folder) / "bed.vtp"
        subprocess.run(["etc-engine", "solve", str(BED), *SOLVE.split(), "--vtk", str(field)], check=True)
        draw(field, sys.argv[1])
