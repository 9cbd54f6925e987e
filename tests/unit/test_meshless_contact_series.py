"""One disk of a network under the heat flows of its march: elements with and without dipoles, constant flows, pipes."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.engines.dtem.transient import contact_temperatures
from etc_engine.engines.meshless import ContactArc, flow_histories, heat_disk_by_flows, heat_disk_through_arcs
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.errors import InputError
from etc_engine.laws.disk import position_angles
from etc_engine.medium.conductances import contact_conductances
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts
from etc_engine.medium.transient import particle_sides
from etc_engine.medium.walls import FixedTemperature
from etc_engine.packing import ParticlePacking
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import march

ALPHA = np.radians(15.0)
WALLS = {"left": FixedTemperature(1.0)}


@pytest.fixture(scope="module")
def row():
    """Two touching disks between a hot and an insulated wall."""
    return bonded_contacts(ParticlePacking([[0.5, 1.0], [1.5, 1.0]], [0.5, 0.5], Box((2.0, 2.0))), ALPHA)


def test_a_disk_of_a_march_is_truly_as_warm_as_the_elements_say(row):
    """Means at all times; contacts once they are quasi-steady, with dipoles before that without."""
    fourier = np.array([0.03, 0.3, 3.0])
    errors = {}
    for dipoles in (False, True):
        system = transient_system(medium_of(row, heat_capacity=1.0), WALLS, method="standard", dipoles=dipoles)
        times = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 120)]) * 0.25
        states = list(march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-5))
        rows = particle_sides(system, 0)
        flows = np.array([system.flows(s.time, s.temperatures)[rows] for s in states])
        arcs = [ContactArc(float(t), ALPHA) for t in position_angles(system.sides.arms[rows])]
        truth = heat_disk_by_flows(arcs, times, flows, fourier * 0.25, radius=0.5, decades=2)
        assert np.all(np.diff(truth.time.values) > 0.0)
        means = np.array([system.particle_temperatures(s.temperatures)[0] for s in states])
        np.testing.assert_allclose(truth.mean_temperature, np.interp(fourier * 0.25, times, means), atol=1e-3)
        nodes = system.sides.nodes[rows]
        contacts = np.array([contact_temperatures(system, s.time, s.temperatures)[nodes] for s in states])
        at = np.stack([np.interp(fourier * 0.25, times, column) for column in contacts.T], axis=-1)
        errors[dipoles] = np.abs(truth.arc_temperature.values - at).max(axis=1)
    assert errors[False][2] < 0.02  # the flux still changes
    assert errors[True][2] < 0.004
    assert errors[True][1] < 0.4 * errors[False][1]
    assert errors[True][0] > 0.1  # no dipole sees so early a time


def test_constant_flows_are_the_disk_under_constant_heat():
    arcs = [ContactArc(0.3, 0.4), ContactArc(2.5, 0.3)]
    series = heat_disk_by_flows(arcs, [0.0, 1.0], [[1.0, -0.4]] * 2, [0.1, 1.0], steps=100)
    direct = heat_disk_through_arcs(arcs, [1.0, -0.4], [0.1, 1.0], scheme="laplace")
    np.testing.assert_allclose(series.arc_temperature, direct.arc_temperature, atol=3e-3)
    np.testing.assert_allclose(series.mean_temperature, direct.mean_temperature, atol=1e-3)


def test_pipe_flows_feed_the_particles(row):
    pipes = transient_system(
        medium_of(row.with_resistance(0.3), 2.0, heat_capacity=1.0), WALLS, engine="pipe", method="uniform"
    )
    sides = pipes.sides
    *_, state = march(pipes.heat, pipes.initial(0.0), [0.0, 0.2], steps=10)
    means = pipes.particle_temperatures(state.temperatures)
    flows = pipes.flows(state.time, state.temperatures)
    into = np.bincount(sides.particles, flows, minlength=2)
    np.testing.assert_allclose(into, pipes.heat.slope(state.time, state.temperatures)[-2:], atol=1e-13)
    between, _ = contact_conductances(pipes.medium, "standard")
    assert flows[sides.of_contacts[0, 1]] == pytest.approx(between[0] * (means[0] - means[1]))


def test_pipe_flows_at_rest_are_those_of_the_steady_network(row):
    system = transient_system(
        medium_of(row, heat_capacity=1.0), WALLS | {"right": FixedTemperature(0.0)}, engine="pipe"
    )
    *_, late = march(system.heat, system.initial(0.5), [0.0, 400.0], steps=100)
    flows = system.flows(late.time, late.temperatures)
    steady = pipe_conductivity(medium_of(row), axes=(0,)).solutions[0]
    np.testing.assert_allclose(np.abs(flows[np.abs(flows) > 1e-9]), abs(steady.flows[0, 0]), rtol=1e-8)
    np.testing.assert_allclose(np.bincount(system.sides.particles, flows), 0.0, atol=1e-12)


def test_no_such_particle(row):
    with pytest.raises(InputError, match="no particle 2: they are numbered from 0 to 1"):
        particle_sides(transient_system(medium_of(row, heat_capacity=1.0), WALLS), 2)


@pytest.mark.parametrize(
    ("times", "flows", "outputs", "words"),
    [
        ([0.0], [[1.0]], [0.0], "at least two increasing times"),
        ([0.0, 0.0], [[1.0], [1.0]], [0.0], "at least two increasing times"),
        ([0.0, 1.0], [[1.0], [np.nan]], [0.5], "finite values"),
        ([0.0, 1.0], [[1.0], [1.0]], [2.0], "within the march from 0 to 1 s"),
        ([0.5, 1.0], [[1.0], [1.0]], [0.7], "within the march"),
    ],
)
def test_flows_that_are_not_understood(times, flows, outputs, words):
    with pytest.raises(InputError, match=words):
        heat_disk_by_flows([ContactArc(0.0, 0.3)], times, flows, outputs)


def test_histories_are_linear_between_the_times_and_constant_outside():
    (history,) = flow_histories([1.0, 3.0], [[2.0], [4.0]])
    assert [history(t) for t in (0.0, 2.0, 9.0)] == [2.0, 3.0, 4.0]
