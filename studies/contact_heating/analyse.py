"""True temperatures inside two disks of a bed that warms up, against those of the network models.

``python studies/contact_heating/analyse.py [--output DIRECTORY]`` writes contact_heating.csv and contact_heating.png.
The heat flows of each model through the contacts of a disk are applied to a meshless solution of the interior of that
disk.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from etc_engine import Box, ContactNetwork, PackingSpec, bonded_contacts, pack, parse_radii
from etc_engine.engines.dtem.transient import contact_temperatures
from etc_engine.engines.meshless import ContactArc, heat_disk_by_flows
from etc_engine.laws.disk import position_angles, standard_resistance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.sides import contact_sides
from etc_engine.medium.transient import ParticleSystem, particle_sides
from etc_engine.medium.walls import FixedTemperature
from etc_engine.output.figures.canvas import COLOURS, INK, MARKERS, TEXT, legend, mark_outside, new_panels, save
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import march

HERE = Path(__file__).parent
SEED = 2009
HALF_ANGLE = np.radians(10.0)
WALLS = {"left": FixedTemperature(1.0)}
FOURIER = np.geomspace(0.01, 20.0, 34)
MODELS = ("standard with dipoles", "standard", "pipe, uniform")
ROWS = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 20.0)


@dataclass(frozen=True)
class Inside:
    """What one model and the truth under its fluxes say of one disk, at `FOURIER`.

    Parameters
    ----------
    mean, contacts : ndarray, shape (t,), (t, n) [K]
        Of the model.
    true_mean, true_contacts : ndarray, shape (t,), (t, n) [K]
        Of the disk's inside under the model's heat flows, uniform over each contact.
    """

    mean: np.ndarray
    contacts: np.ndarray
    true_mean: np.ndarray
    true_contacts: np.ndarray


def bed() -> ContactNetwork:
    """Bonded disks of about the same size, contact half-angle 10 degrees."""
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.05:0.06"), Box((1.0, 1.0)))
    return bonded_contacts(pack(spec, np.random.default_rng(SEED)), HALF_ANGLE, 1e-3)


def chosen(network: ContactNetwork) -> dict[str, int]:
    """The disk at the heated wall and the one behind it with the most contacts."""
    sides = contact_sides(network)
    number = np.diff(sides.offsets)
    touching = np.isin(np.arange(number.size), network.wall_particles[network.walls == 0])
    pairs = np.concatenate([network.pairs, network.pairs[:, ::-1]])
    behind = np.isin(np.arange(number.size), pairs[touching[pairs[:, 0]], 1]) & ~touching
    return {
        "at the wall": int(np.argmax(np.where(touching, number, 0))),
        "behind it": int(np.argmax(np.where(behind, number, 0))),
    }


def made_system(network: ContactNetwork, model: str) -> ParticleSystem:
    """The system of one of the models."""
    medium = medium_of(network, heat_capacity=1.0)
    if model.startswith("pipe"):
        return transient_system(medium, WALLS, engine="pipe", method="uniform")
    return transient_system(medium, WALLS, method="standard", dipoles="dipoles" in model)


def marched(system: ParticleSystem, model: str, unit: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Times (m,), heat flows (m, s) and temperatures (m, s) at all contact sides, means (m, n)."""
    times = np.concatenate([[0.0], np.geomspace(1e-4, FOURIER[-1], 160)]) * unit
    sides = system.sides
    own = standard_resistance(sides.alpha)
    flows, contacts, means = [], [], []
    for state in march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-6):
        mean = system.particle_temperatures(state.temperatures)
        flow = system.flows(state.time, state.temperatures)
        if model.startswith("pipe"):
            contact = mean[sides.particles] + own * flow
        else:
            contact = contact_temperatures(system, state.time, state.temperatures)[sides.nodes]
        flows.append(flow)
        contacts.append(contact)
        means.append(mean)
    return times, np.array(flows), np.array(contacts), np.array(means)


