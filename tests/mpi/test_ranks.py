"""The same bits for any number of ranks; no rank hangs when another fails."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

STAND_IN = Path(__file__).parent.parent / "stand_in.py"
MPIEXEC = Path(sys.executable).with_name("mpiexec")
needs_mpi = pytest.mark.skipif(not MPIEXEC.exists(), reason="no mpiexec beside python: install the extra 'mpi'")

STUDY = """
schema = 2
name = "ranks"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.7, 0.6, 0.65, 0.75]
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[conduction]
method = ["chord", "arc"]
[statistics]
realizations = 6
"""


def ranks(count: int, *command: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    launcher = [str(MPIEXEC), "-n", str(count)] if count else []
    return subprocess.run(
        [*launcher, sys.executable, *command], capture_output=True, text=True, check=False, timeout=timeout
    )


def stand_in(count: int, *arguments: object, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    return ranks(count, str(STAND_IN), *map(str, arguments), timeout=timeout)


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(STUDY)
    return path


@needs_mpi
def test_the_same_bits_for_any_number_of_ranks(study, tmp_path):
    """With units and cells that fail in every way, and messages."""
    results = {}
    for count in (0, 1, 2, 4):
        output = tmp_path / f"out{count}.nc"
        done = stand_in(count, study, "-o", output, "--seconds", 0.02, "--trouble")
        assert done.returncode == 4, done.stderr
        assert not output.with_name(output.name + ".shards").exists()
        results[count] = open_dataset(output)
    for count in (1, 2, 4):
        assert differing_variables(results[0], results[count]) == []
    assert len(set(results[4]["worker_rank"].values.ravel().tolist())) > 1  # the four did share the work


@needs_mpi
def test_contact_angle_curves_are_the_same_on_two_ranks_and_say_how_they_were_solved(study, tmp_path):
    study.write_text(
        STUDY.replace("[2.5, 5.0]", "[2.0, 4.0, 6.0, 8.0, 10.0, 12.0]")
        .replace("0.01:0.02", "0.02:0.03")
        .replace("[0.7, 0.6, 0.65, 0.75]", "0.75")
        .replace('["chord", "arc"]', '"chord"')
        .replace("realizations = 6", "realizations = 2")
    )
    results = []
    for count in (0, 2):
        output = tmp_path / f"curve{count}.nc"
        done = ranks(count, "-m", "etc_engine", "sweep", str(study), "-o", str(output))
        assert done.returncode == 0, done.stderr
        results.append(open_dataset(output))
    assert differing_variables(*results) == []
    words, snapshots = (results[0][name].values for name in ("solved_by", "snapshots"))
    assert set(words.ravel().tolist()) == {"full", "reduced"}
    np.testing.assert_array_equal(snapshots > 0, words == "reduced")


SPHERES = """
schema = 2
name = "spheres"
seed = 20263
[packing]
method = "lubachevsky-stillinger"
radii = "equal:0.14"
box = [1.0, 1.0, 1.0]
periodic = "xyz"
density = [0.60, 0.72]
[contacts]
rule = "bonded"
bond_gap = 0.05
contact_angle = [2.0, 8.0]
[conduction]
method = ["chord", "exact"]
[statistics]
realizations = 3
"""


@needs_mpi
def test_spheres_have_the_same_bits_for_any_number_of_ranks(study, tmp_path):
    study.write_text(SPHERES)
    results = []
    for count in (0, 2, 4):
        output = tmp_path / f"spheres{count}.nc"
        assert ranks(count, "-m", "etc_engine", "sweep", str(study), "-o", str(output)).returncode == 4
        results.append(open_dataset(output))
    assert differing_variables(results[0], results[1]) == differing_variables(results[0], results[2]) == []
    assert (results[0]["status"].sel(density=0.72) == 2).all()


@needs_mpi
def test_adaptive_rounds_are_the_same_for_any_number_of_ranks(study, tmp_path):
    study.write_text(STUDY + "relative_ci = 0.02\nmax_realizations = 60\n")
    results = []
    for count in (0, 3):
        assert stand_in(count, study, "-o", tmp_path / f"out{count}.nc").returncode == 0
        results.append(open_dataset(tmp_path / f"out{count}.nc"))
    assert differing_variables(results[0], results[1]) == []
    assert results[0].sizes["realization"] == 60
    assert 6 < results[0]["count"].max() <= 60


@needs_mpi
def test_a_warning_to_the_launcher_stops_all_ranks_and_another_number_of_ranks_goes_on(study, tmp_path):
    output, log = tmp_path / "out.nc", tmp_path / "log"
    options = ["-o", str(output), "--seconds", "0.2", "--log", str(log)]
    running = subprocess.Popen(
        [str(MPIEXEC), "-n", "2", sys.executable, str(STAND_IN), str(study), *options],
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 60.0
    while not log.exists() or len(log.read_text().splitlines()) < 4:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    running.send_signal(signal.SIGTERM)
    _, errors = running.communicate(timeout=60)
    assert running.returncode == 75, errors
    assert sum("stopped early (SIGTERM)" in line for line in errors.splitlines()) == 1
    before = len(log.read_text().splitlines())
    resumed = stand_in(3, study, *options, "--policy", "resume")
    assert resumed.returncode == 0, resumed.stderr
    assert f"{before} of 24 units are finished already" in resumed.stderr
    assert len(log.read_text().splitlines()) == 24  # none was computed twice
    assert stand_in(0, study, "-o", tmp_path / "whole.nc").returncode == 0
    assert differing_variables(open_dataset(output), open_dataset(tmp_path / "whole.nc")) == []


@needs_mpi
def test_a_wrong_study_is_one_line_and_status_2_on_two_ranks(study, tmp_path):
    study.write_text(STUDY.replace("realizations", "realisations"))
    done = stand_in(2, study, "-o", tmp_path / "out.nc")
    assert done.returncode == 2
    lines = [line for line in done.stderr.splitlines() if line.startswith("etc-engine")]
    assert len(lines) == 1
    assert "did you mean 'realizations'" in lines[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["study.toml"]


@needs_mpi
@pytest.mark.parametrize("guilty", [0, 1])
def test_an_error_of_the_program_on_one_rank_ends_all(study, tmp_path, guilty):
    """What no unit catches: without MPI_Abort the other rank would wait for ever."""
    code = (
        "import sys, pathlib\nimport etc_engine.sweep.sweep as s\nfrom etc_engine.cli.sweep import launch\n"
        f"exec(open({str(STAND_IN)!r}).read().split('def main')[0])\n"
        "run = s.run_unit\n"
        "def broken(study, spec, unit, rank, realize):\n"
        f"    if rank == {guilty}: raise MemoryError('no room')\n"
        "    wait(0.2, False)\n    return run(study, spec, unit, rank, realize)\n"
        "s.run_unit = broken\n"
        "launch(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), 'fresh', realize)\n"
    )
    done = ranks(2, "-c", code, str(study), str(tmp_path / "out.nc"), timeout=60)
    assert done.returncode == 1, done.stderr
    assert f"unexpected MemoryError on rank {guilty}: no room" in done.stderr
    assert not (tmp_path / "out.nc").exists()
    resumed = stand_in(0, study, "-o", tmp_path / "out.nc", "--policy", "resume")
    assert resumed.returncode == 0, resumed.stderr


@needs_mpi
def test_the_counter_gives_each_number_once():
    code = (
        "import sys\nfrom etc_engine.sweep.scheduler import connect\nc = connect()\n"
        "mine = [c.add(0, 1) for _ in range(500)]\n"
        "everyone = c.gather(mine)\nc.wait_for_all(lambda: None)\nc.close()\n"
        "if c.rank == 0:\n"
        "    assert sorted(sum(everyone, [])) == list(range(1500))\n"
        "    assert all(m == sorted(m) for m in everyone)\n    print('each once')\n"
    )
    done = ranks(3, "-c", code)
    assert done.stdout.strip() == "each once", done.stderr


@needs_mpi
def test_ranks_without_an_mpi_library_are_refused_not_multiplied(study, tmp_path):
    """mpi4py raises RuntimeError where it finds no library: each rank would run the whole sweep alone."""
    done = subprocess.run(
        [str(MPIEXEC), "-n", "2", sys.executable, str(STAND_IN), str(study), "-o", str(tmp_path / "out.nc")],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "MPI4PY_LIBMPI": str(tmp_path / "none.so")},
        timeout=60,
    )
    assert done.returncode == 2
    assert "2 processes, but mpi4py finds no MPI library" in done.stderr
    assert not (tmp_path / "out.nc").exists()


def test_one_process_needs_no_mpi_at_all(study, tmp_path):
    code = (
        "import sys\nsys.modules['mpi4py'] = None\n"
        f"sys.argv = ['stand_in', {str(study)!r}, '-o', {str(tmp_path / 'out.nc')!r}]\n"
        f"import runpy; runpy.run_path({str(STAND_IN)!r}, run_name='__main__')"
    )
    done = ranks(0, "-c", code)
    assert done.returncode == 0, done.stderr
    assert open_dataset(tmp_path / "out.nc").sizes["realization"] == 6


BETWEEN_WALLS = """
schema = 2
name = "between walls"
seed = 20263
[packing]
method = "lubachevsky-stillinger"
radii = "equal"
count = 24
box = [2e-3, 2e-3, 4e-3]
periodic = "xy"
density = 0.5
[particles]
material = "alumina"
[pores]
gas = "helium"
pressure = [1e3, 1e5]
accommodation = 0.4
[radiation]
emissivity = 0.6
[conduction]
temperature = 800.0
nonlinear = true
temperature_difference = [100.0, 600.0]
[statistics]
realizations = 3
"""


@needs_mpi
@pytest.mark.slow
def test_properties_at_the_local_temperature_have_the_same_bits_on_any_number_of_ranks(tmp_path):
    pytest.importorskip("CoolProp")
    (tmp_path / "study.toml").write_text(BETWEEN_WALLS)
    found = []
    for count in (0, 2, 3):
        out = tmp_path / f"{count}.nc"
        done = ranks(count, "-m", "etc_engine", "sweep", str(tmp_path / "study.toml"), "-o", str(out), timeout=600.0)
        assert done.returncode == 0, done.stderr
        found.append(open_dataset(out))
    assert (found[0]["status"] == 0).all()
    assert float(found[0]["heat_imbalance"].max()) < 1e-9
    assert [differing_variables(found[0], other) for other in found[1:]] == [[], []]
