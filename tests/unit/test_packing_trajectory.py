"""Particles followed through the frames of a dump."""

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.dumps import read_trajectory, write_trajectory
from etc_engine.particle_files.trajectory import Trajectory

HEAD = "ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS pp ff pp\n0 {length}\n0 1\n-0.5 0.5\n"


def dump(tmp_path, *frames, columns="id x y z radius", length=2.0):
    """Frames as (step, rows)."""
    text = ""
    for step, rows in frames:
        text += HEAD.format(step=step, count=len(rows), length=length) + f"ITEM: ATOMS {columns}\n"
        text += "".join(" ".join(map(str, row)) + "\n" for row in rows)
    path = tmp_path / "moving.dump"
    path.write_text(text)
    return path


def test_particles_keep_their_rows_whatever_the_order_in_the_file(tmp_path):
    path = dump(
        tmp_path,
        (100, [(7, 0.5, 0.5, 0, 0.2), (3, 1.5, 0.5, 0, 0.1)]),
        (300, [(3, 1.6, 0.5, 0, 0.1), (7, 0.6, 0.5, 0, 0.2)]),
    )
    trajectory = read_trajectory(path, timestep=0.01)
    np.testing.assert_allclose(trajectory.times, [0.0, 2.0])
    assert trajectory.ids.tolist() == [3, 7]
    np.testing.assert_allclose([p.centers[1, 0] for p in trajectory.packings], [0.5, 0.6])
    assert trajectory.packings[0].box == Box((2.0, 1.0), (True, False))


def test_a_trajectory_reads_back_bit_by_bit(tmp_path):
    rng = np.random.default_rng(29)
    box = Box((2.0, 1.0), (True, False))
    packings = [ParticlePacking(rng.random((5, 2)) * (2.0, 1.0), rng.uniform(0.1, 0.2, 5), box) for _ in range(3)]
    written = Trajectory([0.0, 0.5, 1.25], packings, [9, 4, 6, 2, 7])
    write_trajectory(tmp_path / "t.dump", written, timestep=0.25)
    back = read_trajectory(tmp_path / "t.dump", timestep=0.25)
    order = np.argsort(written.ids)
    np.testing.assert_array_equal(back.times, written.times)
    np.testing.assert_array_equal(back.ids, written.ids[order])
    for one, other in zip(back.packings, written.packings, strict=True):
        np.testing.assert_array_equal(one.centers, other.centers[order])
        np.testing.assert_array_equal(one.radii, other.radii[order])
    with pytest.raises(InputError, match="two frames on one step"):
        write_trajectory(tmp_path / "u.dump", written, timestep=2.0)


def test_a_particle_that_leaves_is_named(tmp_path):
    path = dump(tmp_path, (0, [(1, 0.5, 0.5, 0, 0.2), (2, 1.5, 0.5, 0, 0.1)]), (1, [(1, 0.5, 0.5, 0, 0.2)]))
    with pytest.raises(InputError, match=r"frame 1 does not hold the particles of frame 0 \(particle 2"):
        read_trajectory(path)


def test_frames_without_ids_are_refused(tmp_path):
    path = dump(tmp_path, (0, [(0.5, 0.5, 0, 0.2)]), columns="x y z radius")
    with pytest.raises(InputError, match="frame 0 has no column id"):
        read_trajectory(path)


def test_steps_that_do_not_increase_are_refused(tmp_path):
    row = [(1, 0.5, 0.5, 0, 0.2)]
    with pytest.raises(InputError, match="must increase, found 0 at frame 1"):
        read_trajectory(dump(tmp_path, (5, row), (5, row)))


@pytest.mark.parametrize("timestep", [0.0, -1.0, np.nan])
def test_a_time_step_is_positive(tmp_path, timestep):
    with pytest.raises(InputError, match="time step of a dump must be positive"):
        read_trajectory(dump(tmp_path, (0, [(1, 0.5, 0.5, 0, 0.2)])), timestep)


def places(*lengths):
    return [ParticlePacking([[0.5, 0.5]], [0.1], Box((length, 1.0))) for length in lengths]


@pytest.mark.parametrize(
    ("times", "packings", "ids", "words"),
    [
        ([], [], None, "one time per packing"),
        ([0.0], places(1.0, 1.0), None, "found 1 times, 2 packings"),
        ([0.0, 1.0], places(1.0, 2.0), None, "frame 1 has another box"),
        ([0.0], places(1.0), [1, 2], "1 different ids are needed"),
    ],
)
def test_what_is_no_trajectory_is_refused(times, packings, ids, words):
    with pytest.raises(InputError, match=words):
        Trajectory(times, packings, ids)