def inside(network: ContactNetwork, model: str, particle: int, steps: int = 200) -> Inside:
    """March the network, then the inside of one particle under its fluxes."""
    radius = float(network.packing.radii[particle])
    unit = radius**2
    system = made_system(network, model)
    times, flows, contacts, means = marched(system, model, unit)
    sides, rows = system.sides, particle_sides(system, particle)
    theta = position_angles(sides.arms[rows])
    arcs = [ContactArc(float(t), float(a)) for t, a in zip(theta, sides.alpha[rows], strict=True)]
    truth = heat_disk_by_flows(arcs, times, flows[:, rows], FOURIER * unit, radius=radius, steps=steps)

    def at_outputs(values: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(np.log(FOURIER * unit), np.log(times[1:]), c[1:]) for c in values.T], axis=-1)

    return Inside(
        at_outputs(means[:, [particle]])[:, 0],
        at_outputs(contacts[:, rows]),
        truth.mean_temperature.values,
        truth.arc_temperature.values,
    )


def deviations(found: Inside) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Error of the mean, largest error of a contact, largest distance of a contact from the mean; all (t,) [K]."""
    return (
        np.abs(found.mean - found.true_mean),
        np.abs(found.contacts - found.true_contacts).max(axis=1),
        np.abs(found.true_contacts - found.true_mean[:, None]).max(axis=1),
    )


def draw(path: Path, results: dict[tuple[str, str], Inside]) -> None:
    """Temperatures by the finest model, and the errors of all models; a row for each disk."""
    figure, panels = new_panels(2, 2, 4.4)
    grid = panels.reshape(2, 2)
    for row, place in zip(grid, dict.fromkeys(place for place, _ in results), strict=True):
        found = results[place, "standard with dipoles"]
        row[0].plot(FOURIER, found.true_mean, color=INK, linewidth=2.0, label="true mean")
        for k in range(found.contacts.shape[1]):
            colour = COLOURS[k % len(COLOURS)]
            row[0].plot(FOURIER, found.true_contacts[:, k], color=colour, linewidth=1.2, label=f"contact {k + 1}, true")
            row[0].plot(FOURIER, found.contacts[:, k], "--", color=colour, linewidth=1.0)
        row[0].set_title(f"disk {place} (dashed: contact by the model)", fontsize=TEXT)
        row[0].set_ylabel("temperature [K]")
        row[0].set_xscale("log")
        for k, model in enumerate(MODELS):
            mean, contact, _ = deviations(results[place, model])
            look = {"color": COLOURS[k], "marker": MARKERS[k], "markersize": 3, "linewidth": 1.0}
            row[1].set(xscale="log", yscale="log", ylim=(1e-8, 2.0), xlim=row[0].get_xlim())
            row[1].plot(FOURIER, contact, label=f"contacts, {model}", **look)
            mark_outside(row[1], FOURIER, mean, COLOURS[k])
            mark_outside(row[1], FOURIER, contact, COLOURS[k])
            row[1].plot(FOURIER, mean, color=COLOURS[k], linestyle=":", linewidth=1.0)
        away = deviations(results[place, "standard with dipoles"])[2]
        row[1].plot(FOURIER, away, color=INK, linewidth=1.6, label="farthest contact from the true mean")
        row[1].set_title("error of contacts, and (dotted) of the mean", fontsize=TEXT)
        row[1].set_ylabel("largest error, wall stepped by 1 K [K]")
        for axes in row:
            axes.set_xlabel("Fourier number  $\\kappa t/(\\rho c R^2)$ [-]")
    names: dict[str, object] = {}
    for axes in grid[0]:
        names |= dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    legend(figure, list(names.values()), list(names), loc="outside upper center", ncols=3)
    save(figure, path)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=HERE)
    output = parser.parse_args().output
    network = bed()
    results = {
        (place, model): inside(network, model, particle)
        for place, particle in chosen(network).items()
        for model in MODELS
    }
    lines = ["disk,fourier,quantity," + ",".join(model.replace(", ", " ") for model in MODELS)]
    for place in dict.fromkeys(place for place, _ in results):
        for row in (int(np.argmin(np.abs(np.log(FOURIER / wanted)))) for wanted in ROWS):
            for k, quantity in enumerate(("mean", "contacts", "farthest contact from the mean")):
                values = ",".join(f"{deviations(results[place, model])[k][row]:.2e}" for model in MODELS)
                lines.append(f"{place},{FOURIER[row]:.3g},{quantity},{values}")
    (output / "contact_heating.csv").write_text("\n".join(lines) + "\n")
    draw(output / "contact_heating.png", results)


if __name__ == "__main__":
    main()
