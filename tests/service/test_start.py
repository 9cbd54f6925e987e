"""Starting: what is refused, in one line with exit status 2, before anything is changed."""

from __future__ import annotations

import errno
import json
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest
from serving import STUDY, Service, ask, until

from etc_engine.errors import OutputError
from etc_engine.service import client
from etc_engine.service.queue import Queue
from etc_engine.service.store import open_store


@pytest.fixture
def refused(etc_engine, monkeypatch):
    """What a command line that should be refused says, in one line."""

    def serve(words: str, *arguments: object, **environment: str) -> None:
        monkeypatch.delenv("ETC_ENGINE_TOKEN", raising=False)
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        done = etc_engine("serve", *arguments)
        assert (done.returncode, done.stdout) == (2, ""), done.stderr
        assert len(done.stderr.splitlines()) == 1, done.stderr
        assert words in done.stderr

    return serve


def test_other_hosts_need_a_token(tmp_path, refused):
    refused("can be reached from other machines: give a token", "--data", tmp_path / "d", "--host", "0.0.0.0")
    (tmp_path / "token").write_text("short\n")
    where = ["--data", tmp_path / "d", "--host", "0.0.0.0", "--token-file"]
    refused("at least 16", *where, tmp_path / "token")
    refused("cannot be read", *where, tmp_path / "none")
    refused("expected one word", *where[:4], ETC_ENGINE_TOKEN="word one two three four")
    refused("brings requests of other machines", "--data", tmp_path / "d", "--allow-host", "etc.example.org")
    assert not (tmp_path / "d").exists()


def test_without_the_extra_it_says_what_to_install(refused, tmp_path, monkeypatch):
    for name in [name for name in sys.modules if name.startswith("etc_engine.service")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "fastapi", None)
    refused("the service needs fastapi: install it with pip install '.[service]'", "--data", tmp_path)


def test_a_port_in_use(tmp_path, refused):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        refused(f"port {port} is in use", "--data", tmp_path / "d", "--port", port)
    assert not (tmp_path / "d").exists()
    refused("cannot listen", "--data", tmp_path / "d", "--host", "192.0.2.1", ETC_ENGINE_TOKEN="x" * 20)


def test_a_second_service_is_refused_and_the_first_unharmed(tmp_path, refused):
    with Service(tmp_path / "data", slow=True) as first:
        study = client.submit(first.server, STUDY)["id"]
        refused("another service is using it (process", "--data", tmp_path / "data", "--port", 0)
        assert client.wait(first.server, study, interval=0.05)["state"] == "done"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("format.json", '{"format": 2}', "is of format 2, this version of etc-engine knows formats up to 1"),
        ("format.json", "{", "damaged"),
        ("thesis.tex", "", "holds other things (thesis.tex"),
    ],
)
def test_a_directory_of_another_kind_stays_as_it_is(tmp_path, refused, name, content, words):
    (tmp_path / name).write_text(content)
    refused(words, "--data", tmp_path, "--port", 0)
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--data", ""], "found no name, expected a folder"),
        (["--max-hours", "nan"], "found nan"),
        (["--max-hours", "0"], "--max-hours"),
        (["--ranks", "100000"], "--ranks"),
        (["--ranks", "60000"], "found 60000 ranks, this machine takes at most"),
    ],
)
def test_options_without_a_meaning_are_refused(tmp_path, refused, arguments, words):
    refused(words, "--data", tmp_path / "d", "--port", 0, *arguments)
    assert not (tmp_path / "d").exists()


def test_slurm_has_to_be_there(tmp_path, refused):
    refused("not on the PATH: sbatch", "--data", tmp_path / "d", "--launcher", "slurm", PATH=str(tmp_path))
    assert not (tmp_path / "d").exists()


