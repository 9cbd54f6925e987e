"""jobs/slurm.sh and jobs/slurm_array.sh on a real Slurm."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cluster_study import STUDY
from serving import until

from etc_engine.service.processes import batch_processes
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "jobs" / "slurm.sh"
STAND_IN = ROOT / "tests" / "stand_in.py"
UNITS = 8


@pytest.fixture
def submit(slurm, place, slow):
    """Hand in the study through jobs/slurm.sh, two ranks unless told otherwise; returns the number of the job."""

    def call(*options: str, seconds: float = 0.0) -> str:
        words = ["--ntasks=2", f"--output={place}/log", *options, str(SCRIPT), "study.toml", str(place / "out.nc")]
        return slurm.submit(*words, environment=slow(seconds), folder=place)

    return call


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The result of an uninterrupted run without Slurm."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "study.toml").write_text(STUDY)
    line = [sys.executable, str(STAND_IN), str(folder / "study.toml"), "-o", str(folder / "whole.nc")]
    subprocess.run(line, check=True, capture_output=True)
    return open_dataset(folder / "whole.nc")


def finished(place: Path) -> int:
    units = place / "units"
    return len(units.read_text().splitlines()) if units.exists() else 0


def ranks(place: Path) -> list[int]:
    """Processes of ranks, without their launchers."""
    found = []
    for number in batch_processes(place / "out.nc"):
        line = Path(f"/proc/{number}/cmdline").read_bytes()
        if str(STAND_IN.with_name("service")).encode() in line:
            found.append(number)
    return found


def leftovers() -> set[str]:
    return {path.name for path in Path("/dev/shm").glob("mpich_shm_*")}


def log(place: Path) -> str:
    return (place / "log").read_text()


@pytest.mark.parametrize("count", [1, 31, 32, 40, 64])
def test_the_number_of_ranks_alone_decides(slurm, count):
    """Nodes of 32 processors: 40 and 64 ranks take two of them."""
    line = ["sbatch", "--test-only", f"--ntasks={count}", str(SCRIPT), "study.toml", "out.nc"]
    done = subprocess.run(line, capture_output=True, text=True, check=False, env=slurm.environment)
    assert done.returncode == 0, done.stderr
    assert f"using {max(count, 1)} processors" in done.stderr
    assert ("n[1-2]" in done.stderr) == (count > 32)


def test_ranks_on_two_nodes_meet_through_the_mpi_of_the_environment(slurm, place):
    """Not through the Open MPI that Slurm's packages may bring along."""
    program = place / "which.py"
    program.write_text("from mpi4py import MPI\nprint(MPI.COMM_WORLD.Get_size(), MPI.Get_library_version()[:5])\n")
    words = ["--ntasks=3", "--nodes=2", f"--output={place}/log", f"--wrap=srun {sys.executable} {program}"]
    assert slurm.wait(slurm.submit(*words)) == "COMPLETED", log(place)
    assert log(place).splitlines() == ["3 MPICH"] * 3


def test_a_warning_before_the_time_limit_queues_the_job_again(slurm, submit, place, whole):
    job = submit(seconds=0.4)
    until(lambda: finished(place) >= 3)
    slurm.ask("scancel", "--signal=TERM", job)  # what --signal=TERM@120 does
    slurm.start_now(job)
    assert slurm.wait(job) == "COMPLETED", log(place)
    assert slurm.shown(job, "Restarts") == "1"
    assert "stopped early (SIGTERM)" in log(place)
    assert f"stopped early: queueing job {job} again" in log(place)
    assert finished(place) == UNITS
    assert differing_variables(open_dataset(place / "out.nc"), whole) == []


@pytest.mark.slow
def test_the_time_limit_itself(slurm, submit, place, whole):
    job = submit("--time=1", "--signal=TERM@40", seconds=20.0)
    until(lambda: (place / "log").exists() and "queueing" in log(place), 150.0)
    slurm.ask("scontrol", "update", f"JobId={job}", "TimeLimit=10")
    slurm.start_now(job)
    assert slurm.wait(job, seconds=280.0) == "COMPLETED", log(place)
    assert "stopped early (SIGTERM)" in log(place)
    assert differing_variables(open_dataset(place / "out.nc"), whole) == []


@pytest.mark.parametrize("delay", [0.0, 0.6])
def test_a_warning_in_the_first_seconds_queues_the_job_again(slurm, submit, place, delay):
    """While Python starts it ends the ranks with status 143; from then on with 75."""
    job = submit()
    until(lambda: ranks(place))
    time.sleep(delay)
    slurm.ask("scancel", "--signal=TERM", job)
    slurm.start_now(job)
    assert slurm.wait(job) == "COMPLETED", log(place)
    assert "queueing job" in log(place)
    assert open_dataset(place / "out.nc").sizes["realization"] == 4


