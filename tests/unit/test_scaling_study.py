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


@pytest.fixture(scope="module")
def packing():
    spec = importlib.util.spec_from_file_location("scaling_packing", SCRIPT.with_name("packing.py"))
    module = importlib.util.module_from_spec(spec)
    sys.modules["scaling_packing"] = module
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("dimension", "own", "ranks", "expected"),
    [
        (2, 100.0, 4, 0.21),  # 10 x 10 in a corner: a layer on two sides, (11^2 - 10^2)/100
        (3, 1000.0, 8, 0.331),  # 10 x 10 x 10 in a corner
        (3, 1000.0, 1, 0.0),
        (3, 1000.0, 10**12, 0.728),  # inside: a layer on all sides, 12^3/10^3 - 1
    ],
)
def test_a_block_has_a_layer_of_copies_on_each_side_that_is_cut(packing, dimension, own, ranks, expected):
    assert packing.copied(own, ranks, dimension) == pytest.approx(expected, rel=1e-3)


def test_the_memory_of_a_rank_is_that_which_was_measured(packing):
    """MB above the libraries on 1, 2 and 4 ranks, as `tests/benchmarks/bench_distributed.py` has found them."""
    for costs, count, measured in (
        (packing.DISKS, 440_997, (672, 344, 172)),
        (packing.SPHERES, 194_540, (570, 291, 164)),
    ):
        for ranks, found in zip((1, 2, 4), measured, strict=True):
            memory = packing.forecast(count, ranks, costs).memory - costs.libraries
            assert memory / 1e6 == pytest.approx(found, rel=0.1)
