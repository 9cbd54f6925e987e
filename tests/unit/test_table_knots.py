"""No scheme steps across the knots of a table; the heat of a source is the exact integral of its table."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.sparse import csr_matrix

from etc_engine import Box, Medium, ParticlePacking, bonded_contacts, march
from etc_engine.medium.transient import HeatSource
from etc_engine.medium.walls import FixedTemperature, HeatFlux, TimeTable
from etc_engine.realization.transients import transient_system
from etc_engine.solvers.marching import SCHEMES, HeatSystem

PULSE = TimeTable((1.0, 3.0, 5.0), (0.0, 1.0, 0.0))


def chain() -> Medium:
    disks = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    return Medium(disks, 1.0, bonded_contacts(disks, 0.2), heat_capacity=1.0)


def steps_of(scheme):
    return {} if scheme == "adaptive" else {"step": 0.01} if scheme == "explicit-euler" else {"steps": 7}


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_pulse_between_two_output_times_is_not_missed(scheme):
    """Source 0 at 1 s, 1 at 3 s, 0 at 5 s: 2 J/m; adaptive steps found nothing of it between 0 and 10 s."""
    source = HeatSource(lambda t: np.array([PULSE(t), 0.0]), PULSE.times)
    system = transient_system(chain(), {}, engine="pipe", source=source)
    *_, last = march(system.heat, system.initial(0.0), [0.0, 10.0], scheme=scheme, **steps_of(scheme))
    assert last.heat[-1] == pytest.approx(2.0, rel=1e-12)
    assert last.stored == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_pulse_of_a_wall_flux_is_not_missed(scheme):
    walls = {"left": HeatFlux(PULSE)}
    system = transient_system(chain(), walls, engine="pipe")
    *_, last = march(system.heat, system.initial(0.0), [0.0, 10.0], scheme=scheme, **steps_of(scheme))
    tolerance = 0.2 if scheme in ("backward-euler", "explicit-euler") else 1e-9  # rectangles in time
    assert last.heat[0] == pytest.approx(2.0, rel=tolerance)
    assert last.stored == pytest.approx(last.heat.sum(), rel=1e-9)


@pytest.mark.parametrize("scheme", ["crank-nicolson", "bdf2", "adaptive"])
def test_a_wall_that_is_hot_for_a_while_is_not_missed(scheme):
    table = TimeTable((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 1.0, 0.0))
    found = []
    for times in ([0.0, 3.5], [0.0, 1.0, 2.0, 3.0, 3.5]):
        system = transient_system(chain(), {"left": FixedTemperature(table)}, engine="pipe")
        extra = {"tolerance": 1e-5} if scheme == "adaptive" else {"step": 0.02}
        *_, last = march(system.heat, system.initial(0.0), times, scheme=scheme, **extra)
        found.append(system.particle_temperatures(last.temperatures))
    np.testing.assert_allclose(found[0], found[1], atol=2e-4)
    assert found[0].max() > 0.01


@pytest.mark.parametrize("scheme", ["crank-nicolson", "bdf2", "backward-euler"])
def test_a_restart_at_a_knot_gives_the_same_bits(scheme):
    source = lambda t: np.array([PULSE(t)])  # noqa: E731
    system = HeatSystem(np.ones(1), csr_matrix([[0.3]]), source, source=source, knots=PULSE.times)
    times = [0.0, 2.0, 3.0, 10.0]
    states = list(march(system, np.zeros(1), times, scheme=scheme, steps=4))
    *_, again = march(system, np.zeros(1), times, scheme=scheme, steps=4, restart=states[2])
    assert again.temperatures.tobytes() == states[-1].temperatures.tobytes()
    assert again.heat.tobytes() == states[-1].heat.tobytes()


def test_second_order_against_the_exact_solution():
    """dT/dt = f(t) - T with the pulse: T(10) by the variation of constants."""
    source = lambda t: np.array([PULSE(t)])  # noqa: E731
    system = HeatSystem(np.ones(1), csr_matrix([[1.0]]), source, source=source, knots=PULSE.times)
    t = np.linspace(1.0, 5.0, 400_001)
    exact = trapezoid(np.interp(t, PULSE.times, PULSE.values) * np.exp(t - 10.0), t)
    for scheme in ("crank-nicolson", "bdf2"):
        errors = [
            abs(list(march(system, np.zeros(1), [0.0, 10.0], scheme=scheme, steps=n))[-1].temperatures[0] / exact - 1.0)
            for n in (50, 100)
        ]
        assert np.log2(errors[0] / errors[1]) > 1.8
