"""The simulation of studies/scaling in cases that can be worked out by hand."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

SCRIPT = Path(__file__).parents[2] / "studies" / "scaling" / "analyse.py"


@pytest.fixture(scope="module")
def scaling():
    spec = importlib.util.spec_from_file_location("scaling", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    sys.modules["scaling"] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def free(scaling):
    """A machine on which nothing but computing takes time."""
    nothing = dict.fromkeys(("latency", "service", "append", "create", "sync", "opening", "decode"), 0.0)
    return replace(scaling.Costs(), **nothing, join=0.0, assemble=0.0, poll=0.0)


def test_equal_units_that_fill_all_ranks_are_fully_efficient(scaling, free):
    assert scaling.simulate(8, np.full(24, 2.0), free).efficiency == pytest.approx(1.0)


def test_a_last_unit_alone_leaves_the_others_idle(scaling, free):
    assert scaling.simulate(2, np.full(3, 1.0), free).efficiency == pytest.approx(0.75)


def test_greedy_scheduling_keeps_grahams_bound(scaling, free):
    """Graham (1966), Bounds for certain multiprocessing anomalies, Bell System Technical Journal 45, 1563-1581,
    doi:10.1002/j.1538-7305.1966.tb01709.x: in any order the end is at most sum/m + (1 - 1/m) max."""
    rng = np.random.Generator(np.random.PCG64(1966))
    for ranks in (2, 3, 7):
        times = rng.uniform(0.1, 3.0, 40)
        last = scaling.simulate(ranks, times, free).last
        assert max(times.sum() / ranks, times.max()) <= last + 1e-12
        assert last <= times.sum() / ranks + (1.0 - 1.0 / ranks) * times.max() + 1e-12


def test_a_saturated_counter_serves_one_after_the_other(scaling, free):
    slow = replace(free, service=1.0, operations=1)
    assert scaling.simulate(10, np.zeros(90), slow).last == pytest.approx(100.0)  # 90 units and 10 refusals


def test_without_hardware_the_others_wait_for_rank_0(scaling, free):
    """Rank 0 takes 10 s for its unit, the other is ready after 1 s and has to wait."""
    soft = replace(free, hardware_atomics=False)
    times = np.array([10.0, 1.0, 1.0, 1.0])
    assert scaling.simulate(2, times, free).last == pytest.approx(10.0)
    assert scaling.simulate(2, times, soft).last > 11.0 - 1e-9
