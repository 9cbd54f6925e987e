"""``etc-engine transient`` on the frames of a dump."""

import numpy as np
import pytest
import xarray as xr

from etc_engine.box import Box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.dumps import write_trajectory
from etc_engine.particle_files.trajectory import Trajectory
from etc_engine.transient import states

STUDY = """
schema = 2
kind = "network"
name = "shaken bed"
[packing]
files = "bed.dump"
[conduction]
engine = "pipe"
[particles]
conductivity = 2.0
heat_capacity = 3.0
initial = { value = 0.0, gradient = [0.0, 1.0] }
[walls]
bottom = { type = "fixed", value = 1.0 }
top = { type = "convective", value = 0.0, coefficient = 5.0 }
[motion]
timestep = 0.001
[time]
steps = 2
"""


@pytest.fixture
def bed(tmp_path):
    """Disks that jump a little from frame to frame, between two walls; the study beside them."""
    rng = np.random.default_rng(57)
    grid = (np.stack(np.meshgrid(np.arange(5), np.arange(5)), -1).reshape(-1, 2) + 0.5) / 5
    radii = rng.uniform(0.1, 0.106, 25)
    box = Box((1.0, 1.0), (True, False))
    packings = [ParticlePacking(grid + rng.uniform(-0.004, 0.004, (25, 2)), radii, box) for _ in range(9)]
    trajectory = Trajectory(0.01 * np.arange(9.0), packings, rng.permutation(np.arange(100, 125)))
    write_trajectory(tmp_path / "bed.dump", trajectory, timestep=0.001)
    (tmp_path / "study.toml").write_text(STUDY)
    return tmp_path


def test_a_moving_bed_from_dump_to_series(etc_engine, bed):
    files = [bed / name for name in ("out.nc", "panel.png", "bed.pvd")]
    done = etc_engine("transient", bed / "study.toml", "-o", files[0], "--plot", files[1], "--vtk", files[2])
    assert done.returncode == 0, done.stderr
    data = xr.open_dataset(files[0])
    assert data["x"].dims == data["radius"].dims == ("time", "particle")
    assert data["id"].values.tolist() == list(range(100, 125))
    np.testing.assert_allclose(data["time"], 0.01 * np.arange(9.0))
    assert int(data["opened_contacts"].sum()) > 5
    assert int(data["closed_contacts"].sum()) > 5
    change = (data["temperature"] - data["temperature"].isel(time=0)) @ data["heat_capacity"]
    np.testing.assert_allclose(data["stored_heat"], change, atol=1e-13)
    heat = data["wall_heat"].sum("wall") + data["source_heat"]
    np.testing.assert_allclose(data["stored_heat"], heat, atol=1e-12)
    np.testing.assert_allclose(data["heat_capacity"], 3.0 * np.pi * data["radius"].isel(time=0) ** 2)
    assert data["wall_heat_flow"].sel(wall="bottom")[-1] > 0.0
    assert files[1].stat().st_size > 10_000
    assert len(list((bed / "bed").glob("*.vtp"))) == 9


