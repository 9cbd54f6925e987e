"""Warnings of `solve` about walls with few contacts and about bonds narrower than an overlap."""

import numpy as np

from etc_engine.box import Box
from etc_engine.medium.rules import bonded_contacts
from etc_engine.medium.sample_warnings import bare_wall_warnings, narrow_bond_warnings
from etc_engine.packing import PackingSpec, pack, parse_radii
from etc_engine.packing.particles import ParticlePacking


def test_a_wall_with_few_contacts_is_named_with_how_many_fit():
    """A square lattice of 20 x 20 disks without the row at the far wall of y, but for two of its disks."""
    x, y = np.meshgrid(np.arange(20), np.arange(20), indexing="ij")
    kept = (y < 19) | (x < 2)
    centers = 0.05 * (np.column_stack((x[kept], y[kept])) + 0.5)
    network = bonded_contacts(ParticlePacking(centers, np.full(len(centers), 0.025), Box((1.0, 1.0))), 0.1)
    assert bare_wall_warnings(network, (0,)) == []
    (sentence,) = bare_wall_warnings(network, (0, 1), (0.0, 10.0))
    assert sentence.startswith("only 2 particles touch the driven wall y = 11, where about 20 fit side by side")


def test_walls_without_contacts_are_left_to_the_other_warning():
    network = bonded_contacts(ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0))), 0.1)
    assert bare_wall_warnings(network, (0, 1)) == []


def test_the_default_packer_leaves_a_wall_of_this_box_bare():
    spec = PackingSpec("advancing-front", parse_radii("uniform:0.02:0.04"), Box((8.0, 8.0)))
    network = bonded_contacts(pack(spec, np.random.default_rng(1)), np.radians(5.0))
    (sentence,) = bare_wall_warnings(network, (0, 1))
    assert "only 16 particles touch the driven wall y = 0, where about 134 fit" in sentence


def test_bonds_narrower_than_the_overlap_are_counted():
    centers = [[0.25, 0.5], [0.70, 0.5], [1.25, 0.5]]
    packing = ParticlePacking(centers, [0.25, 0.3, 0.25], Box((1.5, 1.0)))
    narrow, wide = (narrow_bond_warnings(bonded_contacts(packing, np.radians(angle))) for angle in (5.0, 60.0))
    assert wide == []
    assert narrow[0].startswith("1 pair overlaps more widely than its bond: the bond is the contact")
