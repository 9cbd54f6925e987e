"""The 1084-disk assembly of the discrete thermal element method.

Y. T. Feng, K. Han, C. F. Li, D. R. J. Owen, Discrete thermal element modelling of heat conduction in particle
systems: basic formulations, J. Comput. Phys. 227 (2008) 5072-5089, doi:10.1016/j.jcp.2008.01.031, second
example: 1084 disks with radii uniform in [0.01, 0.02] fill the unit square, with 2102 contacts.
"""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.packing import neighbor_pairs, parse_radii
from etc_engine.packing.advancing_front import pack_advancing_front

PUBLISHED_DISKS = 1084
PUBLISHED_CONTACTS = 2102


@pytest.fixture(scope="module")
def realizations():
    box, radii = Box((1.0, 1.0)), parse_radii("uniform:0.01:0.02")
    return [pack_advancing_front(radii, box, np.random.default_rng(7100 + k)) for k in range(40)]


def test_number_of_disks(realizations):
    counts = np.array([packing.count for packing in realizations])
    assert (np.abs(counts / PUBLISHED_DISKS - 1.0) < 0.05).all()


def test_mean_coordination(realizations):
    published = 2 * PUBLISHED_CONTACTS / PUBLISHED_DISKS
    assert published == pytest.approx(3.88, abs=0.005)
    coordination = np.array(
        [2 * neighbor_pairs(packing, relative_gap=1e-6).count / packing.count for packing in realizations]
    )
    assert abs(coordination.mean() - published) < 0.06
    assert (np.abs(coordination - published) < 0.1).all()


def test_area_fraction(realizations):
    published = PUBLISHED_DISKS * np.pi * (0.02**3 - 0.01**3) / 0.03
    densities = np.array([packing.density for packing in realizations])
    assert (np.abs(densities - published) < 0.03).all()
