"""The service and its batches killed at any moment: everything comes back and ends with the same data.

By hand, for longer: ``ETC_KILLS=40 pytest tests/faults/test_service_kills.py -k random -s``.
"""

from __future__ import annotations

import json
import os
import secrets
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("fastapi", reason="the service needs the extra 'service'")
sys.path.insert(0, str(Path(__file__).parents[1] / "service"))

from serving import STUDY, Service, until

from etc_engine.service import client
from etc_engine.service.launchers import find_mpiexec
from etc_engine.service.processes import ProcessIdentity, batch_processes
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds the batches in /proc"),
]
KILLS = int(os.environ.get("ETC_KILLS", "3"))
RANKS = 2 if find_mpiexec() else 1
MANY = STUDY.replace("realizations = 3", "realizations = 12")


@pytest.fixture
def service(tmp_path):
    environment = {"ETC_TEST_SECONDS": "0.16", "ETC_TEST_LOG": str(tmp_path / "units")}
    running = Service(tmp_path / "data", {"ranks": RANKS}, environment, slow=True)
    yield running.start()
    running.end(signal.SIGKILL)
    for number in batches(running):
        os.kill(number, signal.SIGKILL)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The result without any service or interruption."""
    folder = tmp_path_factory.mktemp("reference")
    (folder / "study.toml").write_text(MANY)
    script = Path(__file__).parents[1] / "stand_in.py"
    subprocess.run([sys.executable, script, folder / "study.toml", "-o", folder / "out.nc"], check=True)
    return open_dataset(folder / "out.nc")


def batches(service: Service) -> list[int]:
    return [n for result in service.data.glob("studies/*") for n in batch_processes(result / "result.nc")]


def units(service: Service) -> int:
    log = service.data.parent / "units"
    return len(log.read_text().splitlines()) if log.exists() else 0


def kill_all(numbers: list[int]) -> None:
    for number in numbers:
        ProcessIdentity.of(number).signal(signal.SIGKILL)


def same_data(service: Service, study: str, reference) -> bool:
    ended = client.wait(service.server, study, interval=0.05)
    assert ended["state"] == "done", ended
    return differing_variables(reference, client.fetch(service.server, study)) == []


def begun(service: Service, least: int = 2) -> str:
    """A study of which some units are finished."""
    study = client.submit(service.server, MANY)["id"]
    until(lambda: units(service) >= least)
    return study


def test_a_batch_outlives_its_service_and_is_taken_up_again(service, reference):
    study = begun(service)
    before = set(batches(service))
    service.end(signal.SIGKILL)
    seen = units(service)
    until(lambda: units(service) > seen)  # it works on
    for number in before:
        os.kill(number, signal.SIGSTOP)  # or it may end before the service is back
    service.start()
    assert client.status(service.server, study)["state"] == "running"
    assert set(batches(service)) == before  # the same processes, not others
    for number in before:
        os.kill(number, signal.SIGCONT)
    assert same_data(service, study, reference)
    assert units(service) == 24  # none computed twice


def test_service_and_batch_killed_together(service, reference):
    study = begun(service)
    family = batches(service)
    service.end(signal.SIGKILL)
    kill_all(family)
    service.start()
    assert same_data(service, study, reference)
    assert client.status(service.server, study)["log"].count("units are finished already") >= 1


def test_a_batch_killed_alone_is_started_again_at_once(service, reference):
    study = begun(service)
    kill_all(batches(service))
    assert same_data(service, study, reference)


def test_orphans_without_a_launcher_are_ended_before_the_next_start(service, reference):
    study = begun(service)
    launcher = min(batches(service))
    os.kill(launcher, signal.SIGKILL)
    assert same_data(service, study, reference)
    assert batches(service) == []


def test_a_service_killed_while_a_batch_ends_finds_the_result(service, reference):
    study = begun(service)
    service.end(signal.SIGKILL)
    until((service.data / "studies" / study / "result.nc").exists)
    until(lambda: not batches(service))
    service.start()
    assert same_data(service, study, reference)
    assert units(service) == 24


def test_a_process_number_that_is_another_process_by_now_is_left_alone(service, reference):
    """The number of the noted batch belongs to this very test: it must not be waited for, let alone killed."""
    study = begun(service)
    family = batches(service)
    service.end(signal.SIGKILL)
    kill_all(family)
    noted = json.dumps({"number": os.getpid(), "start": "1", "boot": ProcessIdentity.of(os.getpid()).boot})
    base = sqlite3.connect(service.data / "queue.sqlite")
    base.execute("UPDATE studies SET batch = ?", (noted,))
    base.commit()
    base.close()
    service.start()
    assert same_data(service, study, reference)


def test_random_kills(service, reference):
    """Service, batch, launcher or all at random moments, from the first millisecond of a study on."""
    seed = secrets.randbits(32)
    print(f"seed {seed}")
    rng = np.random.Generator(np.random.PCG64(seed))
    study, landed = client.submit(service.server, MANY)["id"], 0
    for _ in range(KILLS):
        time.sleep(float(rng.uniform(0.0, 1.5)))
        kind, family = int(rng.integers(4)), batches(service)
        landed += bool(family)
        if kind in (0, 3):
            service.end(signal.SIGKILL)
        if kind in (1, 3):
            kill_all(family)
        if kind == 2 and family:
            kill_all([int(rng.choice(family))])
        if kind in (0, 3):
            service.start()
        found = client.status(service.server, study)
        if found["state"] == "failed":  # three starts killed before they finished a unit: it says so, and goes on
            assert found["reason"]
            client.resume(service.server, study)
        if found["state"] == "done":
            assert same_data(service, study, reference)
            client._open(service.server, "DELETE", f"/api/studies/{study}").close()
            study = client.submit(service.server, MANY)["id"]
    print(f"{KILLS} kills, {landed} with a batch running")
    if client.wait(service.server, study, interval=0.05)["state"] == "failed":
        client.resume(service.server, study)
    assert same_data(service, study, reference)
