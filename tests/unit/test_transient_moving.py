"""Moving particles: temperatures go with them, contacts that open and close change no heat."""

from functools import partial

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.medium.conductances import contact_conductances
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import overlap_contacts
from etc_engine.medium.walls import FixedTemperature
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.trajectory import Trajectory
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import SCHEMES, march
from etc_engine.transient.moving import Stepping, ThermalExpansion, march_trajectory


def pipes(network, capacities, walls=None, **more):
    return transient_system(
        medium_of(network, more.pop("conductivity", 1.0)), walls or {}, engine="pipe", capacities=capacities, **more
    )


def elements(network, capacities, walls=None):
    return transient_system(medium_of(network), walls or {}, capacities=capacities)


def wandering(frames=12, count=24, seed=53, walls=True):
    """Disks that jump a little from frame to frame, with contacts that come and go."""
    rng = np.random.default_rng(seed)
    box = Box((1.0, 1.0), (True, not walls))
    side = 5
    grid = (np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)[:count] + 0.5) / side
    radii = rng.uniform(0.101, 0.106, count)
    packings = [ParticlePacking(grid + rng.uniform(-0.004, 0.004, (count, 2)), radii, box) for _ in range(frames)]
    return Trajectory(np.cumsum(rng.uniform(0.005, 0.02, frames)), packings)


@pytest.mark.parametrize("build", [pipes, elements])
@pytest.mark.parametrize("scheme", [name for name in SCHEMES if name != "explicit-euler"])
def test_heat_is_conserved_while_contacts_open_and_close(build, scheme):
    trajectory = wandering()
    capacities = np.linspace(1.0, 3.0, trajectory.count) * trajectory.packings[0].measures
    start = np.random.default_rng(54).uniform(0.0, 100.0, trajectory.count)
    states = list(
        march_trajectory(
            trajectory,
            overlap_contacts,
            build,
            start,
            heat_capacity=np.linspace(1.0, 3.0, trajectory.count),
            stepping=Stepping(scheme),
        )
    )
    assert sum(state.opened for state in states) > 10
    assert sum(state.closed for state in states) > 10
    total = capacities @ start
    for state in states:
        assert capacities @ state.temperatures == pytest.approx(total, rel=1e-13)
    spread = [np.std(state.temperatures) for state in states]
    assert (np.diff(spread) < 0.0).all()
    assert spread[-1] < 0.8 * spread[0]


def test_walls_and_storage_balance():
    trajectory = wandering()
    hot = {"bottom": FixedTemperature(1.0), "top": FixedTemperature(-0.5)}
    *_, last = march_trajectory(trajectory, overlap_contacts, partial(pipes, walls=hot, source=0.3), 0.0)
    assert last.stored == pytest.approx(last.heat.sum(), rel=1e-11)
    assert last.heat[2] > 0.0 > last.heat[3]
    duration = trajectory.times[-1] - trajectory.times[0]
    assert last.heat[-1] == pytest.approx(0.3 * trajectory.count * duration, rel=1e-12)


def test_particles_that_stay_are_the_plain_march():
    packing = wandering().packings[0]
    trajectory = Trajectory([0.0, 0.01, 0.02], [packing] * 3)
    start = np.random.default_rng(55).random(packing.count)
    *_, moved = march_trajectory(trajectory, overlap_contacts, pipes, start, stepping=Stepping("backward-euler", 3))
    system = pipes(overlap_contacts(packing), packing.measures)
    *_, plain = march(system.heat, system.initial(start), [0.0, 0.02], scheme="backward-euler", steps=6)
    np.testing.assert_allclose(moved.temperatures, plain.temperatures, rtol=1e-9)


def test_a_pair_exchanges_heat_only_while_it_touches():
    """The difference of two equal disks decays as exp(-2 C t / C_p) over the time in contact (exact)."""
    box, radius = Box((4.0, 1.0)), 0.3
    near, far = (ParticlePacking([[1.0, 0.5], [x, 0.5]], [radius, radius], box) for x in (1.58, 2.5))
    trajectory = Trajectory([0.0, 0.1, 0.3, 0.4], [near, far, near, near])
    states = list(march_trajectory(trajectory, overlap_contacts, pipes, [1.0, 0.0], stepping=Stepping(steps=200)))
    (conductance,), _ = contact_conductances(medium_of(overlap_contacts(near)))
    rate = 2.0 * conductance / (np.pi * radius**2)
    for state, touched in zip(states, (0.0, 0.1, 0.1, 0.2), strict=True):
        difference = state.temperatures[0] - state.temperatures[1]
        assert difference == pytest.approx(np.exp(-rate * touched), rel=1e-4)
    assert [(state.opened, state.closed) for state in states] == [(0, 0), (1, 0), (0, 1), (0, 0)]


def test_disks_that_expand_come_into_contact():
    box = Box((4.0, 1.0))
    apart = ParticlePacking([[1.0, 0.5], [1.605, 0.5]], [0.3, 0.3], box)
    trajectory = Trajectory([0.0, 1.0, 2.0], [apart] * 3)
    warm = partial(pipes, source=[0.02, 0.0])
    growth = ThermalExpansion(0.3, reference=0.0)
    states = list(march_trajectory(trajectory, overlap_contacts, warm, 0.0, expansion=growth))
    assert [state.contacts for state in states] == [0, 1, 1]
    assert states[1].radii[0] == pytest.approx(0.3 * (1.0 + 0.3 * states[1].temperatures[0]), rel=1e-14)
    assert states[1].temperatures[1] == 0.0 < states[2].temperatures[1]
    assert states[2].stored == pytest.approx(0.04, rel=1e-12)


def test_an_expansion_that_leaves_no_radius_is_refused():
    trajectory = wandering(frames=2)
    with pytest.raises(InputError, match="leaves particle 0 no radius at 5 K"):
        list(march_trajectory(trajectory, overlap_contacts, pipes, 5.0, expansion=ThermalExpansion(-0.5)))


def test_a_restart_gives_the_same_bits():
    trajectory = wandering()
    run = partial(
        march_trajectory, trajectory, overlap_contacts, partial(pipes, walls={"top": FixedTemperature(1.0)}), 0.0
    )
    states = list(run())
    again = list(run(restart=states[5]))
    assert [state.frame for state in again] == list(range(6, 12))
    for one, other in zip(states[6:], again, strict=True):
        assert one.temperatures.tobytes() == other.temperatures.tobytes()
        assert one.heat.tobytes() == other.heat.tobytes()
        assert (one.stored, one.steps, one.opened) == (other.stored, other.steps, other.opened)
