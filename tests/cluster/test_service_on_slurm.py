"""``etc-engine serve --launcher slurm`` on a real Slurm."""

from __future__ import annotations

import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import pytest
from cluster_study import STUDY
from serving import Service, until

from etc_engine.service import client
from etc_engine.service.processes import kill_batch
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

UNITS = 8


@pytest.fixture
def service(slurm, place, slow):
    """A service with three ranks a study: ``service(seconds a unit)``."""

    def build(seconds: float = 0.0, **options: object) -> Service:
        settings = {"launcher": "slurm", "ranks": 3, "sbatch": ["--partition=short", "--time=2:00:00"]}
        return Service(
            place / "data", {**settings, "squeue_seconds": 0.3, **options}, slurm.environment | slow(seconds)
        )

    return build


def jobs(slurm) -> list[str]:
    """All jobs that the controller still knows of this service."""
    return slurm.ask("squeue", "--noheader", "--states=all", "--format=%i").split()


def test_the_line_of_the_documentation_serves_a_study(slurm, place, slow):
    """Word by word, but for the number of ranks, the port and the folder."""
    text = (Path(__file__).parents[2] / "jobs" / "README.md").read_text()
    line = next(line for line in text.splitlines() if line.startswith("etc-engine serve") and "slurm" in line)
    line = line.replace("~/etc-data", str(place / "data")).replace("--ranks 64", "--ranks 3 --port 0")
    before = set(jobs(slurm))
    said = place / "said"
    with said.open("w") as file:
        command = line.replace("etc-engine", f"exec {sys.executable} -m etc_engine", 1)
        running = subprocess.Popen(command, shell=True, stderr=file, env=slurm.environment | slow(0.0))
    try:
        until(lambda: " on http" in said.read_text())
        server = client.Server(said.read_text().partition(" on ")[2].strip())
        study = client.submit(server, STUDY)["id"]
        ended = client.wait(server, study, interval=0.2)
        assert (ended["state"], ended["done"]) == ("done", UNITS), ended
    finally:
        running.send_signal(signal.SIGTERM)
        assert running.wait(timeout=60) == 0
    (job,) = set(jobs(slurm)) - before
    assert (slurm.shown(job, "NumTasks"), slurm.shown(job, "JobState")) == ("3", "COMPLETED")
    assert slurm.shown(job, "JobName") == f"etc-engine-{study}"


def test_a_job_outlives_a_killed_service_and_is_found_again(slurm, service):
    before = set(jobs(slurm))
    running = service(0.5).start()
    study = client.submit(running.server, STUDY)["id"]
    until(lambda: client.status(running.server, study)["done"] >= 1)
    running.end(signal.SIGKILL)
    with sqlite3.connect(running.data / "queue.sqlite") as base:
        base.execute("UPDATE studies SET batch = ''")  # as if it had been killed before it could note the number
    base.close()
    with running:
        ended = client.wait(running.server, study, interval=0.2)
        assert (ended["state"], ended["done"]) == ("done", UNITS), ended
    assert len(set(jobs(slurm)) - before) == 1


def test_cancelling_keeps_what_is_finished_and_resuming_continues(slurm, service, place):
    before = set(jobs(slurm))
    with service(1.2) as running:
        study = client.submit(running.server, STUDY)["id"]
        until(lambda: client.status(running.server, study)["done"] >= 2)
        client.cancel(running.server, study)
        ended = client.wait(running.server, study, interval=0.2)
        assert (ended["state"], "stopped early (SIGTERM)" in ended["log"]) == ("cancelled", True), ended
        (job,) = set(jobs(slurm)) - before
        assert slurm.state(job) == "CANCELLED"
        client.resume(running.server, study)
        assert client.wait(running.server, study, interval=0.2)["state"] == "done"
    assert len((place / "units").read_text().splitlines()) == UNITS


@pytest.mark.slow
def test_killed_ranks_and_an_absent_controller_do_not_fail_a_study(slurm, service, place):
    """The ranks die while the controller is away; it is away for longer than three commands are waited for."""
    with service(0.4, slurm_seconds=1.0) as running:
        study = client.submit(running.server, STUDY)["id"]
        until(lambda: client.status(running.server, study)["done"] >= 2)
        slurm.end("slurmctld", signal.SIGKILL)
        try:
            second = client.submit(running.server, STUDY.replace("on a cluster", "second"))["id"]
            kill_batch(place / "data" / "studies" / study / "result.nc")
            until(lambda: "trying again" in running.said())
            time.sleep(5.0)  # for more than three commands; the log says it once
            assert client.status(running.server, study)["state"] == "running"  # nobody knows otherwise
            waiting = client.status(running.server, second)
            assert waiting["state"] in ("queued", "running"), waiting
        finally:
            slurm.begin_controller()
        for one in (study, second):
            ended = client.wait(running.server, one, interval=0.2)
            assert (ended["state"], ended["done"]) == ("done", UNITS), ended
    results = [open_dataset(place / "data" / "studies" / one / "result.nc") for one in (study, second)]
    assert differing_variables(*results) == []


def test_what_sbatch_refuses_is_a_reason(slurm, service):
    with service(sbatch=["--partition=none"]) as running:
        study = client.submit(running.server, STUDY)["id"]
        ended = client.wait(running.server, study, interval=0.2)
    assert (ended["state"], "invalid partition" in ended["reason"]) == ("failed", True), ended


def test_a_study_that_is_refused_is_tried_once(slurm, service, place):
    """Every rank of the job ends with status 2; the first one to end must not make the others look killed."""
    program = place / "bin" / "etc-engine"
    program.write_text(program.read_text().replace('"$@"', 'sweep /nowhere/study.toml -o "$4" --resume'))
    before = set(jobs(slurm))
    with service() as running:
        study = client.submit(running.server, STUDY)["id"]
        ended = client.wait(running.server, study, interval=0.2)
    assert ended["state"] == "failed", ended
    assert "/nowhere/study.toml" in ended["reason"], ended
    assert len(set(jobs(slurm)) - before) == 1, ended
