"""Canvases of one look, drawn without a display and without pyplot's global state, and how they are saved."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.errors import OutputError

try:
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
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

NARROW, WIDE = 6.0, 8.0
"""Widths in inches of one column of panels and of more; `TEXT` has 9 pixels or more where they are shown on 600."""

UP, DOWN = "\N{UPWARDS ARROW}", "\N{DOWNWARDS ARROW}"
UP_MARK, DOWN_MARK = f"${UP}$", f"${DOWN}$"
"""What stands for a value outside the axis, in words and as a marker."""

FORMATS = ("png", "pdf", "svg", "jpg")


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches."""
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def new_panels(
    rows: int = 1, columns: int = 1, height: float = 3.8, **options: Any
) -> tuple[Figure, np.ndarray[tuple[int], Any]]:
    """A figure of equal panels in the style of all curves, readable at a width of 600 pixels.

    Parameters
    ----------
    rows, columns : int
        Number of panels.
    height : float
        Of one row in inches.
    **options
        Of `matplotlib.figure.Figure.subplots`, such as ``sharey=True``.

    Returns
    -------
    Figure and ndarray of Axes, shape (rows * columns,)
        The panels row by row.
    """
    figure = new_figure(NARROW if columns == 1 else WIDE, height * rows)
    panels = figure.subplots(rows, columns, squeeze=False, **options).ravel()
    for axes in panels:
        style(axes)
    return figure, panels


def style(axes: Axes) -> None:
    """The look of all curves: the palette, ticks inwards, no frame at the top and right, a faint grid."""
    axes.set_prop_cycle(color=COLOURS)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(direction="in", which="both", labelsize=TEXT)
    axes.grid(True, color="#e6e6e6", linewidth=0.6)
    axes.set_axisbelow(True)
    for words in (axes.xaxis.label, axes.yaxis.label):
        words.set_fontsize(TEXT)


def legend(owner: Axes | Figure, *names: Any, **options: Any) -> Legend:
    """The legend of a panel or a figure, without a frame; arguments as of matplotlib."""
    return owner.legend(*names, **{"frameon": False, "fontsize": TEXT, "title_fontsize": TEXT} | options)


def mark_outside(axes: Axes, x: ArrayLike, y: ArrayLike, colour: str) -> None:
    """Arrows at the upper or lower edge of a panel where points lie beyond it; its limits are kept from here on."""
    left, right = sorted(axes.set_xlim(axes.get_xlim()))
    low, high = axes.set_ylim(axes.get_ylim())
    across, up = np.clip(np.asarray(x, dtype=np.float64), left, right), np.asarray(y, dtype=np.float64)
    for outside, edge, arrow in ((up > high, high, UP_MARK), (up < low, low, DOWN_MARK)):
        if outside.any():
            place = np.full(int(outside.sum()), edge)
            axes.plot(across[outside], place, linestyle="none", marker=arrow, color=colour, markersize=7, clip_on=False)


def label_ends(axes: Axes, curves: Sequence[tuple[str, ArrayLike, ArrayLike]], size: float = SMALL) -> None:
    """Names beside the right ends of lines, moved apart; an arrow and the value where a line leaves the axis.

    Parameters
    ----------
    axes : Axes
        Its limits are kept from here on.
    curves : sequence of (str, ndarray, ndarray)
        Name, abscissas and ordinates of every line; NaN where it has no value.
    size : float
        Of the letters in points.

    Notes
    -----
    The value is that of the right end, or where the end is inside the one farthest outside.
    """
    ends = []
    bottom, top = axes.get_ylim()
    for name, x, y in curves:
        across, up = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        known = np.flatnonzero(np.isfinite(up))
        if known.size:
            end, values = float(up[known[-1]]), up[known]
            outside = (
                end if not bottom <= end <= top else float(values[np.argmax(np.maximum(values - top, bottom - values))])
            )
            arrow = "" if bottom <= outside <= top else f" {UP if outside > top else DOWN} {outside:.3g}"
            ends.append((name + arrow, float(across[known[-1]]), min(max(end, bottom), top)))
    if not ends:
        return
    axes.set_xlim(axes.get_xlim())  # the labels are placed in these limits
    axes.set_ylim(axes.get_ylim())
    to_fraction = axes.transScale + axes.transLimits
    points = [to_fraction.transform((x, y)) for _, x, y in ends]
    heights = spread([float(p[1]) for p in points], 0.05, 0.0, 1.0)
    for (words, _, _), point, height in zip(ends, points, heights, strict=True):
        axes.annotate(
            words,
            xy=(float(point[0]), float(point[1])),
            xycoords="axes fraction",
            xytext=(1.03, height),
            textcoords="axes fraction",
            fontsize=size,
            color="#444444",
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": "#bbbbbb", "linewidth": 0.5, "shrinkA": 1, "shrinkB": 0},
        )


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