def test_it_goes_on_from_its_last_state_with_the_same_bits(etc_engine, bed, monkeypatch):
    assert etc_engine("transient", bed / "study.toml", "-o", bed / "whole.nc").returncode == 0
    write, written = states.write_atomically, []

    def full(path, content):
        if path.name == "state-000004.npz" and not written:
            written.append(path)
            raise OSError(28, "No space left on device")
        write(path, content)

    monkeypatch.setattr(states, "write_atomically", full)
    assert etc_engine("transient", bed / "study.toml", "-o", bed / "cut.nc").returncode == 2
    again = etc_engine("transient", bed / "study.toml", "-o", bed / "cut.nc", "--resume")
    assert again.returncode == 0
    assert "4 of them from before" in again.stderr
    whole, cut = xr.open_dataset(bed / "whole.nc"), xr.open_dataset(bed / "cut.nc")
    assert set(whole.variables) == set(cut.variables)
    for name in whole.variables:
        assert whole[name].values.tobytes() == cut[name].values.tobytes(), name


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('files = "bed.dump"', 'files = "none.dump"', "there is no file"),
        (
            'files = "bed.dump"',
            'files = "bed.dump"\nframes = 2',
            "needs a dump in packing.files, with all of its frames",
        ),
        ("steps = 2", "step = 0.01", "give the steps from frame to frame"),
        ("steps = 2", "steps = 2\ntimes = [0.0, 1.0]", "the output times are those of the frames"),
        ("timestep = 0.001", "timestep = 0.0", "motion.timestep"),
        ("timestep = 0.001", "timestep = 1e300", "motion.timestep: found 1e+300, allowed: a positive number"),
        ("timestep = 0.001", "timestep = 1e-320", "motion.timestep: found 1e-320, allowed: a positive number"),
        ("timestep = 0.001", "", "motion.timestep: missing, expected a positive number"),
        ("timestep = 0.001", "timestep = 0.001\nexpansion = -3.0", "no radius"),
        ("[motion]\ntimestep = 0.001", "", "time.times: missing"),
    ],
)
def test_what_is_refused(etc_engine, bed, old, new, words):
    assert old in STUDY
    (bed / "study.toml").write_text(STUDY.replace(old, new))
    done = etc_engine("transient", bed / "study.toml", "-o", bed / "out.nc")
    assert done.returncode == 2
    assert words in done.stderr
    assert not (bed / "out.nc").exists()


def change(path, frame, edit):
    """Rewrite one frame of a dump."""
    parts = path.read_text().split("ITEM: TIMESTEP\n")
    parts[frame + 1] = edit(parts[frame + 1])
    path.write_text("ITEM: TIMESTEP\n".join(parts))


def lifted(text):
    """The particles of a frame raised from the bottom wall."""
    head, names, rows = text.partition("ITEM: ATOMS id type x y z radius\n")
    table = [line.split() for line in rows.splitlines()]
    raised = [" ".join([*row[:3], repr(0.03 + 0.95 * float(row[3])), *row[4:]]) for row in table]
    return head + names + "\n".join(raised) + "\n"


def test_a_bare_flux_wall_names_its_frame_and_keeps_the_states(etc_engine, bed):
    study = bed / "study.toml"
    study.write_text(STUDY.replace('bottom = { type = "fixed"', 'bottom = { type = "flux"'))
    change(bed / "bed.dump", 6, lifted)
    done = etc_engine("transient", study, "-o", bed / "out.nc")
    assert done.returncode == 2
    assert "frame 6 (t = 0.06 s): no particle touches the bottom wall" in done.stderr
    assert len(list((bed / "out.nc.states").glob("*.npz"))) == 6
    change(bed / "bed.dump", 0, lifted)
    done = etc_engine("transient", study, "-o", bed / "new.nc")
    assert "frame 0 (t = 0 s): no particle touches the bottom wall" in done.stderr
    assert not (bed / "new.nc.states").exists()


def test_steps_of_all_frames_are_counted(etc_engine, bed):
    (bed / "study.toml").write_text(STUDY.replace("steps = 2", "steps = 500_000_000"))
    done = etc_engine("transient", bed / "study.toml", "-o", bed / "out.nc")
    assert "4e+09 steps in total" in done.stderr


def test_one_frame_and_a_cut_number_are_refused(etc_engine, bed):
    text = (bed / "bed.dump").read_text()
    (bed / "bed.dump").write_text(text[:-3])  # the last radius has lost its last digits, and would be read
    done = etc_engine("transient", bed / "study.toml", "-o", bed / "out.nc")
    assert "frame 8 is cut short" in done.stderr
    (bed / "bed.dump").write_text(text[: text.index("ITEM: TIMESTEP", 1)])
    done = etc_engine("transient", bed / "study.toml", "-o", bed / "out.nc")
    assert "holds one frame, so there is nothing to march" in done.stderr
