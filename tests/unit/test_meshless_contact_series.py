"""One disk of a network under the heat flows of its march: elements with and without dipoles, constant flows, pipes."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.contacts import bonded_contacts
from etc_engine.dtem.sides import contact_sides
from etc_engine.dtem.transient import contact_flows, particle_sides, transient_system
from etc_engine.meshless import ContactArc, heat_disk_by_flows, heat_disk_through_arcs
from etc_engine.packing import ParticlePacking
from etc_engine.pipe.conductances import pipe_conductances
from etc_engine.pipe.flows import pipe_contact_flows
from etc_engine.pipe.transient import pipe_transient
from etc_engine.solvers.marching import march
from etc_engine.walls import FixedTemperature

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
        system = transient_system(row, WALLS, method="standard", dipoles=dipoles)
        times = np.concatenate([[0.0], np.geomspace(1e-4, 3.0, 120)]) * 0.25
        states = list(march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-5))
        rows = particle_sides(system, 0)
        flows = np.array([contact_flows(system, s.time, s.temperatures)[rows] for s in states])
        arcs = [ContactArc(float(t), ALPHA) for t in system.sides.theta[rows]]
        truth = heat_disk_by_flows(arcs, times, flows, fourier * 0.25, radius=0.5, decades=2)
        assert np.all(np.diff(truth.time.values) > 0.0)
        means = np.array([system.particle_temperatures(s.temperatures)[0] for s in states])
        np.testing.assert_allclose(truth.mean_temperature, np.interp(fourier * 0.25, times, means), atol=1e-3)
        nodes = system.sides.nodes[rows]
        contacts = np.array([system.contact_temperatures(s.time, s.temperatures)[nodes] for s in states])
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
    pipes = pipe_transient(row, WALLS, resistance="uniform", conductivity=2.0, contact_resistance=0.3)
    sides = contact_sides(row)
    *_, state = march(pipes.heat, pipes.initial(0.0), [0.0, 0.2], steps=10)
    means = pipes.particle_temperatures(state.temperatures)
    walls = pipes.wall_temperatures(state.time, state.temperatures)
    given = {"resistance": "uniform", "conductivity": 2.0, "contact_resistance": 0.3}
    flows = pipe_contact_flows(row, sides, means, walls, **given)
    into = np.bincount(sides.particles, flows, minlength=2)
    np.testing.assert_allclose(into, pipes.heat.slope(state.time, state.temperatures)[:2], atol=1e-13)
    between, _ = pipe_conductances(row, **given)
    assert flows[sides.of_contacts[0, 1]] == pytest.approx(between[0] * (means[0] - means[1]))
