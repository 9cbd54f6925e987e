"""What one bad file, program or client cannot do: stop the service, the studies of others, or change a number."""

from __future__ import annotations

import json
import os
import sqlite3
import stat
import time
from contextlib import closing

import pytest
from serving import STUDY, Service, ask, renamed, until

from etc_engine.errors import OutputError
from etc_engine.service import accounts, client
from etc_engine.service.queue import Queue
from etc_engine.service.settings import Settings
from etc_engine.service.store import open_store
from etc_engine.sweep.dataset import differing_variables


def flip_a_bit(path) -> None:
    """In the middle of the data: found by the checksum only."""
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0x10
    path.write_bytes(content)


def test_a_damaged_result_fails_its_study_and_no_other(tmp_path):
    with Service(tmp_path / "data", slow=True) as service:
        bad, good = (client.submit(service.server, renamed(name))["id"] for name in ("bad", "good"))
        for study in (bad, good):
            assert client.wait(service.server, study, interval=0.05)["state"] == "done"
        before = client.fetch(service.server, bad)
        result = service.data / "studies" / bad / "result.nc"
        content = result.read_bytes()
        result.write_bytes(content[: len(content) // 2])
        status, _, body = ask(f"{service.url}/api/studies/{bad}/curve")
        assert status == 409
        assert "the file is kept as result.damaged.nc" in json.loads(body)["error"]
        failed = client.status(service.server, bad)
        assert failed["state"] == "failed"
        assert "resume computes the study again" in failed["reason"]
        assert ask(f"{service.url}/api/studies/{good}/curve")[0] == 200
        client.resume(service.server, bad)
        assert client.wait(service.server, bad, interval=0.05)["state"] == "done"
        assert differing_variables(before, client.fetch(service.server, bad)) == []
        flip_a_bit(result)
        assert ask(f"{service.url}/api/studies/{bad}/result.nc")[0] in (200, 409)  # 200: a bit that holds no value
        assert client.status(service.server, good)["state"] == "done"
        assert "Traceback" not in service.said()


@pytest.mark.slow
def test_a_result_that_hangs_its_reader_holds_up_nobody(tmp_path):
    """A pipe in place of the file: whoever opens it waits. Other figures and the queue go on meanwhile."""
    with Service(tmp_path / "data", slow=True) as service:
        stuck, good = (client.submit(service.server, renamed(name))["id"] for name in ("stuck", "good"))
        for study in (stuck, good):
            client.wait(service.server, study, interval=0.05)
    with Service(tmp_path / "data", slow=True) as service:  # nothing is in memory any more
        place = service.data / "studies" / stuck / "result.nc"
        place.unlink()
        os.mkfifo(place)
        with pytest.raises(OutputError):
            client._json(client.Server(service.url, timeout=1.0), "GET", f"/api/studies/{stuck}/curve")
        assert ask(f"{service.url}/api/studies/{good}/curve")[0] == 200
        another = client.submit(service.server, renamed("another"))["id"]
        assert client.wait(service.server, another, interval=0.05)["state"] == "done"
        place.unlink()


@pytest.mark.slow
def test_another_program_on_the_queue_stops_changes_only(tmp_path):
    with Service(tmp_path / "data", slow=True, environment={"ETC_TEST_SECONDS": "0.3"}) as service:
        done = client.wait(service.server, client.submit(service.server, STUDY)["id"], interval=0.1)["id"]
        running = client.submit(service.server, renamed("meanwhile"))["id"]
        until(lambda: client.status(service.server, running)["state"] == "running")
        with closing(sqlite3.connect(service.data / "queue.sqlite", isolation_level=None)) as other:
            other.execute("BEGIN EXCLUSIVE")
            status, _, body = ask(f"{service.url}/api/studies", "POST", renamed("refused").encode())
            assert (status, "another program holds the queue" in json.loads(body)["error"]) == (503, True)
            for path in ("", f"/{done}", f"/{done}/curve", f"/{done}/result.nc", f"/{running}", f"/{running}/curve"):
                began = time.monotonic()
                assert ask(f"{service.url}/api/studies{path}")[0] == 200
                assert time.monotonic() - began < 30.0  # no answer waits for the lock
            until((service.data / "studies" / running / "result.nc").exists)
            assert client.status(service.server, running)["state"] == "running"
            other.execute("ROLLBACK")
        assert client.wait(service.server, running, interval=0.1)["state"] == "done"
        assert client.submit(service.server, renamed("refused"))["new"]
        assert "Traceback" not in service.said()


def cut(content: bytes) -> bytes:
    return content[: len(content) // 2]


def zeroed(content: bytes) -> bytes:
    return content[:4096] + b"\0" * (len(content) - 4096)


def tableless(_: bytes) -> bytes:
    with closing(sqlite3.connect(":memory:")) as base:
        base.executescript("CREATE TABLE other (x)")
        return base.serialize()


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (lambda _: b"", r"is empty \(0 bytes\)"),
        (cut, "malformed|damaged"),
        (zeroed, "malformed|damaged"),
        (tableless, "no such table"),
        (lambda content: content.replace(b"queued", b"queled"), r"is damaged \(study 40\)"),
    ],
)
def test_a_damaged_queue_is_never_taken_for_an_empty_one(tmp_path, damage, words):
    path = tmp_path / "queue.sqlite"
    queue = Queue(path)
    for number in range(40):
        queue.submit(f"{number:016x}", "name", 4, 4)
    queue.close()
    content = damage(path.read_bytes())
    path.write_bytes(content)
    with pytest.raises(OutputError, match=rf"(?s)queue .*({words}).*put a copy of it back"):
        Queue(path)
    assert path.read_bytes() == content


def test_a_missing_queue_beside_studies_is_refused(tmp_path):
    with open_store(tmp_path / "data") as store:
        Queue(store.database).close()
        store.save_study("0123456789abcdef", STUDY)
        store.database.unlink()
    with (
        pytest.raises(OutputError, match=r"queue.sqlite is missing, but there are 1 studies"),
        open_store(tmp_path / "data"),
    ):
        pass


def test_the_data_directory_is_for_its_owner_alone(tmp_path):
    data = tmp_path / "data"
    data.mkdir(mode=0o777)
    data.chmod(0o777)
    before = os.umask(0)
    try:
        with Service(data, slow=True) as service:
            study = client.submit(service.server, STUDY)["id"]
            client.wait(service.server, study, interval=0.05)
            assert ask(f"{service.url}/api/studies/{study}/report.html")[0] == 200
    finally:
        os.umask(before)
    assert {path.name for path in (data / "studies" / study).iterdir()} == {
        "study.toml",
        "log",
        "result.nc",
        "report.html",
    }
    for path in (data, *data.rglob("*")):
        assert stat.S_IMODE(path.stat().st_mode) == (0o700 if path.is_dir() else 0o600), path


def test_unwise_starts_are_told(monkeypatch, tmp_path):
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setattr(accounts, "other_accounts", lambda: ["ann", "bob", "eve"])
    open_, closed = Settings(tmp_path), Settings(tmp_path, token="k" * 16)
    assert [line.partition(":")[0] for line in accounts.exposures(open_)] == ["serving as root", "no token"]
    assert "(ann and 2 more)" in accounts.exposures(open_)[1]
    assert len(accounts.exposures(closed)) == 1
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert accounts.exposures(closed) == []
    monkeypatch.setattr(accounts, "other_accounts", list)
    assert accounts.exposures(open_) == []