@pytest.mark.parametrize(("mode", "lines"), [(0o600, 0), (0o640, 1), (0o604, 1)])
def test_a_token_that_others_can_read_is_said(tmp_path, etc_engine, mode, lines):
    token = tmp_path / "token"
    token.write_text("a-token-of-some-length")
    token.chmod(mode)
    with socket.create_server(("127.0.0.1", 0)) as taken:  # so that it ends at once
        where = ["--data", tmp_path / "d", "--port", taken.getsockname()[1]]
        said = etc_engine("serve", *where, "--token-file", token).stderr.splitlines()
    assert [line for line in said if "others can read the token" in line] == said[:lines]
    assert len(said) == lines + 1


def test_places_that_cannot_be_written(tmp_path, refused):
    (tmp_path / "file").write_text("")
    refused("is a file, expected a folder", "--data", tmp_path / "file", "--port", 0)
    refused("cannot be written", "--data", "/proc/data", "--port", 0)


def test_a_damaged_queue_is_named(tmp_path, refused):
    with open_store(tmp_path / "data") as store:
        store.database.write_bytes(b"not a database, but long enough to be looked at" * 100)
    refused("queue.sqlite: file is not a database", "--data", tmp_path / "data", "--port", 0)


@pytest.fixture
def small_disk(tmp_path):
    """A file system of six megabytes."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = shutil.which("mount")
    line = [mount or "mount", "-t", "tmpfs", "-o", "size=6m", "none", str(place)]
    if mount is None or subprocess.run(line, capture_output=True, check=False).returncode:
        pytest.skip("may not mount a small file system here")
    yield place
    subprocess.run(["umount", "-l", str(place)], check=True)


def test_a_full_disk_is_said_and_nothing_is_lost(small_disk, refused):
    """At the start; while studies are handed in; while one runs. With room again everything goes on."""
    data, filler = small_disk / "data", small_disk / "filler"
    fill = b"\0" * (small_disk_size(small_disk) - 4096)
    filler.write_bytes(fill)
    refused("cannot be written (No space left on device)", "--data", data, "--port", 0)
    filler.unlink()
    with Service(data, slow=True, environment={"ETC_TEST_SECONDS": "0.3"}) as service:
        study = client.submit(service.server, STUDY)["id"]
        fill_up(filler)
        status, _, body = ask(f"{service.url}/api/studies", "POST", STUDY.replace("served", "second").encode())
        assert status == 507, body
        assert "disk of the service is full" in json.loads(body)["error"]
        assert ask(f"{service.url}/api/studies")[0] == 200
        time.sleep(2.0)  # the batch meets the full disk
        filler.unlink()
        ended = client.wait(service.server, study, interval=0.1)
        if ended["state"] == "failed":
            assert "make room" in ended["reason"] or "space" in ended["reason"], ended
            client.resume(service.server, study)
            ended = client.wait(service.server, study, interval=0.1)
        assert (ended["state"], ended["done"]) == ("done", 6), ended
        assert client.wait(service.server, client.submit(service.server, STUDY.replace("served", "second"))["id"])


def fill_up(filler: Path) -> None:
    """Write until nothing fits any more; the service writes beside it, so that no size is known beforehand."""
    with filler.open("wb", buffering=0) as file:
        try:
            while True:
                file.write(b"\0" * 4096)
        except OSError as error:
            assert error.errno == errno.ENOSPC


def small_disk_size(place: Path) -> int:
    return shutil.disk_usage(place).free


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_in_order(tmp_path, number):
    service = Service(tmp_path / "data", slow=True, environment={"ETC_TEST_SECONDS": "1"}).start()
    study = client.submit(service.server, STUDY)["id"]
    until(lambda: client.status(service.server, study)["state"] == "running")
    assert service.end(number) == 0
    assert "Traceback" not in service.said()
    queue = Queue(tmp_path / "data" / "queue.sqlite")
    assert queue.require(study).state == "queued"
    queue.close()


def test_two_stores_in_one_process_exclude_each_other(tmp_path):
    with (
        open_store(tmp_path / "data"),
        pytest.raises(OutputError, match="another service"),
        open_store(tmp_path / "data"),
    ):
        pass
    with open_store(tmp_path / "data") as store:
        assert json.loads((store.root / "format.json").read_text()) == {"format": 1}
