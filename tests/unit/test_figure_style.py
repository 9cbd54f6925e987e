"""Pictures: models in words, nothing off the axis without an arrow, letters that can be read, one palette."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Annotation, Text

from etc_engine.box import Box
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.comparison.convergence import running_statistics, samples
from etc_engine.models import CATALOGUE
from etc_engine.output.figures import draw_comparison, draw_convergence, draw_histograms, draw_structure, png
from etc_engine.output.figures.canvas import (
    COLOURS,
    DOWN,
    DOWN_MARK,
    UP,
    UP_MARK,
    label_ends,
    legend,
    mark_outside,
    new_panels,
)
from etc_engine.packing.particles import ParticlePacking
from etc_engine.sweep.result_file import open_dataset

ROOT = Path(__file__).parents[2]
PEBBLES = ROOT / "studies" / "pebble_bed"
STUDY = """
schema = 2
name = "made"
seed = 20263
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.6, 0.65, 0.7, 0.75]
[contacts]
rule = "bonded"
contact_angle = 5.0
[pores]
conductivity = 0.1
[statistics]
realizations = 3
[models]
names = ["maxwell", "parallel"]
"""


def smallest_letters(figure: Figure, width: float = 600.0) -> float:
    """Size of the smallest letters in pixels where the figure is shown at a width in pixels."""
    png(figure)
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]
    return min(text.get_fontsize() for text in shown) / 72.0 * width / figure.get_figwidth()


def test_every_model_has_a_short_name_in_words():
    labels = [model.label for model in CATALOGUE.values()]
    assert len(set(labels)) == len(labels) == 38
    assert all(0 < len(label) <= 25 and "_" not in label for label in labels)


def test_a_model_off_the_axis_has_an_arrow_with_its_value(made_sweep):
    comparison = evaluate_models(made_sweep(STUDY, lambda f, *_: 0.1 + 0.1 * (f - 0.6)))
    lines = model_lines(comparison)
    figure = draw_comparison(comparison, lines)
    end = float(lines["model_conductivity"].sel(model="parallel").isel(density=-1))
    assert end > figure.axes[0].get_ylim()[1]
    labels = [child.get_text() for child in figure.axes[0].get_children() if isinstance(child, Annotation)]
    assert f"parallel {UP} {end:.3g}" in labels


def test_intervals_lie_inside_the_axis_or_have_an_arrow(made_sweep):
    text = STUDY.replace("[pores]\nconductivity = 0.1\n", "")
    wide = evaluate_models(made_sweep(text, lambda f, _a, _m, i: f * (0.01 if i else 1.0)))
    assert float(wide["conductivity_ci_low"].min()) < 0.0
    axes = draw_comparison(wide, model_lines(wide)).axes[0]
    assert axes.get_ylim()[0] <= float(wide["conductivity_ci_low"].min())
    decades = evaluate_models(made_sweep(text, lambda f, _a, _m, i: 10.0 ** (20.0 * (f - 0.8)) * (0.01 if i else 1.0)))
    axes = draw_comparison(decades, model_lines(decades)).axes[0]
    arrows = [line for line in axes.get_lines() if line.get_marker() == DOWN_MARK]
    assert axes.get_yscale() == "log"
    assert sum(len(line.get_xdata()) for line in arrows) == 4


def test_letters_of_the_readmes_pictures_can_be_read_at_600_pixels(made_sweep):
    assert imread(ROOT / "studies" / "site" / "bed.png").shape[1] == 960  # drawn with letters of 24 pixels
    assert 24 * 600 / 960 >= 9
    spec = importlib.util.spec_from_file_location("pebble_bed_analyse", PEBBLES / "analyse.py")
    study = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(study)
    comparison = evaluate_models(open_dataset(PEBBLES / "sweep.nc"), [study.MODEL]).isel(density=0)
    figure = study.draw(comparison, study.of_beds(str(PEBBLES / "poured.nc")))
    assert smallest_letters(figure) >= 9.0
    assert imread(PEBBLES / "figure.png").shape[1] == pytest.approx(200 * figure.get_figwidth(), abs=1)
    compared = evaluate_models(made_sweep(STUDY, lambda f, *_: 0.1 * f))
    assert smallest_letters(draw_comparison(compared, model_lines(compared))) >= 9.0


def test_the_page_has_the_palette_of_the_figures():
    script = (ROOT / "etc_engine" / "service" / "page" / "figure.js").read_text(encoding="utf-8")
    listed = re.findall(r"#[0-9a-f]{6}", next(line for line in script.splitlines() if line.startswith("const COLOURS")))
    assert len(listed) >= 6
    assert np.array_equal(listed, COLOURS[: len(listed)])


@pytest.mark.parametrize("columns", [1, 2, 3])
def test_letters_of_new_panels_can_be_read_at_600_pixels(columns):
    figure, panels = new_panels(2, columns)
    assert len(panels) == 2 * columns
    for axes in panels:
        axes.plot([0.0, 1.0], [0.0, 1.0], label="line")
        axes.set_xlabel("across")
        assert axes.get_lines()[0].get_color() == COLOURS[0]
    legend(panels[0])
    legend(figure, loc="outside upper center")
    assert smallest_letters(figure) >= 9.0


def test_points_outside_a_panel_have_arrows_at_its_edge():
    _, (axes,) = new_panels()
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 2.0))
    mark_outside(axes, [-0.5, 0.5, 0.9], [3.0, 1.0, -4.0], COLOURS[1])
    arrows = {line.get_marker(): line.get_xydata().tolist() for line in axes.get_lines()}
    assert arrows == {UP_MARK: [[0.0, 2.0]], DOWN_MARK: [[0.9, 0.0]]}
    assert (axes.get_xlim(), axes.get_ylim()) == ((0.0, 1.0), (0.0, 2.0))


def test_a_line_that_leaves_a_panel_before_its_end_has_its_farthest_value():
    _, (axes,) = new_panels()
    axes.set(xlim=(0.0, 1.0), ylim=(0.0, 2.0))
    x = [0.0, 0.5, 1.0]
    label_ends(axes, [("inside", x, [1.0, 1.0, 1.0]), ("dip", x, [-3.0, 0.5, 1.5]), ("end", x, [-9.0, 1.0, 2.5])])
    labels = [child.get_text() for child in axes.get_children() if isinstance(child, Annotation)]
    assert labels == ["inside", f"dip {DOWN} -3", f"end {UP} 2.5"]


SCRIPTS = sorted(path for path in (ROOT / "studies").glob("*/*.py") if path.parent.name != "site")


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_the_studies_draw_with_the_canvas_of_the_package_alone(path):
    text = path.read_text(encoding="utf-8")
    for other in ("pyplot", "savefig", " Figure(", '"tab:', '="C0"', 'f"C{'):
        assert other not in text, other
    assert not re.findall(r"""["']#[0-9a-f]{6}["']""", text)


def test_a_comparison_of_several_panels_can_be_read_at_600_pixels(made_sweep):
    text = STUDY.replace("conductivity = 0.1", "conductivity = [0.01, 0.1, 0.2]")
    comparison = evaluate_models(made_sweep(text, lambda f, *_: 0.3 * f))
    figure = draw_comparison(comparison, model_lines(comparison))
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 3
    assert smallest_letters(figure) >= 9.0
    assert min(axes.get_window_extent().width for axes in shown) > 0.6 * figure.bbox.width


@pytest.mark.parametrize("dimension", [2, 3])
def test_letters_of_a_structure_and_of_a_report_can_be_read_at_600_pixels(dimension, made_sweep):
    edge = 4
    grid = np.stack(np.meshgrid(*[np.arange(edge)] * dimension), axis=-1).reshape(-1, dimension) + 0.5
    packing = ParticlePacking(grid, np.linspace(0.45, 0.5, len(grid)), Box((edge,) * dimension, (True,) * dimension))
    assert smallest_letters(draw_structure(packing, 0.1)) >= 9.0
    made = made_sweep(STUDY, lambda f, *_: 0.1 * f)
    for figure in (draw_convergence(running_statistics(made)), draw_histograms(samples(made))):
        assert smallest_letters(figure) >= 9.0
