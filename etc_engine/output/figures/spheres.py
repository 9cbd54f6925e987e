"""Pictures of the temperatures of a bed of spheres: a slice through it, and a view of it, without a graphics card."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Normalize

from etc_engine.arrays import Floats
from etc_engine.box import AXES
from etc_engine.medium.field import ParticleField
from etc_engine.output.figures.canvas import TEXT, WIDE, new_figure, save
from etc_engine.packing.particles import ParticlePacking

PIXELS = 700
"""Along the longer side of the slice and of the view."""
PLANES = 101
"""Planes of which the one with the largest area of spheres is drawn."""
TOWARDS = np.array([1.0, -1.35, 0.75]) / np.linalg.norm([1.0, -1.35, 0.75])
"""Direction from the bed to the eye."""
LIGHT = np.array([0.25, -0.75, 0.6]) / np.linalg.norm([0.25, -0.75, 0.6])
COLOURS = colormaps["inferno"].with_extremes(bad="0.75")
"""Grey where no heat arrives."""


def save_spheres(path: Path, field: ParticleField, caption: str = "") -> None:
    """Picture of a bed of spheres: the slice along the load that cuts most of them, and a view of its surface.

    Parameters
    ----------
    path : path
        Its ending decides the format.
    field : ParticleField
        Where nothing is known inside the spheres, they are drawn in their mean temperatures.
    caption : str
        Line above the picture.
    """
    packing = field.medium.packing
    low, high = temperature_range(field)
    scale = Normalize(low, high if high > low else low + 1.0)
    across, up, normal = slice_axes(field.axis)
    width, height = packing.box.lengths[across], packing.box.lengths[up]
    figure = new_figure(WIDE, 4.2)
    left, right = figure.subplots(1, 2)
    place = slice_place(packing, normal)
    image = slice_temperatures(field, PIXELS, place)
    shown = left.imshow(image, extent=(0, width, 0, height), origin="lower", cmap=COLOURS, norm=scale)
    left.set(xlabel=f"{AXES[across]} [m]", ylabel=f"{AXES[up]} [m]", aspect="equal", facecolor="0.9")
    left.locator_params(nbins=6)
    left.set_title(f"slice at {AXES[normal]} = {place:.3g} m", fontsize=TEXT)
    view, frame = draw_view(packing, COLOURS(scale(np.ma.masked_invalid(field.particle_temperatures))), PIXELS)
    right.imshow(view, extent=frame, interpolation="bilinear", zorder=2)
    draw_edges(right, packing)
    right.margins(0.04)
    right.set_axis_off()
    right.set_title("mean temperature of each sphere", fontsize=TEXT, pad=14)
    figure.colorbar(shown, ax=[left, right], label="temperature [K]", shrink=0.85)
    figure.suptitle(caption, fontsize=TEXT)
    save(figure, path)


def temperature_range(field: ParticleField) -> tuple[float, float]:
    """Lowest and highest temperature to draw: those of the walls, or of the spheres in a periodic box."""
    if not field.medium.box.periodic[field.axis]:
        return 0.0, 1.0
    known = field.particle_temperatures[np.isfinite(field.particle_temperatures)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)


def slice_axes(load: int) -> tuple[int, int, int]:
    """Axes of a slice that shows a load: across and up the picture, and normal to it (y unless the load is along y)."""
    normal = 1 if load != 1 else 0
    across, up = (axis for axis in range(3) if axis != normal)
    return across, up, normal


def slice_place(packing: ParticlePacking, normal: int) -> float:
    """Place of the plane that cuts the largest area of spheres [m]; of equal ones the nearest to the middle.

    Parameters
    ----------
    packing : ParticlePacking
    normal : int
        Axis normal to the plane.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> layers = ParticlePacking([[0.5, 0.5, 0.5], [0.5, 0.5, 1.5]], [0.5, 0.45], Box((1.0, 1.0, 2.0)))
    >>> round(slice_place(layers, 2), 6)  # the middle, z = 1, is between the layers
    0.5
    """
    length = packing.box.lengths[normal]
    places = np.linspace(0.0, length, PLANES)
    area = np.zeros(PLANES)
    for step in (-1.0, 0.0, 1.0) if packing.box.periodic[normal] else (0.0,):
        for k, place in enumerate(places.tolist()):
            offset = place - packing.centers[:, normal] - step * length
            area[k] += np.maximum(packing.radii**2 - offset**2, 0.0).sum()
    best = np.flatnonzero(area >= area.max() * (1.0 - 1e-9))
    return float(places[best[np.argmin(np.abs(places[best] - 0.5 * length))]])


def slice_temperatures(field: ParticleField, pixels: int, place: float) -> Floats:
    """Temperatures in a plane that contains the load axis, NaN between the spheres.

    Parameters
    ----------
    field : ParticleField
    pixels : int
        Along the longer edge.
    place : float [m]
        Of the plane, along its normal.

    Returns
    -------
    ndarray, shape (rows, columns) [K]
        Row 0 at the low end.
    """
    packing = field.medium.packing
    across, up, normal = slice_axes(field.axis)
    lengths = np.asarray(packing.box.lengths)
    size = lengths[[across, up]]
    columns, rows = np.maximum(1, np.round(size / size.max() * pixels)).astype(int)
    x, y = (np.arange(columns) + 0.5) * size[0] / columns, (np.arange(rows) + 0.5) * size[1] / rows
    owner = np.full((rows, columns), -1)
    nearest = np.full((rows, columns), np.inf)
    relative = np.zeros((rows, columns, 3))
    for image in _images(packing):
        centers = packing.centers + image * lengths
        offset = place - centers[:, normal]
        for p in np.flatnonzero(np.abs(offset) < packing.radii):
            reach = np.sqrt(packing.radii[p] ** 2 - offset[p] ** 2)
            i = slice(*np.searchsorted(x, centers[p, across] + np.array([-reach, reach])))
            j = slice(*np.searchsorted(y, centers[p, up] + np.array([-reach, reach])))
            dx, dy = x[None, i] - centers[p, across], y[j, None] - centers[p, up]
            # where two spheres overlap, the plane of equal power separates them
            power = (dx**2 + dy**2 + offset[p] ** 2) - packing.radii[p] ** 2
            inside = (power <= 0.0) & (power < nearest[j, i])
            nearest[j, i][inside] = power[inside]
            owner[j, i][inside] = p
            spot = np.stack(np.broadcast_arrays(dx, dy, offset[p]), axis=-1)[inside]
            relative[j, i][inside] = spot[:, np.argsort([across, up, normal])]
    drawn = owner >= 0
    values = np.full((rows, columns), np.nan)
    if field.inside is not None:
        values[drawn] = field.inside(owner[drawn], relative[drawn])
    else:
        values[drawn] = field.particle_temperatures[owner[drawn]]
    if packing.box.periodic[field.axis]:  # the image of a sphere is a mean gradient of 1 away
        along = np.broadcast_to(x if field.axis == across else y[:, None], values.shape)
        home = packing.centers[owner[drawn], field.axis] + relative[drawn][:, field.axis]
        values[drawn] += along[drawn] - home
    return values


def _images(packing: ParticlePacking) -> Floats:
    """Shifts of the box, in its lengths, by which spheres reach into it."""
    steps = [(-1.0, 0.0, 1.0) if flag else (0.0,) for flag in packing.box.periodic]
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)


def screen_axes() -> Floats:
    """Unit vectors to the right and up the picture, shape (2, 3), z upright."""
    right = np.cross([0.0, 0.0, 1.0], TOWARDS)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(TOWARDS, right)])


def draw_view(
    packing: ParticlePacking, colours: Floats, pixels: int
) -> tuple[Floats, tuple[float, float, float, float]]:
    """Parallel projection of spheres, hidden parts removed, lit from the front; edges darkened where the depth jumps.

    Parameters
    ----------
    packing : ParticlePacking
    colours : ndarray, shape (n, 4)
        Red, green, blue, opacity of each sphere; the opacity is ignored.
    pixels : int
        Along the longer side.

    Returns
    -------
    image : ndarray, shape (rows, columns, 4)
        Top row first; opaque where there is a sphere.
    frame : tuple of float
        Left, right, bottom and top of the image in projected coordinates [m].
    """
    screen = screen_axes()
    flat, depth = packing.centers @ screen.T, packing.centers @ TOWARDS
    corners = box_corners(packing) @ screen.T
    low = np.minimum((flat - packing.radii[:, None]).min(axis=0), corners.min(axis=0))
    high = np.maximum((flat + packing.radii[:, None]).max(axis=0), corners.max(axis=0))
    step = float((high - low).max() / pixels)
    columns, rows = np.ceil((high - low) / step).astype(int) + 1
    nearest, image = np.full((rows, columns), -np.inf), np.zeros((rows, columns, 4))
    lit, facing = np.array([*(screen @ LIGHT), TOWARDS @ LIGHT]), np.array([0.0, 0.0, 1.0])
    for p in range(packing.count):
        radius = packing.radii[p]
        first = np.maximum(np.floor((flat[p] - radius - low) / step).astype(int), 0)
        last = np.ceil((flat[p] + radius - low) / step).astype(int) + 1
        u = (low[0] + step * np.arange(first[0], min(last[0], columns)) - flat[p, 0]) / radius
        v = (low[1] + step * np.arange(first[1], min(last[1], rows)) - flat[p, 1]) / radius
        square = 1.0 - u[None, :] ** 2 - v[:, None] ** 2
        height = np.sqrt(np.maximum(square, 0.0))
        part = np.s_[first[1] : first[1] + v.size, first[0] : first[0] + u.size]
        over = (square > 0.0) & (depth[p] + radius * height > nearest[part])
        nearest[part][over] = (depth[p] + radius * height)[over]
        normal = np.stack(np.broadcast_arrays(u[None, :], v[:, None], height), axis=-1)[over]
        shade = 0.35 + 0.65 * np.maximum(normal @ lit, 0.0)
        shine = 0.35 * np.maximum(normal @ _half_way(lit, facing), 0.0) ** 40
        image[part][over] = np.concatenate(
            [np.clip(shade[:, None] * colours[p, :3] + shine[:, None], 0.0, 1.0), np.ones((shade.size, 1))], axis=1
        )
    filled = np.where(np.isfinite(nearest), nearest, nearest[np.isfinite(nearest)].min())
    jump = np.maximum(*(np.abs(np.gradient(filled, axis=axis)) for axis in (0, 1)))
    dark = np.clip(1.0 - 0.35 * (jump / packing.radii.mean() - 0.15), 0.45, 1.0)
    image[..., :3] *= dark[..., None]
    left, bottom = low - 0.5 * step
    return image[::-1], (left, left + columns * step, bottom, bottom + rows * step)


def _half_way(first: Floats, second: Floats) -> Floats:
    middle = first + second
    return np.asarray(middle / np.linalg.norm(middle))


def box_corners(packing: ParticlePacking) -> Floats:
    """Corners of the box, shape (8, 3)."""
    return np.stack(np.meshgrid(*([0.0, length] for length in packing.box.lengths), indexing="ij"), -1).reshape(-1, 3)


def draw_edges(axes: Axes, packing: ParticlePacking) -> None:
    """The three edges of the box that meet behind the bed, dashed where they bound a periodic side."""
    screen, lengths = screen_axes(), np.asarray(packing.box.lengths)
    back = np.where(TOWARDS > 0.0, 0.0, lengths)
    for axis in range(3):
        other = back.copy()
        other[axis] = lengths[axis] - back[axis]
        ends = np.stack([back, other]) @ screen.T
        style = "--" if packing.box.periodic[axis] else "-"
        axes.plot(*ends.T, style, color="0.35", linewidth=1.0, zorder=1)
        outwards = ends[1] + 0.04 * (ends[1] - ends[0])
        axes.text(float(outwards[0]), float(outwards[1]), AXES[axis], fontsize=9, ha="center", va="center")
