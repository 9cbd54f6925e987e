"""The scripts in jobs/ with launchers and queues that stand in for the real ones."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from etc_engine.sweep.result_file import open_dataset

ROOT = Path(__file__).parents[2]
JOBS = ROOT / "jobs"
SCRIPTS = sorted(JOBS.glob("*.sh"))
STUDY = """schema = 2
name = "job"
seed = 20261
[packing]
radii = "uniform:0.03:0.06"
box = [1.0, 1.0]
density = 0.6
[contacts]
rule = "bonded"
contact_angle = 5.0
[statistics]
realizations = 2
"""


@pytest.fixture
def site(tmp_path):
    """A folder with a study and, first on the PATH, launchers that write down how they were called."""
    (tmp_path / "study.toml").write_text(STUDY)
    programs = tmp_path / "bin"
    programs.mkdir()
    words = 'while [ "$1" != etc-engine ] && [ "$1" != true ]; do shift; done\nexec "$@"\n'
    launcher = f'echo "$(basename "$0") $*" >> "$CALLS"\n{words}'
    queue = 'echo "$(basename "$0") $*" >> "$CALLS"\n'
    engine = f'[ -n "${{STATUS:-}}" ] && exit "$STATUS"\nexec {sys.executable} -m etc_engine "$@"\n'
    for name in ("mpirun", "mpiexec", "srun"):
        write_program(programs / name, launcher)
    for name in ("scontrol", "qsub"):
        write_program(programs / name, queue)
    write_program(programs / "etc-engine", engine)
    return tmp_path


def write_program(path: Path, text: str) -> None:
    path.write_text("#!/bin/sh\n" + text)
    path.chmod(0o755)


def run(site: Path, script: str, *arguments: str, **variables: str) -> tuple[int, list[str], str]:
    """Status, calls of the stand-ins and output of a job script."""
    calls = site / "calls"
    calls.unlink(missing_ok=True)
    environment = {**os.environ, "PATH": f"{site / 'bin'}:{os.environ['PATH']}", "CALLS": str(calls)}
    environment |= {"PYTHONPATH": str(ROOT), **variables}
    done = subprocess.run(
        [str(JOBS / script), *arguments],
        cwd=site,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=200,
    )
    return done.returncode, calls.read_text().splitlines() if calls.exists() else [], done.stdout + done.stderr


SWEEP = "etc-engine sweep study.toml -o out.nc --resume"
PBS = {"STUDY": "study.toml", "OUTPUT": "out.nc"}


@pytest.mark.parametrize(
    ("script", "arguments", "variables", "call"),
    [
        ("local.sh", ("study.toml", "out.nc", "3"), {}, f"mpirun -n 3 {SWEEP}"),
        ("slurm.sh", ("study.toml", "out.nc"), {}, f"srun --kill-on-bad-exit=1 {SWEEP}"),
        ("pbs.sh", (), PBS, f"mpiexec {SWEEP}"),
        (
            "slurm.sh",
            ("study.toml", "out.nc"),
            {
                "SLURM_ARRAY_TASK_ID": "7",
                "SLURM_ARRAY_TASK_MIN": "5",
                "SLURM_ARRAY_TASK_STEP": "2",
                "SLURM_ARRAY_TASK_COUNT": "3",
            },
            f"srun --kill-on-bad-exit=1 {SWEEP} --part 2/3",
        ),
        ("slurm.sh", ("study.toml", "out.nc"), {"ETC_LAUNCHER": "mpirun -n 2"}, f"mpirun -n 2 {SWEEP}"),
    ],
)
def test_a_script_runs_the_sweep_through_its_launcher(site, script, arguments, variables, call):
    status, calls, output = run(site, script, *arguments, **variables)
    assert status == 0, output
    assert calls == [call]
    if "--part" not in call:
        assert open_dataset(site / "out.nc").sizes["realization"] == 2


@pytest.mark.parametrize(
    ("script", "arguments", "variables", "queued"),
    [
        ("slurm.sh", ("study.toml", "out.nc"), {"SLURM_JOB_ID": "17"}, "scontrol requeue 17"),
        (
            "pbs.sh",
            (),
            {**PBS, "ETC_SECONDS": "90"},
            "qsub -v STUDY=study.toml,OUTPUT=out.nc,ETC_SECONDS=90,ETC_RESTART=1 jobs/pbs.sh",
        ),
    ],
)
def test_status_75_queues_the_job_again_and_no_other_status_does(site, script, arguments, variables, queued):
    status, calls, output = run(site, script, *arguments, STATUS="75", **variables)
    assert status == 0, output
    assert calls[1:] == [queued]
    for other in ("0", "2", "4", "1", "3", "126", "127"):
        status, calls, _ = run(site, script, *arguments, STATUS=other, **variables)
        assert status == int(other)
        assert len(calls) == 1


@pytest.mark.parametrize(
    ("script", "arguments", "variables"),
    [
        ("slurm.sh", ("study.toml", "out.nc"), {"SLURM_JOB_ID": "17", "SLURM_RESTART_COUNT": "50"}),
        ("pbs.sh", (), {**PBS, "ETC_RESTART": "50"}),
    ],
)
def test_restarts_have_an_end(site, script, arguments, variables):
    status, calls, _ = run(site, script, *arguments, STATUS="75", **variables)
    assert status == 75
    assert not [call for call in calls if call.startswith(("scontrol", "qsub"))]
    assert len([call for call in calls if call.endswith("--resume")]) == 1


@pytest.mark.parametrize("status", ["0", "2", "143"])
def test_a_slurm_job_leaves_its_status_for_who_waits(site, status):
    (site / "status").write_text("7\n")  # of an earlier job
    words = {"STATUS": status, "SLURM_JOB_ID": "17", "ETC_MAX_RESTARTS": "0"}
    ended, _, _ = run(site, "slurm.sh", "study.toml", "out.nc", "status", **words)
    assert (ended, (site / "status").read_text()) == (int(status), f"{status}\n")


@pytest.mark.parametrize("status", ["9", "15", "137", "139", "143"])
def test_killed_ranks_queue_a_slurm_job_again(site, status):
    ended, calls, output = run(site, "slurm.sh", "study.toml", "out.nc", STATUS=status, SLURM_JOB_ID="17")
    assert (ended, calls[1:]) == (0, ["scontrol requeue 17"]), output
    assert f"ranks were killed (status {status})" in output


def test_ranks_that_are_killed_before_they_begin_end_the_job_after_five_restarts(site):
    words = {"STATUS": "143", "SLURM_JOB_ID": "17", "SLURM_RESTART_COUNT": "5"}
    ended, calls, _ = run(site, "slurm.sh", "study.toml", "out.nc", **words)
    assert (ended, "scontrol requeue 17" in calls) == (143, False)
    begin = "mkdir -p out.nc.shards\necho > out.nc.shards/$$.run\nexit $STATUS\n"
    write_program(site / "bin" / "etc-engine", begin)
    ended, calls, _ = run(site, "slurm.sh", "study.toml", "out.nc", **words)
    assert (ended, "scontrol requeue 17" in calls) == (0, True)


def test_a_requeued_slurm_job_uses_up_the_numbers_of_earlier_steps(site):
    """MPI names shared memory after job and step: a step of the same number finds what killed ranks have left."""
    status, calls, output = run(site, "slurm.sh", "study.toml", "out.nc", SLURM_RESTART_COUNT="2")
    assert status == 0, output
    assert calls == ["srun --nodes=1 --ntasks=1 true"] * 2 + [f"srun --kill-on-bad-exit=1 {SWEEP}"]


def test_the_time_limit_of_pbs_reaches_the_sweep_as_a_warning(site):
    """A stand-in engine that ends with 75 on SIGTERM, as the real one does, within one second."""
    write_program(site / "bin" / "etc-engine", "trap 'exit 75' TERM\nwhile :; do sleep 0.05; done\n")
    status, calls, output = run(site, "pbs.sh", ETC_SECONDS="1", **PBS)
    assert status == 0, output
    assert calls[1].startswith("qsub ")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_without_a_study_a_script_says_how_it_is_used(site, script):
    status, calls, output = run(site, script.name)
    assert status != 0
    assert "usage: " in output
    assert calls == []


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_bash_and_shellcheck_have_no_complaint(script):
    subprocess.run(["bash", "-n", str(script)], check=True)
    if shutil.which("shellcheck") is None:
        pytest.skip("shellcheck is not installed; bash -n passed")
    subprocess.run(["shellcheck", str(script)], check=True)