def test_after_ranks_were_killed_the_job_continues_on_the_same_node(slurm, submit, place, whole):
    before = leftovers()
    job = submit("--nodelist=n1", seconds=0.4)
    until(lambda: finished(place) >= 3)
    for number in ranks(place):
        os.kill(number, signal.SIGKILL)
    until(lambda: "ranks were killed (status 137): queueing" in log(place))
    left = leftovers() - before
    assert left  # on these MPI_Init of a step of the same number fails
    slurm.start_now(job)
    assert slurm.wait(job) == "COMPLETED", log(place)
    assert finished(place) <= UNITS + 2
    assert differing_variables(open_dataset(place / "out.nc"), whole) == []
    for name in left:
        Path("/dev/shm", name).unlink(missing_ok=True)


def test_a_cancelled_job_stays_cancelled(slurm, submit, place):
    job = submit(seconds=0.4)
    until(lambda: finished(place) >= 2)
    slurm.ask("scancel", job)
    assert slurm.wait(job) == "CANCELLED"
    until(lambda: not ranks(place))
    assert slurm.shown(job, "Restarts") == "0"
    assert "stopped early (SIGTERM)" in log(place)
    assert not (place / "out.nc").exists()


@pytest.mark.slow
def test_a_full_disk_does_not_queue_the_job_again_and_again(slurm, submit, place, slow, monkeypatch):
    """A limit on the size of files stands in for the end of the disk: no record of a unit fits."""
    text = (place / "study.toml").read_text()
    (place / "study.toml").write_text(text.replace("[5.0, 10.0]", f"{[2.5 + 0.25 * i for i in range(20)]}"))
    program = place / "bin" / "limited"
    program.write_text('#!/bin/bash\nulimit -f 3\nexec "$@"\n')
    program.chmod(0o755)
    launcher = f"{slow(0.0)['ETC_LAUNCHER']} {program}"
    words = ["--ntasks=1", f"--output={place}/log", str(SCRIPT), "study.toml", str(place / "out.nc")]
    job = slurm.submit(*words, environment={**slow(0.0), "ETC_LAUNCHER": launcher}, folder=place)
    for restarts in range(1, 6):
        until(lambda number=str(restarts): slurm.shown(job, "Restarts") == number, 60.0)
        slurm.start_now(job)
    assert slurm.wait(job) == "FAILED"
    assert slurm.shown(job, "Restarts") == "5"
    assert "cannot write shard" in log(place)
    assert "the last 5 starts of this job" in log(place)


def test_an_array_is_joined_with_the_bits_of_one_run(slurm, place, slow, whole):
    output = place / "out.nc"
    line = [str(ROOT / "jobs" / "slurm_array.sh"), "study.toml", str(output), "3", "--ntasks=1", f"--output={place}/%j"]
    environment = {**slurm.environment, **slow(0.1)}
    done = subprocess.run(line, capture_output=True, text=True, check=False, cwd=place, env=environment)
    assert done.returncode == 0, done.stderr
    join = done.stdout.split()[-3]
    assert slurm.wait(join) == "COMPLETED", done.stdout
    said = (place / join).read_text()
    assert "8 units (0 computed now" in said, said
    assert finished(place) == UNITS
    assert differing_variables(open_dataset(output), whole) == []
    assert not list(place.glob("*.shards"))


@pytest.mark.slow
def test_a_node_set_down_hands_its_job_to_another(slurm, submit, place, whole):
    """Slurm kills what runs there and queues the job again, which then waits two minutes: nothing hurries it.

    Drained as well: the daemon of the node still runs, and brings it back from "down" by itself.
    """
    job = submit("--nodes=1", seconds=0.6)
    until(lambda: finished(place) >= 3)
    node = slurm.shown(job, "BatchHost")
    try:
        for state in ("DOWN", "DRAIN"):
            slurm.ask("scontrol", "update", f"NodeName={node}", f"State={state}", "Reason=test")
        until(lambda: slurm.shown(job, "Restarts") == "1")
        assert slurm.wait(job, seconds=280.0) == "COMPLETED", log(place)
        assert slurm.shown(job, "BatchHost") != node
    finally:
        slurm.ask("scontrol", "update", f"NodeName={node}", "State=RESUME")
    assert re.search(rf"[3-{UNITS - 1}] of {UNITS} units are finished already", log(place)), log(place)
    assert finished(place) <= UNITS + 2  # what two ranks had in hand
    assert differing_variables(open_dataset(place / "out.nc"), whole) == []
