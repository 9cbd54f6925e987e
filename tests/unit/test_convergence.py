"""Statistics over the first n realizations, and over systems of several sizes."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.comparison import running_statistics, simulated, system_sizes
from etc_engine.errors import InputError

STUDY = """
schema = 2
name = "made"
seed = 20263
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.6, 0.7]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = 12
"""


def conduct(density, angle, method, realization):
    if realization in (3, 7):
        return None  # a failed packing enters nowhere
    rng = np.random.default_rng([20267, int(1000 * density), int(angle), realization])
    return tuple(density + 1e-3 * rng.normal(size=2))


def test_running_statistics_are_those_of_the_first_realizations(made_sweep):
    dataset = made_sweep(STUDY, conduct)
    running = running_statistics(dataset)
    for n in range(1, 13):
        first = simulated(made_sweep(STUDY.replace("= 12", f"= {n}"), conduct))
        part = running.isel(realization=n - 1, drop=True)
        assert np.allclose(part["mean"], first["conductivity_mean"], rtol=1e-14)
        expected = first["half_width"].values
        assert np.allclose(part["half_width"], expected, rtol=1e-9, equal_nan=True)
        assert np.isnan(expected).all() == (n == 1)


def test_systems_are_sorted_by_size_and_must_be_of_one_study(made_sweep):
    one = made_sweep(STUDY, conduct)
    two = made_sweep(STUDY.replace("[1.0, 1.0]", "[2.0, 2.0]"), lambda *a: 2.0 * a[0])
    two["particles"] = 4 * two["particles"]
    systems = system_sizes([two, one])
    assert systems["particles"].mean(["density"]).values.tolist() == [100.0, 400.0]
    assert np.allclose(systems["conductivity_mean"].isel(system=1).sel(density=0.6), 1.2)
    assert (systems["relative_spread"].isel(system=1) < 1e-12).all()
    assert (systems["relative_spread"].isel(system=0) > 1e-4).all()
    with pytest.raises(InputError, match=r"result 2 belongs to another study: packing.density is 0.6"):
        system_sizes([one, made_sweep(STUDY.replace("[0.6, 0.7]", "0.6"), conduct)])
