"""One entry for all packing methods: exact count and density, refusals, the same bits in every process."""

from __future__ import annotations

import hashlib
import subprocess
import sys

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError, PackingError
from etc_engine.packing import METHODS, PackingSpec, neighbor_pairs, pack, parse_radii
from etc_engine.packing.overlap import largest_overlap

BOX = Box((1.0, 1.5))


@pytest.mark.parametrize("word", ["equal", "uniform:1:2", "lognormal:1:0.3"])
@pytest.mark.parametrize(
    ("method", "density"), [("advancing-front", 0.72), ("lubachevsky-stillinger", 0.75), ("random-sequential", 0.42)]
)
def test_count_density_and_box_are_met_exactly(method, density, word):
    spec = PackingSpec(method, parse_radii(word), BOX, 500, density, 0.2)
    packing = pack(spec, np.random.default_rng(911))
    assert packing.count == 500
    assert packing.density == pytest.approx(density, rel=1e-12)
    assert largest_overlap(packing) <= 1e-10


def test_the_front_keeps_its_tangencies_among_vacancies():
    spec = PackingSpec("advancing-front", parse_radii("uniform:1:2"), BOX, 800, 0.7)
    packing = pack(spec, np.random.default_rng(913))
    assert 3.2 < 2 * neighbor_pairs(packing, relative_gap=1e-6).count / packing.count < 3.8


def test_the_front_grows_into_overlap_above_its_own_density():
    spec = PackingSpec("advancing-front", parse_radii("uniform:1:2"), BOX, 800, 0.9)
    packing = pack(spec, np.random.default_rng(915))
    assert (packing.count, packing.density) == (800, pytest.approx(0.9, rel=1e-12))
    assert largest_overlap(packing) > 0.01
    strict = PackingSpec("advancing-front", parse_radii("uniform:1:2"), BOX, 800, 0.9, radius_growth=False)
    with pytest.raises(PackingError, match="do not fit") as refusal:
        pack(strict, np.random.default_rng(915))
    assert 0.7 < refusal.value.reached < 0.85


def test_a_count_of_disks_of_given_radius():
    spec = PackingSpec("advancing-front", parse_radii("equal:0.03"), BOX, 200)
    assert pack(spec, np.random.default_rng(917)).count == 200
    with pytest.raises(PackingError, match="the box holds"):
        pack(PackingSpec("advancing-front", parse_radii("equal:0.03"), BOX, 5000), np.random.default_rng(917))
    with pytest.raises(InputError, match="needs a radius"):
        pack(PackingSpec("advancing-front", parse_radii("equal"), BOX, 200), np.random.default_rng(917))


SCRIPT = """
import hashlib, numpy as np
from etc_engine.box import Box
from etc_engine.packing import METHODS, PackingSpec, pack, parse_radii
for method in METHODS:
    spec = PackingSpec(method, parse_radii("uniform:1:2"), Box((1.0, 1.5)), 150, 0.4)
    packing = pack(spec, np.random.default_rng(919))
    print(hashlib.sha256(packing.centers.tobytes() + packing.radii.tobytes()).hexdigest())
"""


def test_every_process_makes_the_same_bits():
    elsewhere = subprocess.run([sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True)
    here = []
    for method in METHODS:
        spec = PackingSpec(method, parse_radii("uniform:1:2"), BOX, 150, 0.4)
        packing = pack(spec, np.random.default_rng(919))
        here.append(hashlib.sha256(packing.centers.tobytes() + packing.radii.tobytes()).hexdigest())
    assert elsewhere.stdout.split() == here
    assert len(set(here)) == len(METHODS)


@pytest.mark.parametrize("method", ["advancing-front", "lubachevsky-stillinger", "random-sequential"])
def test_more_particles_than_a_machine_holds_are_refused(method):
    spec = PackingSpec(method, parse_radii("equal:1e-9"), Box((1.0, 1.0)), density=0.5)
    with pytest.raises(InputError, match=r"about 1.59e\+17 particles, above 1e\+09: use larger radii"):
        pack(spec, np.random.default_rng(20261))
