"""Pictures: what is drawn where, to scale and readable."""

from __future__ import annotations

from io import BytesIO

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.image import imread
from matplotlib.text import Annotation

from etc_engine.box import Box
from etc_engine.comparison import evaluate_models, model_lines
from etc_engine.errors import OutputError
from etc_engine.output.figures import draw_comparison, png, save_packing
from etc_engine.output.figures.canvas import spread
from etc_engine.output.figures.packing import draw_packing
from etc_engine.packing.particles import ParticlePacking

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
contact_angle = [2.5, 5.0, 10.0]
[conduction]
method = ["chord", "standard"]
[statistics]
realizations = 3
[models]
names = ["effective_medium", "maxwell", "differential", "maxwell_inverse", "differential_inverse", "third_order",
         "contact_mean_field", "parallel"]
"""


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
@settings(deadline=None, max_examples=60)
def test_spread_labels_stand_apart_in_order_and_move_no_more_than_needed(heights):
    gap = 0.05
    placed = np.array(spread(heights, gap, 0.0, 1.0))
    order = np.argsort(heights, kind="stable")
    assert np.all(np.diff(placed[order]) >= gap - 1e-9)
    assert placed.min() >= -1e-9
    assert placed.max() <= 1.0 + 1e-9
    apart = np.array(spread(list(placed), gap, 0.0, 1.0))
    assert np.allclose(apart, placed, atol=1e-9)  # what stands apart stays


def linear(density, angle, method, realization):
    return 0.01 * angle * (density - 0.5) * (1.0 + 0.1 * realization)


def drawn(made_sweep, text=STUDY, conduct=linear):
    comparison = evaluate_models(made_sweep(text, conduct))
    figure = draw_comparison(comparison, model_lines(comparison))
    png(figure)  # the layout is made when the figure is drawn
    return comparison, figure


def test_labels_of_models_overlap_neither_each_other_nor_the_edge(made_sweep):
    _, figure = drawn(made_sweep)
    renderer = figure.canvas.get_renderer()
    labels = [child for axes in figure.axes for child in axes.get_children() if isinstance(child, Annotation)]
    assert {label.get_text() for label in labels} >= {
        "Hashin-Shtrikman upper",
        "inverse Maxwell",
        "parallel",
        "Bruggeman, pores in solid",
    }
    boxes = [label.get_window_extent(renderer) for label in labels]
    text = [label.get_bbox_patch() or label for label in labels]
    assert len(text) == len(boxes) == 5
    frame = figure.bbox
    for i, box in enumerate(boxes):
        assert box.x1 <= frame.x1 + 1.0
        assert not any(abs(box.y0 + box.y1 - other.y0 - other.y1) < 12.0 for other in boxes[i + 1 :]), labels[i]


def test_curves_are_the_means_and_bands_their_intervals(made_sweep):
    comparison, figure = drawn(made_sweep)
    panel = figure.axes[0]
    assert panel.get_title() == "method chord"
    for i, angle in enumerate(comparison["contact_angle"].values):
        cell = comparison.sel({"method": "chord", "contact_angle": angle})
        curve = [line for line in panel.get_lines() if line.get_marker() in ("o", "s", "^")][i]
        assert np.allclose(curve.get_xdata(), comparison["density"])
        assert np.allclose(curve.get_ydata(), cell["conductivity_mean"])
        band = panel.collections[i].get_paths()[0].vertices
        assert band[:, 1].min() == pytest.approx(float(cell["conductivity_ci_low"].min()))
        assert band[:, 1].max() == pytest.approx(float(cell["conductivity_ci_high"].max()))
    assert "W m" in panel.get_ylabel()
    assert any("bounds do not apply:\nthe contacts are bonds" in t.get_text() for t in figure.texts)


def test_the_axes_follow_the_sweep(made_sweep):
    _, wide = drawn(made_sweep, conduct=lambda f, *_: 10.0 ** (20.0 * (f - 0.8)))
    assert wide.axes[0].get_yscale() == "log"
    _, angles = drawn(made_sweep, STUDY.replace("[0.6, 0.65, 0.7, 0.75]", "0.7"))
    assert angles.axes[0].get_xlabel() == "contact half-angle [degree]"
    _, point = drawn(made_sweep, STUDY.replace("[0.6, 0.65, 0.7, 0.75]", "0.7").replace("[2.5, 5.0, 10.0]", "5.0"))
    assert point.axes[0].get_xlabel().startswith("density")


def test_a_picture_of_a_packing_is_to_scale():
    rng = np.random.default_rng(20266)
    grid = np.stack(np.meshgrid(np.arange(10), np.arange(5)), axis=-1).reshape(-1, 2) + 0.5
    radii = 0.3 + 0.2 * rng.random(len(grid))
    packing = ParticlePacking(0.2 * grid, 0.2 * radii, Box((2.0, 1.0), (True, False)))
    figure = draw_packing(packing)
    figure.axes[0].collections[0].set_linewidth(0.0)  # edges reach beyond the disks
    picture = imread(BytesIO(png(figure)))
    axes = figure.axes[0]
    scale = picture.shape[1] / figure.bbox.width
    box = axes.transData.transform([[0.0, 0.0], [2.0, 1.0]]) * scale
    (x0, y0), (x1, y1) = box.round().astype(int)
    inside = picture[picture.shape[0] - y1 + 2 : picture.shape[0] - y0 - 2, x0 + 2 : x1 - 2]  # without the walls
    covered = float((inside[..., 0] < 0.75).mean())  # red: 1 between the disks, 0.1 to 0.5 in them
    assert covered == pytest.approx(packing.density, rel=0.03)


def test_a_picture_shows_images_across_periodic_sides_and_spheres_from_above():
    disks = ParticlePacking([[0.05, 0.5]], [0.1], Box((1.0, 1.0), (True, False)))
    assert draw_packing(disks).axes[0].collections[0].get_offsets().tolist() == [[0.05, 0.5], [1.05, 0.5]]
    spheres = ParticlePacking([[0.5, 0.5, 0.8], [0.4, 0.5, 0.2]], [0.1, 0.1], Box((1.0, 1.0, 1.0)))
    assert draw_packing(spheres).axes[0].collections[0].get_array().tolist() == [0.2, 0.8]  # the highest is last


def test_a_picture_of_no_known_format_is_refused(tmp_path):
    packing = ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0)))
    with pytest.raises(OutputError, match=r"a picture ends in \.png, \.pdf, \.svg, \.jpg"):
        save_packing(packing, tmp_path / "picture.doc")
    with pytest.raises(OutputError, match="cannot write"):
        save_packing(packing, tmp_path / "none" / "picture.png")
    for ending in ("png", "pdf", "svg"):
        save_packing(packing, tmp_path / f"picture.{ending}")
        assert (tmp_path / f"picture.{ending}").stat().st_size > 1000
