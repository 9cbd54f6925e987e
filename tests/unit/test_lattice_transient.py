"""Transients on lattices: exact series, conserved heat, walls, safe steps."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.engines.lattice.body import SURFACE, ball_lattice, carve
from etc_engine.engines.lattice.calibration import pack_lattice
from etc_engine.engines.lattice.exact import ball_temperature, slab_temperature
from etc_engine.engines.lattice.network import contact_lattice, laguerre_lattice, link_conductances
from etc_engine.engines.lattice.transient import heat_system, safe_step
from etc_engine.errors import GeometryError, InputError
from etc_engine.medium.walls import Convective, FixedTemperature, HeatFlux, Insulated
from etc_engine.solvers.marching import critical_step, march

K, RHO_C, LENGTH = 33.0, 7800.0 * 0.9, 0.1
TIMES = (0.0, 0.05, 0.1, 0.2)


@pytest.fixture(scope="module")
def lattice():
    packing = pack_lattice(1200, (LENGTH,) * 3, np.random.default_rng(613), periodic=(False,) * 3, density=0.5)
    return laguerre_lattice(packing)


def slab(lattice, **walls):
    conditions = {2: FixedTemperature(25.0), 3: FixedTemperature(35.0)} | walls
    return heat_system(lattice, link_conductances(lattice, K), RHO_C, conditions)


@pytest.mark.parametrize(
    ("scheme", "steps"), [("explicit-euler", None), ("backward-euler", 400), ("crank-nicolson", 60), ("bdf2", 60)]
)
def test_the_slab_follows_the_exact_series(lattice, scheme, steps):
    system = slab(lattice)
    length = {"steps": steps} if steps else {"step": safe_step(lattice, system)}
    y = lattice.packing.centers[:, 1]
    for state in march(system, np.full(lattice.count, 25.0), TIMES, scheme=scheme, **length):
        if state.time > 0.0:
            exact = slab_temperature(
                y, state.time, diffusivity=K / RHO_C, length=LENGTH, initial=25.0, low=25.0, high=35.0
            )
            assert np.abs(state.temperatures / exact - 1.0).max() < 0.012  # 0.01 by the spacing, N^(-2/3)
        assert abs(state.imbalance) < 1e-9 * RHO_C * LENGTH**3 * 10.0


def test_the_safe_step_is_safe(lattice):
    """At the safe step no temperature leaves the range of the data; beyond the critical one the march is refused."""
    system = slab(lattice)
    dt = safe_step(lattice, system)
    assert dt <= critical_step(system)
    *_, last = march(system, np.full(lattice.count, 25.0), [0.0, 0.05], scheme="explicit-euler", step=dt)
    assert last.temperatures.min() >= 25.0 - 1e-9
    assert last.temperatures.max() <= 35.0 + 1e-9
    with pytest.raises(InputError, match="exceeds the critical one"):
        list(
            march(
                system, np.full(lattice.count, 25.0), [0.0, 0.05], scheme="explicit-euler",
                step=1.05 * critical_step(system),
            )
        )  # fmt: skip


def test_mass_is_conserved_on_both_lattices(lattice):
    contacts = contact_lattice(lattice.packing)
    for body in (lattice, contacts):
        assert body.volumes.sum() == pytest.approx(LENGTH**3, rel=1e-12)


def test_a_source_warms_an_insulated_body(lattice):
    system = heat_system(lattice, link_conductances(lattice, K), RHO_C, {0: Insulated()}, source=1e4)
    *_, last = march(system, np.full(lattice.count, 20.0), [0.0, 3.0], steps=10)
    assert last.temperatures == pytest.approx(20.0 + 3e4 / RHO_C, rel=1e-9)
    assert last.heat == pytest.approx([0.0, 1e4 * LENGTH**3 * 3.0], abs=1e-9)


def test_flux_in_and_convection_out_come_to_the_exact_steady_state(lattice):
    q, h, ambient = 2000.0, 500.0, 300.0
    walls = {4: HeatFlux(q), 5: Convective(h, ambient)}
    system = heat_system(lattice, link_conductances(lattice, K), RHO_C, walls)
    *_, last = march(system, np.full(lattice.count, 300.0), [0.0, 200.0], scheme="backward-euler", steps=60)
    exact = ambient + q / h + q / K * (LENGTH - lattice.packing.centers[:, 2])
    assert np.abs(last.temperatures - exact).max() < 1e-5
    assert system.heat_rates is not None
    assert system.heat_rates(200.0, last.temperatures)[:2] == pytest.approx([q * 0.01, -q * 0.01], rel=1e-6)


def test_the_centre_of_a_ball_follows_the_exact_series():
    """Aluminium ball: the error falls with the squared spacing of the particles."""
    worst = []
    for count in (800, 6400):
        ball = ball_lattice(0.05, count, np.random.default_rng(77))
        assert ball.volumes.sum() == pytest.approx(4.0 / 3.0 * np.pi * 0.05**3, rel=2e-6)
        conditions = {SURFACE: FixedTemperature(200.0)}
        system = heat_system(ball, link_conductances(ball, 185.0), 2700.0 * 900.0, conditions)
        r = np.linalg.norm(ball.packing.centers - 0.5 * np.asarray(ball.packing.box.lengths), axis=1)
        body = {"diffusivity": 185.0 / (2700.0 * 900.0), "radius": 0.05, "initial": 20.0, "surface": 200.0}
        states = march(system, np.full(ball.count, 20.0), [0.0, 2.0, 5.0, 10.0], steps=30)
        errors = [np.abs(s.temperatures - ball_temperature(r, s.time, **body)).max() for s in states if s.time > 0.0]
        worst.append(max(errors))
    assert worst[1] < 1.5  # of 180 K
    assert worst[1] < 0.45 * worst[0]


def test_a_ball_of_contacts_has_the_ball_s_mass_and_surface():
    ball = ball_lattice(0.05, 500, np.random.default_rng(79), transmission="contact", coefficient=0.755)
    assert ball.volumes.sum() == pytest.approx(4.0 / 3.0 * np.pi * 0.05**3, rel=1e-12)
    ends = ball.packing.centers[ball.wall_particles] + ball.wall_crossings - 0.5 * np.asarray(ball.packing.box.lengths)
    cut = np.linalg.norm(ends, axis=1)
    assert np.abs(cut / 0.05 - 1.0).max() < 0.003
    assert (np.abs(cut - 0.05) < 1e-12).mean() > 0.9


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda b: heat_system(b, link_conductances(b), 0.0, {}), "heat capacities must be positive"),
        (lambda b: heat_system(b, link_conductances(b), 1.0, {6: Insulated()}), "no node is linked to wall 6"),
        (lambda b: safe_step(ball_lattice(1.0, 60, np.random.default_rng(3)), slab(b)), "1200 nodes"),
        (lambda _: ball_lattice(-1.0, 60, np.random.default_rng(3)), "radius of a ball"),
        (lambda _: ball_lattice(1.0, 60, np.random.default_rng(3), transmission="x"), "unknown transmission"),
        (lambda b: carve(b, np.zeros(b.count, dtype=bool)), "no node lies within"),
        (
            lambda _: ball_temperature(0.0, 0.0, diffusivity=1.0, radius=1.0, initial=0.0, surface=1.0),
            "after the start",
        ),
    ],
)
def test_bad_input_is_one_clear_line(lattice, work, message):
    with pytest.raises((InputError, GeometryError), match=message):
        work(lattice)
