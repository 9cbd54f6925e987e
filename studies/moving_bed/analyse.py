"""Heat through a sheared bed: ``python analyse.py [figure.png]``

The bottom wall is held at 1, the top wall at 0. A moving disk keeps its heat, so the bed conducts better the faster it
is sheared. The Peclet number is Pe = shear rate R^2 rho c/kappa.
"""

from __future__ import annotations

import sys

import numpy as np
from bed import sheared_bed
from matplotlib.collections import EllipseCollection

from etc_engine import effective_conductivity
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.medium.medium import medium_of
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.rules import overlap_contacts
from etc_engine.medium.transient import ParticleSystem
from etc_engine.medium.walls import FixedTemperature
from etc_engine.output.figures.canvas import GREY, INK, MARKERS, TEXT, WIDE, legend, new_figure, save, style
from etc_engine.particle_files.trajectory import Trajectory
from etc_engine.realization import transient_system
from etc_engine.transient.moving import MovingState, Stepping, march_trajectory

WALLS = {"bottom": FixedTemperature(1.0), "top": FixedTemperature(0.0)}
PECLET = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3)
SETTLED = 8.0
"""Strain after which the heat flow is averaged: at the fastest, 27 R^2/kappa or 1.4 times H^2/(pi^2 kappa)."""
SHOWN = (0.0, 4.0, 24.0)


def pipes(network: ContactNetwork, capacities: np.ndarray) -> ParticleSystem:
    return transient_system(medium_of(network), WALLS, engine="pipe", capacities=capacities)


def sheared(bed: Trajectory, peclet: float) -> list[MovingState]:
    """Heat in the bed at a shear rate, from the steady state of the bed at rest."""
    height = bed.packings[0].box.lengths[1]
    radius = float(bed.packings[0].radii.mean())
    rate = peclet / radius**2  # kappa = rho c = 1
    network = overlap_contacts(bed.packings[0])
    rest = pipe_conductivity(medium_of(network), axes=(1,)).solutions[0].temperatures[:, 0]
    start = np.where(np.isnan(rest), 1.0 - bed.packings[0].centers[:, 1] / height, rest)
    timed = Trajectory(bed.times / rate, bed.packings, bed.ids)
    return list(march_trajectory(timed, overlap_contacts, pipes, start, stepping=Stepping(steps=2)))


def flux(bed: Trajectory, states: list[MovingState]) -> tuple[float, float]:
    """Conductivity from the heat through both walls, and its standard error over ten blocks of strain."""
    edges = np.linspace(np.searchsorted(bed.times, SETTLED), len(states) - 1, 11).astype(int)
    lengths = bed.packings[0].box.lengths
    through = np.array([0.5 * lengths[1] / lengths[0] * (state.heat[2] - state.heat[3]) for state in states])
    time = np.array([state.time for state in states])
    blocks = np.diff(through[edges]) / np.diff(time[edges])
    return float(blocks.mean()), float(blocks.std(ddof=1) / np.sqrt(blocks.size))


def main(picture: str = "figure.png") -> None:
    bed = sheared_bed()
    late = [packing for time, packing in zip(bed.times, bed.packings, strict=True) if time > SETTLED][::8]
    networks = [overlap_contacts(packing) for packing in late]
    still = np.array([pipe_conductivity(medium_of(network), axes=(1,)).tensor[1, 1] for network in networks])
    element = np.array([effective_conductivity(medium_of(network), axes=(1,)).tensor[1, 1] for network in networks])
    print(
        f"{bed.count} disks, {len(bed.packings)} frames, coordination {np.mean([n.coordination for n in networks]):.2f}"
    )
    print(f"held still, mean over frames: pipe network {still.mean():.4f}, dtem chord {element.mean():.4f}")
    print(f"{'Pe':>8s}{'k/kappa':>20s}{'opened':>9s}{'imbalance':>12s}")
    means, errors, states = [], [], []
    for peclet in PECLET:
        states = sheared(bed, peclet)
        mean, error = flux(bed, states)
        means.append(mean)
        errors.append(error)
        last = states[-1]
        balance = abs(last.stored - last.heat.sum()) / np.abs(last.heat).max()
        opened = sum(state.opened for state in states)
        print(f"{peclet:8.3f}{f'{mean:.4f} +- {error:.4f}':>20s}{opened:9d}{balance:12.1e}", flush=True)
    draw(bed, states, np.array(means), np.array(errors), float(still.mean()), picture)


def draw(
    bed: Trajectory, states: list[MovingState], means: np.ndarray, errors: np.ndarray, still: float, picture: str
) -> None:
    figure = new_figure(WIDE, 5.6)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.0, 2.2))
    beds = upper.subplots(1, len(SHOWN))
    for axes, strain in zip(beds, SHOWN, strict=True):
        frame = int(np.searchsorted(bed.times, strain))
        packing, temperatures = bed.packings[frame], states[frame].temperatures
        disks = EllipseCollection(
            2 * packing.radii,
            2 * packing.radii,
            np.zeros(packing.count),
            units="xy",
            offsets=packing.centers,
            offset_transform=axes.transData,
            array=temperatures,
            cmap="inferno",
            clim=(0.0, 1.0),
            edgecolors=INK,
            linewidths=0.2,
        )
        axes.add_collection(disks)
        axes.set(xlim=(0, 1), ylim=(0, 0.5), aspect="equal", xticks=[], yticks=[])
        axes.set_title(f"strain {strain:g}, Pe = {PECLET[-1]:g}", fontsize=TEXT)
    bar = upper.colorbar(disks, ax=beds, shrink=0.7)
    bar.set_label("temperature [-]", fontsize=TEXT)
    bar.ax.tick_params(labelsize=TEXT)
    left, axes = lower.subplots(1, 2, width_ratios=(2.0, 1.0))
    style(left)
    style(axes)
    left.axhline(still, color=GREY, linestyle="--", linewidth=1.0, label="frames held still, pipe network")
    left.errorbar(PECLET, means, errors, marker="o", markersize=4, capsize=2, label="sheared")
    left.set(xscale="log", ylim=(0.3, 0.4), xlabel="Peclet number (shear rate R²/diffusivity) [-]")
    left.set_ylabel("conductivity over that of the disks [-]")
    legend(left)
    for frame, marker in zip(np.searchsorted(bed.times, SHOWN), MARKERS, strict=False):
        heights, temperatures = bed.packings[frame].centers[:, 1], states[frame].temperatures
        axes.plot(temperatures, heights, marker, markersize=2.5, label=f"strain {bed.times[frame]:g}")
    axes.set(xlabel="temperature [-]", ylabel="height [-]")
    legend(axes)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
