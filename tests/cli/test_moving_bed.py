"""The study of the sheared bed, in small: its motion, its dump, and the heat it carries."""

import sys
from pathlib import Path

import numpy as np
import pytest

from etc_engine.packing.neighbors import neighbor_pairs
from etc_engine.particle_files.dumps import read_trajectory, write_trajectory

STUDY = Path(__file__).parents[2] / "studies" / "moving_bed"


@pytest.fixture(scope="module")
def study():
    sys.path.insert(0, str(STUDY))
    try:
        import analyse
        import bed

        yield bed, analyse
    finally:
        sys.path.remove(str(STUDY))
        for name in ("analyse", "bed"):
            sys.modules.pop(name, None)


@pytest.fixture(scope="module")
def small(study):
    return study[0].sheared_bed(strain=0.4, frames=40)


def test_the_bed_shears_and_its_disks_overlap_little(small):
    first, last = small.packings[0], small.packings[-1]
    moved = first.box.minimum_image(last.centers - first.centers)[:, 0]
    assert np.corrcoef(moved, first.centers[:, 1])[0, 1] > 0.9
    for packing in small.packings[::10]:
        gaps = neighbor_pairs(packing).gaps / packing.radii.mean()
        assert gaps.min(initial=0.0) > -0.1


def test_heat_goes_with_the_disks_and_is_conserved(study, small):
    states = study[1].sheared(small, 0.1)
    last = states[-1]
    assert sum(state.opened for state in states) > 10
    assert abs(last.stored - last.heat.sum()) < 1e-11 * np.abs(last.heat).max()
    assert 0.0 <= last.temperatures.min() <= last.temperatures.max() <= 1.0


def test_the_dump_holds_the_bed(small, tmp_path):
    write_trajectory(tmp_path / "bed.dump", small, timestep=0.01)
    back = read_trajectory(tmp_path / "bed.dump", timestep=0.01)
    assert len(back.packings) == 41
    np.testing.assert_array_equal(back.packings[7].centers, small.packings[7].centers)
