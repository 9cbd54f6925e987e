from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from etc_engine.box import Box
from etc_engine.engines.pipe.steady import pipe_conductivity
from etc_engine.errors import InputError
from etc_engine.laws.disk import chord_resistance
from etc_engine.medium.medium import medium_of
from etc_engine.medium.rules import bonded_contacts, overlap_contacts
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated, TimeTable
from etc_engine.packing import PackingSpec, ParticlePacking, pack, parse_radii
from etc_engine.realization import transient_system
from etc_engine.solvers.marching import SCHEMES, critical_step, march
from etc_engine.structure.union import union_area

ALPHA = 0.15


def chain(n: int):
    """n touching disks of unit diameter in a row between two walls."""
    centers = np.stack([np.arange(n) + 0.5, np.full(n, 1.0)], axis=1)
    return bonded_contacts(ParticlePacking(centers, np.full(n, 0.5), Box((float(n), 2.0))), ALPHA)


def of_chain(contacts: int):
    """Conductance of a pipe pair and capacity of a disk that so many chords cut."""
    segment = 0.25 * (ALPHA - np.sin(ALPHA) * np.cos(ALPHA))
    return 0.5 / chord_resistance(ALPHA), 0.25 * np.pi - contacts * segment


@pytest.fixture(scope="module")
def random_network():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((1.0, 1.0)))
    return bonded_contacts(pack(spec, np.random.default_rng(11)), np.radians(8.0), 1e-3)


def control(scheme, system, span):
    if scheme == "adaptive":
        return {"tolerance": 1e-4}
    if scheme == "explicit-euler":
        return {"step": 0.9 * critical_step(system)}
    return {"step": span / 40}


def test_ring_of_disks_follows_the_cosine_exactly():
    """In a periodic row a cosine decays as exp(-2 C (1 - cos k) t / c), with C the pipe and c the disk."""
    n = 12
    centers = np.stack([np.arange(n) + 0.5, np.full(n, 1.0)], axis=1)
    network = bonded_contacts(ParticlePacking(centers, np.full(n, 0.5), Box((float(n), 2.0), (True, False))), ALPHA)
    C, c = of_chain(2)
    system = transient_system(medium_of(network, 2.0, heat_capacity=3.0), {}, engine="pipe")
    k = 2.0 * np.pi / n
    initial = system.initial(lambda centers: 5.0 + np.cos(k * centers[:, 0]))
    span = 4.0
    *_, last = march(system.heat, initial, [0.0, span], scheme="adaptive", tolerance=1e-9)
    decay = np.exp(-2.0 * 2.0 * C * (1.0 - np.cos(k)) * span / (3.0 * c))
    assert 0.1 < decay < 0.9
    expected = 5.0 + decay * np.cos(k * centers[:, 0])
    assert system.particle_temperatures(last.temperatures) == pytest.approx(expected, abs=1e-7)


def test_row_between_fixed_walls_follows_its_slowest_sine_exactly():
    """A wall contact is half a pipe pair: by mirror images the modes are sin(m pi x / L) at the centres."""
    n = 8
    C, c = of_chain(2)
    system = transient_system(
        medium_of(chain(n), heat_capacity=1.0),
        {"left": FixedTemperature(0.0), "right": FixedTemperature(0.0)},
        engine="pipe",
    )
    x = np.arange(n) + 0.5
    for m in (1, 3):
        shape = np.sin(m * np.pi * x / n)
        *_, last = march(system.heat, system.initial(shape), [0.0, 1.5], scheme="adaptive", tolerance=1e-9)
        decay = np.exp(-2.0 * C * (1.0 - np.cos(m * np.pi / n)) * 1.5 / c)
        assert last.temperatures == pytest.approx(decay * shape, abs=1e-7)


