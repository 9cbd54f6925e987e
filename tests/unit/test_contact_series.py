"""One particle heated by the flows of a network's march."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.contacts import bonded_contacts
from etc_engine.dtem.sides import contact_sides
from etc_engine.dtem.transient import contact_flows, particle_sides, transient_system
from etc_engine.errors import InputError
from etc_engine.meshless import ContactArc, flow_histories, heat_disk_by_flows
from etc_engine.packing.particles import ParticlePacking
from etc_engine.pipe.flows import pipe_contact_flows
from etc_engine.pipe.steady import pipe_conductivity
from etc_engine.pipe.transient import pipe_transient
from etc_engine.solvers.marching import march
from etc_engine.walls import FixedTemperature

WALLS = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}


@pytest.fixture(scope="module")
def row():
    """Three disks in a row between two walls."""
    centers = [[0.5, 0.5], [1.5, 0.5], [2.5, 0.5]]
    return bonded_contacts(ParticlePacking(centers, [0.5] * 3, Box((3.0, 1.0))), 0.2)


def test_the_inside_has_the_mean_and_at_late_times_the_contacts_that_the_element_has(row):
    system = transient_system(row, WALLS, method="standard")
    times = np.concatenate([[0.0], np.geomspace(1e-4, 4.0, 80)])
    states = list(march(system.heat, system.initial(0.0), times, scheme="adaptive", tolerance=1e-6))
    rows = particle_sides(system, 1)
    flows = np.array([contact_flows(system, state.time, state.temperatures)[rows] for state in states])
    arcs = [ContactArc(t, a) for t, a in zip(system.sides.theta[rows], system.sides.alpha[rows], strict=True)]
    truth = heat_disk_by_flows(arcs, times, flows, [0.25, 4.0], radius=0.5)
    late = states[-1]
    model = system.contact_temperatures(late.time, late.temperatures)[system.sides.nodes[rows]]
    mean = system.particle_temperatures(late.temperatures)[1]
    assert float(truth.mean_temperature[-1]) == pytest.approx(mean, abs=5e-3)
    np.testing.assert_allclose(truth.arc_temperature.values[-1] - mean, model - mean, atol=5e-3)
    # Fo = 1: the heat that went in is the mean's, whatever the element makes of the inside
    heat = np.trapezoid(flows.sum(axis=1)[times <= 0.25], times[times <= 0.25]) / (np.pi * 0.25)
    assert float(truth.mean_temperature[0]) == pytest.approx(heat, abs=5e-3)


def test_pipe_flows_at_rest_are_those_of_the_steady_network(row):
    system = pipe_transient(row, WALLS)
    *_, late = march(system.heat, system.initial(0.5), [0.0, 400.0], steps=100)
    sides = contact_sides(row)
    walls = system.wall_temperatures(late.time, late.temperatures)
    flows = pipe_contact_flows(row, sides, system.particle_temperatures(late.temperatures), walls)
    steady = pipe_conductivity(row, axes=(0,)).solutions[0]
    np.testing.assert_allclose(np.abs(flows[np.abs(flows) > 1e-9]), abs(steady.contact_flows[0, 0]), rtol=1e-8)
    np.testing.assert_allclose(np.bincount(sides.particles, flows), 0.0, atol=1e-12)


def test_no_such_particle(row):
    with pytest.raises(InputError, match="no particle 3: they are numbered from 0 to 2"):
        particle_sides(transient_system(row, WALLS), 3)


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
