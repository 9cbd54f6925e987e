"""A picture of a packing with the statistics of its structure beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from etc_engine.box import AXES, Box, ball_radius
from etc_engine.output.figures.canvas import COLOURS, GREY, INK, TEXT, WIDE, legend, new_figure, save, style
from etc_engine.output.figures.packing import draw_particles
from etc_engine.packing.neighbors import NeighborPairs, neighbor_pairs
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.statistics import (
    contact_directions,
    contact_half_angles,
    coordination_numbers,
    fabric_tensor,
    few_contacts,
    largest_cluster,
    pair_correlation,
    two_point_probability,
)
from etc_engine.structure.union import solid_fraction

FARTHEST = 5.0
"""Correlations are drawn up to this many mean diameters."""
MOST_PAIRS = 4e6
"""Of a large packing the pair correlation is drawn no farther than about this many pairs reach."""
GRID_POINTS = 4e6
"""Points of the grid on which the two-point probability is found, with the margins that walls need."""
WALL_LAYERS = 2.0
"""Mean diameters along each wall that the two-point probability leaves out, where the room allows it."""
ROW = 2.8
"""Height in inches of a row of statistics."""
TANGENT = np.radians(0.01)
"""Contacts of a smaller half-angle are points."""


def save_structure(packing: ParticlePacking, path: Path | str, bond_gap: float = 1e-6) -> None:
    """Write a picture of a packing and its structure.

    Parameters
    ----------
    packing : ParticlePacking
    path : path
        File ending in png, pdf, svg or jpg.
    bond_gap : float
        Particles closer than this part of their mean radius are in contact.

    Raises
    ------
    OutputError
        If the file cannot be written, or its ending is none of these.
    """
    save(draw_structure(packing, bond_gap), path)


def draw_structure(packing: ParticlePacking, bond_gap: float = 1e-6) -> Figure:
    """Figure of a packing, with its structure below.

    Coordination numbers, half-angles of overlapping contacts, contact directions, pair correlation, two-point
    probability, and a table of numbers. Spheres are seen along z, the highest in front; all statistics are
    three-dimensional.
    """
    seen = min(max(WIDE * packing.box.lengths[1] / packing.box.lengths[0], 2.0), 6.0)
    figure = new_figure(WIDE, seen + 3 * ROW)
    above, below = np.asarray(figure.subfigures(2, 1, height_ratios=[seen, 3 * ROW]))
    draw_particles(above.add_subplot(), packing)
    contacts = neighbor_pairs(packing, relative_gap=bond_gap)
    solid = solid_fraction(packing)
    _draw_coordination(below.add_subplot(3, 2, 1), packing, contacts)
    _draw_half_angles(below.add_subplot(3, 2, 2), packing)
    if packing.dimension == 2:
        _draw_rose(below.add_subplot(3, 2, 3, projection="polar"), packing, contacts)
    else:
        _draw_cosines(below.add_subplot(3, 2, 3), packing, contacts)
    _draw_pair_correlation(below.add_subplot(3, 2, 4), packing)
    _draw_two_point(below.add_subplot(3, 2, 5), packing)
    _write_numbers(below.add_subplot(3, 2, 6), packing, contacts, solid)
    return figure


def _draw_coordination(axes: Axes, packing: ParticlePacking, contacts: NeighborPairs) -> None:
    numbers = coordination_numbers(packing, contacts)
    shares = np.bincount(numbers) / packing.count
    axes.bar(np.arange(shares.size), shares, width=0.8, color=COLOURS[0])
    axes.axvline(float(numbers.mean()), color=COLOURS[1], linewidth=1.2, linestyle="--")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlim(-0.6, max(shares.size, 5) - 0.4)
    _label(axes, "coordination number", "share of the particles", f"coordination, mean {numbers.mean():.3f}")


def _draw_half_angles(axes: Axes, packing: ParticlePacking) -> None:
    angles = contact_half_angles(packing).ravel()
    title = "contact half-angles"
    if not angles.size or angles.max() < TANGENT:
        _say(axes, title, "no overlaps:\ncontacts are points" if angles.size else "no overlaps")
        return
    axes.hist(np.degrees(angles), bins=min(40, 5 + angles.size // 10), density=True, color=COLOURS[0])
    title += f", mean {np.degrees(angles.mean()):.2f}°"
    _label(axes, "half-angle of an overlap [°]", "probability density [1/°]", title)


def _draw_rose(axes: PolarAxes, packing: ParticlePacking, contacts: NeighborPairs) -> None:
    """Directions of contacts in the plane; a contact points both ways."""
    if not contacts.count:
        _say(axes, "contact directions", "no contacts")
        return
    x, y = contact_directions(packing, contacts).T
    width = np.pi / 18.0  # sectors about 0°, 10°, ...: the directions of crystals lie in their middle
    sectors = np.rint(np.arctan2(y, x) / width).astype(np.int64) % 18
    shares = np.bincount(sectors, minlength=18)
    middles, heights = width * np.arange(18), np.tile(shares / shares.mean(), 2)
    axes.bar(np.concatenate([middles, middles + np.pi]), heights, width=width, color=COLOURS[0], edgecolor="white")
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    axes.plot(turn, np.ones_like(turn), color=COLOURS[1], linewidth=1.2, linestyle="--")
    axes.tick_params(labelsize=TEXT)
    axes.set_yticks([0.5, 1.0], ["", ""])
    axes.grid(True, color="#e6e6e6", linewidth=0.6)
    axes.set_title("contact directions (dashed: uniform)", fontsize=TEXT)


def _draw_cosines(axes: Axes, packing: ParticlePacking, contacts: NeighborPairs) -> None:
    """Direction cosines of contacts in space: uniform on [0, 1] for each axis where there is no preferred one."""
    title = "contact directions (dashed: uniform)"
    if not contacts.count:
        _say(axes, "contact directions", "no contacts")
        return
    cosines = np.abs(contact_directions(packing, contacts))
    for axis in range(3):
        shares, edges = np.histogram(cosines[:, axis], np.linspace(0.0, 1.0, 13), density=True)
        axes.stairs(shares, edges, color=COLOURS[axis], label=f"along {AXES[axis]}", linewidth=1.4)
    axes.axhline(1.0, color=GREY, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0, 1.25 * axes.get_ylim()[1])  # room for the legend
    legend(axes, loc="upper center", ncols=3)
    _label(axes, "cosine of the angle with an axis", "probability density", title)


def _draw_pair_correlation(axes: Axes, packing: ParticlePacking) -> None:
    if packing.count < 2:
        _say(axes, "pair correlation", "one particle only")
        return
    diameter = 2.0 * float(packing.radii.mean())
    g = pair_correlation(packing, _farthest_pairs(packing), 120)
    axes.plot(g.distances / diameter, g.values, color=COLOURS[0], linewidth=1.2)
    axes.axhline(1.0, color=GREY, linewidth=1.0, linestyle="--")
    axes.set_ylim(0.0)
    _label(axes, "distance / mean diameter", "g(r)", "pair correlation of the centres")


def _draw_two_point(axes: Axes, packing: ParticlePacking) -> None:
    diameter, box = 2.0 * float(packing.radii.mean()), packing.box
    between = [length for length, periodic in zip(box.lengths, box.periodic, strict=True) if not periodic]
    margin = WALL_LAYERS * diameter if between else 0.0
    homogeneous = 2.0 * margin <= 0.5 * min(between, default=box.lengths[0])
    margin = margin if homogeneous else 0.0
    edges = [length - (0.0 if flag else 2.0 * margin) for length, flag in zip(box.lengths, box.periodic, strict=True)]
    s2 = two_point_probability(packing, min(FARTHEST * diameter, 0.45 * min(edges)), _pixels(box), margin)
    solid = float(s2.values[0])
    axes.plot(s2.distances / diameter, s2.values, color=COLOURS[0], linewidth=1.2)
    axes.plot([0.0], [solid], "o", color=COLOURS[1], markersize=5, clip_on=False, label="solid fraction")
    if homogeneous:
        axes.axhline(solid**2, color=GREY, linewidth=1.0, linestyle="--", label="its square")
    legend(axes)
    where = f", {WALL_LAYERS:g} diameters off walls" if margin else " of the solid"
    _label(axes, "distance / mean diameter", r"$S_2(r)$", f"two-point probability{where}")


def _write_numbers(axes: Axes, packing: ParticlePacking, contacts: NeighborPairs, solid: float) -> None:
    box = packing.box
    numbers = coordination_numbers(packing, contacts)
    smallest, largest = packing.radii.min(), packing.radii.max()
    rows = [
        ("particles", f"{packing.count}"),
        ("box [m]", " × ".join(f"{length:g}" for length in box.lengths)),
        ("periodic", box.periodic_axes or "no: walls"),
        ("radii [m]", f"{smallest:.4g} to {largest:.4g}" if smallest < largest else f"{smallest:.4g}"),
        ("density", f"{packing.density:.6f}"),
        ("solid fraction", f"{solid:.6f}"),
        ("contacts", f"{contacts.count}"),
        ("coordination", f"{numbers.mean():.4f}"),
    ]
    if contacts.count:
        few, cluster = few_contacts(packing, contacts), largest_cluster(packing, contacts)
        fabric = fabric_tensor(packing, contacts)
        rows.append((f"below {packing.dimension + 1} contacts", f"{100.0 * few.mean():.1f} % of the particles"))
        rows.append(("largest cluster", f"{100.0 * cluster.mean():.1f} %"))
        rows.append(("fabric diagonal", " ".join(f"{value:.3f}" for value in np.diag(fabric))))
        rows.append(("fabric eigenvalues", " ".join(f"{value:.3f}" for value in np.linalg.eigvalsh(fabric)[::-1])))
    axes.set_axis_off()
    for row, (name, value) in enumerate(rows):
        height = 0.97 - 0.085 * row
        axes.text(0.0, height, name, transform=axes.transAxes, fontsize=TEXT, color=GREY, va="top")
        axes.text(0.5, height, value, transform=axes.transAxes, fontsize=TEXT, color=INK, va="top")


def _farthest_pairs(packing: ParticlePacking) -> float:
    """Distance up to which the pair correlation is drawn [m]."""
    d, box = packing.dimension, packing.box
    within_reach = float(ball_radius(2.0 * MOST_PAIRS * box.volume / packing.count**2, d))
    return float(min(FARTHEST * 2.0 * packing.radii.mean(), within_reach, 0.5 * min(box.lengths)))


def _pixels(box: Box) -> int:
    """Pixels along the longest edge that fit the grid with its margins."""
    longest = max(box.lengths)
    parts = [length / longest * (1.0 if flag else 2.0) for length, flag in zip(box.lengths, box.periodic, strict=True)]
    return max(8, int((GRID_POINTS / float(np.prod(parts))) ** (1.0 / box.dimension)))


def _label(axes: Axes, x: str, y: str, title: str) -> None:
    style(axes)
    axes.set_xlabel(x, fontsize=TEXT)
    axes.set_ylabel(y, fontsize=TEXT)
    axes.set_title(title, fontsize=TEXT)


def _say(axes: Axes, title: str, words: str) -> None:
    """A panel that has nothing to draw says why."""
    axes.set_axis_off()
    axes.set_title(title, fontsize=TEXT)
    axes.text(0.5, 0.5, words, transform=axes.transAxes, ha="center", va="center", fontsize=TEXT, color=GREY)
