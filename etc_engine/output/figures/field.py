"""Pictures of a packing's temperature field."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection, LineCollection
from matplotlib.figure import Figure

from etc_engine.medium.field import ParticleField
from etc_engine.output.figures.spheres import save_spheres
from etc_engine.output.raster import sample_image

DETAILED = 3_000
"""Above this many particles each is drawn in its mean temperature, and contact flows are left out."""
WIDEST = 0.3
"""Line width of the largest heat flow, in mean particle diameters."""


def save_field(path: Path, field: ParticleField, caption: str = "") -> None:
    """Picture of the particles coloured by their inner temperature, heat flows as line widths.

    Parameters
    ----------
    path : path
        Its ending decides the format.
    field : ParticleField
        Where nothing is known inside the particles, they are drawn in their mean temperatures.
    caption : str
        Line above the picture.
    """
    packing = field.medium.packing
    if packing.dimension == 3:
        save_spheres(path, field, caption)
        return
    width, height = packing.box.lengths
    scale = 6.5 / max(width, height)
    figure = Figure(figsize=(max(width * scale, 2.5) + 1.6, max(height * scale, 1.5) + 0.7), layout="constrained")
    axes = figure.add_subplot()
    known = field.particle_temperatures[np.isfinite(field.particle_temperatures)]
    if packing.box.periodic[field.axis]:
        low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    else:
        low, high = 0.0, 1.0
    detailed, inside = packing.count <= DETAILED, field.inside is not None
    if detailed and inside:
        image, _ = sample_image(field, 900)
        mapped: ScalarMappable = axes.imshow(
            image, extent=(0, width, 0, height), origin="lower", cmap="inferno", vmin=low, vmax=high, zorder=2
        )
        _draw_disks(axes, packing.centers, packing.radii, facecolors="0.85", edgecolors="none", zorder=1)
        _draw_disks(axes, packing.centers, packing.radii, facecolors="none", edgecolors="0.3", linewidths=0.4, zorder=3)
    else:
        edges = {"edgecolors": "0.3", "linewidths": 0.4} if detailed else {"edgecolors": "none"}
        disks = _draw_disks(axes, packing.centers, packing.radii, cmap="inferno", zorder=2, **edges)
        disks.set_array(field.particle_temperatures)
        disks.set_clim(low, high)
        mapped = disks
    if detailed:
        diameter = 2.0 * float(packing.radii.mean()) * scale * 72.0  # [pt]
        _draw_flows(axes, field, min(WIDEST * diameter, 5.0))
    axes.set(xlim=(0, width), ylim=(0, height), aspect="equal", xlabel="x [m]", ylabel="y [m]")
    axes.set_title(caption, fontsize=10)
    means = "" if detailed and inside else ", mean of each particle"
    label = "temperature [K]" + means + (", heat flow by line width" if detailed else "")
    figure.colorbar(mapped, ax=axes, label=label, shrink=0.85)
    figure.savefig(path, dpi=150, bbox_inches="tight")


def _draw_disks(axes: Axes, centers: np.ndarray, radii: np.ndarray, **style: object) -> EllipseCollection:
    disks = EllipseCollection(
        2 * radii,
        2 * radii,
        np.zeros(radii.size),
        units="xy",
        offsets=centers,
        offset_transform=axes.transData,
        **style,
    )
    axes.add_collection(disks)
    return disks


def _draw_flows(axes: Axes, field: ParticleField, widest: float) -> None:
    """Lines from centre to centre (or to the wall), as wide as the heat flow, the largest ``widest`` points."""
    network = field.medium.links
    centers = network.packing.centers
    start = centers[network.pairs[:, 0]]
    lines = np.stack([start, start + network.branches], axis=1)
    at_wall = centers[network.wall_particles].copy()
    axis = network.walls // 2
    at_wall[np.arange(axis.size), axis] = (network.walls % 2) * np.asarray(network.packing.box.lengths)[axis]
    to_wall = np.stack([centers[network.wall_particles], at_wall], axis=1)
    flows = np.abs(np.concatenate([field.contact_flows, field.wall_flows]))
    if flows.size and flows.max() > 0.0:
        widths = widest * flows / flows.max()
        segments = np.concatenate([lines, to_wall])[widths > 0.02]
        axes.add_collection(
            LineCollection(list(segments), linewidths=widths[widths > 0.02], colors="tab:cyan", zorder=4)
        )
