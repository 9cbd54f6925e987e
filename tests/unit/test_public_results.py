"""What a user of Python meets: packings read with their columns, short words for results, a number where it is one."""

from __future__ import annotations

import numpy as np
import pytest

from etc_engine import (
    Box,
    Medium,
    ParticlePacking,
    bonded_contacts,
    effective_conductivity,
    field_along,
    overlap_contacts,
    read_particles,
    solid_fraction,
)
from etc_engine.errors import InputError

TEXT = "id,type,x,y,radius,conductivity\n10,a,0.25,0.5,0.26,2\n20,b,0.75,0.5,0.26,3\n"


@pytest.fixture
def disks(tmp_path):
    (tmp_path / "two.csv").write_text(TEXT)
    return read_particles(tmp_path / "two.csv", (1.0, 1.0))


def test_particles_of_a_file_are_a_packing_with_columns(disks):
    assert isinstance(disks, ParticlePacking)
    assert disks.columns["conductivity"].tolist() == [2.0, 3.0]
    assert disks.columns["ids"].tolist() == [10, 20]
    assert disks.columns["types"].tolist() == ["a", "b"]
    assert disks.select([1]).columns["ids"].tolist() == [20]
    assert disks.with_radii(disks.radii / 2).columns["ids"].tolist() == [10, 20]
    with pytest.raises(InputError, match="column 'ids' needs 1 rows"):
        ParticlePacking([[0.5, 0.5]], [0.1], Box((1.0, 1.0)), {"ids": np.arange(2)})


def test_every_function_of_a_packing_takes_it(disks):
    medium = Medium(disks, disks.columns["conductivity"], overlap_contacts(disks))
    assert 0.0 < effective_conductivity(medium).tensor[0, 0] < 3.0
    assert 0.3 < solid_fraction(disks) < 0.5


def test_box_crop_and_periodic_axes_replace_those_of_the_file(tmp_path):
    (tmp_path / "two.csv").write_text(TEXT)
    faces = read_particles(tmp_path / "two.csv", ((0.0, 1.0), (0.25, 0.75)), "x")
    assert faces.box == Box((1.0, 0.5), (True, False))
    cropped = read_particles(tmp_path / "two.csv", (1.0, 1.0), crop=((0.5, 1.0), None))
    assert (cropped.count, cropped.box.lengths, cropped.columns["ids"].tolist()) == (1, (0.5, 1.0), [20])


def test_the_conductivity_is_a_number_where_one_axis_was_asked_for(disks):
    touching = disks.with_radii(np.full(2, 0.25))
    medium = Medium(touching, 1.0, bonded_contacts(touching, 0.1))
    one = effective_conductivity(medium, axes=(0,))
    assert isinstance(one.conductivity, float)
    assert one.conductivity == one.tensor[0, 0]
    every = effective_conductivity(medium)
    assert every.conductivity is every.tensor


def test_words_of_results_are_one_short_line(disks):
    medium = Medium(disks, disks.columns["conductivity"], overlap_contacts(disks))
    result = effective_conductivity(medium, axes=(0,))
    for thing in (
        disks,
        medium,
        medium.network,
        result,
        field_along(medium, result, engine="dtem", method="chord", axis=0),
    ):
        assert len(repr(thing)) < 160, repr(thing)
        assert "\n" not in repr(thing)
    assert repr(result).startswith(f"<EffectiveConductivity: k along x {result.conductivity:.6g} W/(m K), ")
    assert repr(medium) == "<Medium: 2 particles of 2 to 3 W/(m K), 1 links by rule overlap>"
