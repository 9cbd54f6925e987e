"""Canvases of one look, drawn without a display and without pyplot's global state, and how they are saved."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

from etc_engine.errors import OutputError

try:
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
except ImportError as error:
    raise OutputError(
        f"pictures need matplotlib ({error}): install the extra 'plot', or leave the picture out"
    ) from None

INK = "#222222"
GREY = "#8a8a8a"
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#b65c93", "#c58a00", "#3a93c9", "#7f3c8d", "#4d4d4d")
"""Okabe and Ito's palette for colour-blind readers, darker for thin lines on white, and two more. The page has it."""

MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")

TEXT, SMALL = 9.0, 7.5
"""Sizes of letters in points: titles, axes and ticks; legends and notes."""

UP, DOWN = "\N{UPWARDS ARROW}", "\N{DOWNWARDS ARROW}"
DOWN_MARK = "$\N{DOWNWARDS ARROW}$"
"""What stands for a value outside the axis, in words and as a marker."""

FORMATS = ("png", "pdf", "svg", "jpg")


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def style(axes: Axes) -> None:
    """The look of all curves: ticks inwards, no frame at the top and right, a faint grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(direction="in", which="both", labelsize=TEXT)
    axes.grid(True, color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)


def save(figure: Figure, path: Path | str) -> None:
    """Write a figure in the format of its file's ending.

    Raises
    ------
    OutputError
        If the ending is none of png, pdf, svg and jpg, or the file cannot be written.
    """
    path = Path(path)
    ending = path.suffix.lower().lstrip(".")
    if ending not in FORMATS:
        raise OutputError(f"cannot write {path.name}: a picture ends in .{', .'.join(FORMATS)}")
    try:
        figure.savefig(path, format=ending, dpi=200)
    except OSError as error:
        raise OutputError(f"cannot write {path}: {error.strerror or error}") from None


def png(figure: Figure, dpi: int = 130) -> bytes:
    """A figure as the bytes of a PNG file, for a page that holds its pictures itself."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dpi)
    return buffer.getvalue()


def spread(heights: Sequence[float], gap: float, low: float, high: float) -> list[float]:
    """Heights moved as little as needed to stand apart by a gap, inside [low, high]; in the order given.

    Examples
    --------
    >>> spread([0.5, 0.5, 0.9], 0.1, 0.0, 1.0)
    [0.45, 0.55, 0.9]
    """
    order = np.argsort(heights, kind="stable")
    offsets = gap * np.arange(order.size)
    # With z_i = y_i - i gap the gap becomes an order, and the nearest ordered sequence is isotonic regression.
    blocks: list[list[float]] = []  # sum, count
    for z in np.asarray(heights, dtype=np.float64)[order] - offsets:
        blocks.append([float(z), 1.0])
        while len(blocks) > 1 and blocks[-2][0] / blocks[-2][1] > blocks[-1][0] / blocks[-1][1]:
            total, count = blocks.pop()
            blocks[-1][0] += total
            blocks[-1][1] += count
    ordered = np.concatenate([np.full(int(count), total / count) for total, count in blocks] or [np.empty(0)])
    ordered = np.clip(ordered, low, max(low, high - (offsets[-1] if offsets.size else 0.0))) + offsets
    result = np.empty(order.size)
    result[order] = ordered
    return [round(float(value), 12) for value in result]