def test_one_disk_under_a_convective_wall_is_a_lumped_body():
    """The film and the wall's pipe are in series: T = T_a (1 - exp(-t/tau))."""
    system = transient_system(
        medium_of(chain(1).with_resistance(0.4), heat_capacity=1.0),
        {"left": Convective(0.7, 10.0)},
        engine="pipe",
    )
    series = 1.0 / (0.7 * 2.0) + chord_resistance(ALPHA) + 0.4
    _, c = of_chain(2)  # the insulated right wall is bonded too
    tau = c * series
    *_, last = march(system.heat, system.initial(0.0), [0.0, 2.0 * tau], scheme="adaptive", tolerance=1e-9)
    expected = 10.0 * (1.0 - np.exp(-2.0))
    assert system.particle_temperatures(last.temperatures)[0] == pytest.approx(expected, rel=1e-7)
    # the plate lies between: the film's part of the drop
    plate = system.wall_temperatures(last.time, last.temperatures)
    assert plate[0] == pytest.approx(10.0 - (10.0 - expected) / (0.7 * 2.0 * series), rel=1e-7)
    assert np.isnan(plate[1:]).all()


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(
    "walls",
    [
        {"left": FixedTemperature(TimeTable((0.0, 0.02), (0.0, 3.0))), "right": FixedTemperature(1.0)},
        {"left": HeatFlux(lambda t: np.cos(100.0 * t)), "top": FixedTemperature(1.0)},
        {"left": Convective(5.0, lambda t: 300.0 * t), "right": HeatFlux(-2.0), "bottom": Insulated()},
        {},
    ],
)
def test_heat_stored_is_the_heat_that_came_in(random_network, walls, scheme):
    n = random_network.packing.count
    source = np.zeros(n)
    source[: n // 2] = 0.3
    system = transient_system(
        medium_of(random_network, heat_capacity=2.0),
        walls,
        engine="pipe",
        source=lambda t: source * (1.0 + t),
    )
    begin = system.initial(lambda centers: centers[:, 1])
    states = list(march(system.heat, begin, [0.0, 0.02, 0.05], scheme=scheme, **control(scheme, system.heat, 0.05)))
    last = states[-1]
    risen = system.particle_temperatures(last.temperatures) - system.particle_temperatures(begin)
    stored = system.capacities @ risen
    assert last.heat.sum() == pytest.approx(stored, abs=1e-11 * np.abs(last.heat).sum())
    assert stored > 0.001
    assert last.heat[-1] == pytest.approx(source.sum() * (0.05 + 0.5 * 0.05**2), rel=2e-2)
    for wall, name in enumerate(("left", "right", "bottom", "top")):
        assert (last.heat[wall] == 0.0) == isinstance(walls.get(name, Insulated()), Insulated)


@pytest.mark.parametrize("scheme", ["backward-euler", "bdf2", "adaptive"])
def test_late_times_are_the_steady_network(random_network, scheme):
    steady = pipe_conductivity(medium_of(random_network.with_resistance(0.1)), axes=(0,), tolerance=1e-14)
    walls = {"left": FixedTemperature(1.0), "right": FixedTemperature(0.0)}
    system = transient_system(
        medium_of(random_network.with_resistance(0.1), heat_capacity=1.0),
        walls,
        engine="pipe",
    )
    times = [0.0, 20.0, 40.0]
    given = {"tolerance": 1e-6} if scheme == "adaptive" else {"steps": 60}
    _, before, last = march(system.heat, system.initial(0.5), times, scheme=scheme, **given)
    T = steady.solutions[0].temperatures[:, 0]
    known = np.isfinite(T)
    abs_error = 1e-5 if scheme == "adaptive" else 1e-9
    assert last.temperatures[known] == pytest.approx(T[known], abs=abs_error)
    assert last.temperatures[~known] == pytest.approx(0.5)  # a rattler keeps its heat
    rates = (last.heat - before.heat) / 20.0
    assert rates[0] == pytest.approx(steady.tensor[0, 0], rel=1e-4 if scheme == "adaptive" else 1e-9)
    assert rates[1] == pytest.approx(-steady.tensor[0, 0], rel=1e-4 if scheme == "adaptive" else 1e-9)


def test_a_rattler_keeps_its_heat_to_the_last_bit():
    packing = ParticlePacking([[0.5, 0.5], [1.5, 0.5], [0.3, 1.5]], [0.5, 0.5, 0.1], Box((2.0, 2.0)))
    system = transient_system(
        medium_of(bonded_contacts(packing, 0.1), heat_capacity=1.0),
        {"left": FixedTemperature(1.0)},
        engine="pipe",
    )
    initial = system.initial([0.1, 0.2, 0.7])
    for scheme in SCHEMES:
        given = {"tolerance": 1e-3} if scheme == "adaptive" else {"step": 0.05}
        *_, last = march(system.heat, initial, [0.0, 1.0], scheme=scheme, **given)
        assert last.temperatures[2] == pytest.approx(0.7, abs=1e-15)


@given(seed=st.integers(2, 10_000), scheme=st.sampled_from(["backward-euler", "explicit-euler"]))
@settings(max_examples=15)
def test_maximum_principle(random_network, seed, scheme):
    rng = np.random.default_rng(seed)
    walls = {"left": FixedTemperature(rng.uniform()), "right": Convective(rng.uniform(0.1, 10.0), rng.uniform())}
    system = transient_system(
        medium_of(random_network, heat_capacity=rng.uniform(0.5, 2.0, random_network.packing.count)),
        walls,
        engine="pipe",
    )
    initial = system.initial(rng.uniform(size=random_network.packing.count))
    h = 0.5 * critical_step(system.heat) if scheme == "explicit-euler" else rng.uniform(1e-4, 1.0)
    bounds = [value for c in walls.values() for value in (c.temperature(0.0),)]
    for state in march(system.heat, initial, h * np.arange(4), scheme=scheme, steps=1):
        T = state.temperatures
        low, high = min([initial.min(), *bounds]), max([initial.max(), *bounds])
        assert low - 1e-12 <= T.min() <= T.max() <= high + 1e-12


def test_explicit_steps_beyond_the_critical_one_are_refused(random_network):
    system = transient_system(
        medium_of(random_network, heat_capacity=1.0),
        {"left": Convective(3.0, 1.0)},
        engine="pipe",
    )
    critical = critical_step(system.heat)
    with pytest.raises(InputError, match=f"exceeds the critical one of {critical:.6g} s"):
        list(march(system.heat, system.initial(0.0), [0.0, 1.1 * critical], scheme="explicit-euler", steps=1))


def test_capacity_is_that_of_the_union_of_overlapping_disks(feng_particles):
    """Chords, walls included, cut every overlap exactly once."""
    system = transient_system(medium_of(overlap_contacts(feng_particles), heat_capacity=2.0), {}, engine="pipe")
    assert system.heat.capacity.sum() == pytest.approx(2.0 * union_area(feng_particles), rel=1e-12)


def test_time_scales_with_capacity_over_conductivity(random_network):
    walls = {"left": FixedTemperature(1.0)}
    slow = transient_system(medium_of(random_network, 2.0, heat_capacity=6.0), walls, engine="pipe")
    fast = transient_system(medium_of(random_network, heat_capacity=1.0), walls, engine="pipe")
    *_, a = march(slow.heat, slow.initial(0.0), [0.0, 0.3], steps=20)
    *_, b = march(fast.heat, fast.initial(0.0), [0.0, 0.1], steps=20)
    assert a.temperatures == pytest.approx(b.temperatures, abs=1e-12)
    assert a.heat == pytest.approx(6.0 * b.heat, rel=1e-10, abs=1e-13)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"walls": {"west": Insulated()}}, "unknown wall 'west': expected one of left, right, bottom, top"),
        ({"walls": {"top": HeatFlux(1.0)}}, "no particle touches the top wall"),
        ({"heat_capacity": 0.0}, "the heat capacity must be positive and finite, found 0"),
        ({"source": np.ones(3)}, "the source must be one finite number or 4 of them"),
        ({"method": "round"}, "has no method 'round': expected one of chord, uniform"),
    ],
)
def test_what_is_refused(change, message):
    given = {"walls": {}, "heat_capacity": 1.0} | change
    with pytest.raises(InputError, match=message):
        medium = medium_of(chain(4), heat_capacity=given.pop("heat_capacity"))
        transient_system(medium, given.pop("walls"), engine="pipe", **given)


def test_initial_values_and_periodic_walls_that_are_refused(hexagonal):
    network = bonded_contacts(hexagonal(), 0.1)
    with pytest.raises(InputError, match="the box is periodic across the left wall"):
        transient_system(medium_of(network, heat_capacity=1.0), {"left": HeatFlux(1.0)}, engine="pipe")
    system = transient_system(medium_of(network, heat_capacity=1.0), {"left": Insulated()}, engine="pipe")
    with pytest.raises(InputError, match="initial temperature must be one finite number or 2 of them"):
        system.initial([1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="initial temperature must be"):
        system.initial(lambda centers: centers)
