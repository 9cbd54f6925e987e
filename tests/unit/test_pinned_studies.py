"""The numbers of the shipped studies do not change: small copies of them against the engine before schema 2.

Pinned: mean of the diagonal of one realization, computed by commit 5dc8e58 (x86_64). The bits agreed on that machine;
the tolerance leaves room for another processor. Studies by the advancing front are not here: that packer was mended
since, see its history.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from etc_engine.realization import realize
from etc_engine.study.sweep import parse_study
from etc_engine.sweep.plan import Unit, unit_rng

STUDIES = Path(__file__).parents[2] / "studies"

SHIPPED = {
    "rve_size": ("rve_size/study.toml", {}, [0.352520319201769]),
    "disks": (
        "random_composites/disks.toml",
        {r"density = \[.*?\]": "density = [0.1]", "resolution = 512": "resolution = 192"},
        [0.8446284879610548, 1.1839668211129615, 1.234116821334752],
    ),
}
NETWORKS = """
schema = 2
name = "pinned"
seed = 20297
[packing]
method = "lubachevsky-stillinger"
radii = "uniform:0.01:0.02"
count = 60
box = [1.0, 1.0]
periodic = "xy"
density = [0.6, 0.7]
[particles]
conductivity = 2.0
mixture = { conductivity = 10.0, fraction = 0.3 }
[contacts]
rule = "coordination"
coordination = 4.0
contact_angle = [3.0, 5.0, 8.0, 12.0]
contact_resistance = 0.1
[conduction]
CONDUCTION
[statistics]
realizations = 2
"""
"""Half-angles by a reduced basis, a mixture and a resistance."""

BY_METHOD = {
    'method = ["chord", "standard"]': [
        0.83948701827282,
        0.817726870879894,
        0.939558805139495,
        0.9100412143479655,
        1.057394626044187,
        1.0156684288017674,
        1.1890645437815408,
        1.1289051253570745,
    ],
    'engine = "pipe"\nmethod = ["chord", "uniform"]': [
        0.8523527115243472,
        0.8299640702621753,
        0.9554427400822562,
        0.92499566159506,
        1.0770751731366093,
        1.0339262731893883,
        1.2131330574723385,
        1.15079512828909,
    ],
}


def diagonals(study, density: float, realization: int) -> list[float]:
    """Mean of the diagonal of every cell."""
    stream = unit_rng(study.seed, Unit(density, realization))
    return [float(np.trace(cell.conductivity)) / 2.0 for cell in realize(study.realization_spec(density), stream).cells]


@pytest.mark.parametrize("name", SHIPPED)
def test_the_first_realization_is_that_of_the_engine_before(name):
    path, changes, pinned = SHIPPED[name]
    text = (STUDIES / path).read_text()
    for pattern, replacement in changes.items():
        text, count = re.subn(pattern, replacement, text)
        assert count == 1
    study = parse_study(text)
    assert diagonals(study, study.densities[0], 0) == pytest.approx(pinned, rel=1e-12)


@pytest.mark.parametrize("words", BY_METHOD)
def test_networks_conduct_as_in_the_engine_before(words):
    study = parse_study(NETWORKS.replace("CONDUCTION", words))
    # some disks have a little of the close contacts that chord has learnt since
    assert diagonals(study, 0.7, 1) == pytest.approx(BY_METHOD[words], rel=1e-6 if "chord" in words else 1e-12)
