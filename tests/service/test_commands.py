"""The commands `submit`, `status` and `fetch`, and the client behind them."""

from __future__ import annotations

import json
import socket
import threading
from contextlib import suppress

import pytest
from serving import STUDY, Service, renamed, until

from etc_engine.cli.remote import progress_of
from etc_engine.errors import OutputError
from etc_engine.service import client
from etc_engine.sweep.result_file import open_dataset

TOKEN = "a-token-of-some-length"


def test_submit_status_fetch(service, tmp_path, etc_engine):
    server = ["--server", service.url]
    (tmp_path / "study.toml").write_text(renamed("by command"))
    done = etc_engine("submit", tmp_path / "study.toml", *server, "-o", tmp_path / "out.nc", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (found["state"], found["done"], found["name"]) == ("done", 6, "by command")
    assert found["id"] in done.stderr
    assert open_dataset(tmp_path / "out.nc").sizes["realization"] == 3
    listed = etc_engine("status", *server)
    assert f"{found['id']}  done       6/6  by command" in listed.stdout.splitlines()
    one = etc_engine("status", found["id"], *server)
    assert "6 units (6 computed now" in one.stdout
    assert json.loads(etc_engine("status", found["id"], *server, "--json").stdout)["state"] == "done"
    fetched = etc_engine("fetch", found["id"], *server, "-o", tmp_path / "again.nc")
    assert fetched.returncode == 0
    assert (tmp_path / "again.nc").read_bytes() == (tmp_path / "out.nc").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["again.nc", "out.nc", "study.toml"]


def test_submit_prints_the_identity_alone(service, tmp_path, etc_engine):
    """So that ``ID=$(etc-engine submit study.toml)`` works, with and without waiting."""
    (tmp_path / "study.toml").write_text(renamed("identity"))
    study = client.submit(service.server, renamed("identity"))["id"]
    for more in ([], ["--wait"], ["-o", tmp_path / "out.nc"]):
        done = etc_engine("submit", tmp_path / "study.toml", "--server", service.url, *more)
        assert (done.returncode, done.stdout) == (0, f"{study}\n"), done.stderr
        assert f"{study}  " in done.stderr


@pytest.mark.parametrize(
    ("address", "asked"),
    [("http://127.0.0.1:9", 0), ("http://etc.invalid", 0), ("https://127.0.0.2:9", 0), ("https://etc.invalid", 1)],
)
def test_token_and_study_never_go_to_a_proxy_in_clear(monkeypatch, address, asked):
    """A proxy of the environment sees a request to a named host over https, as CONNECT, and nothing else."""
    seen = []
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(20)

        def proxy() -> None:
            with suppress(OSError), listener.accept()[0] as connection:
                seen.append(connection.recv(65536))

        thread = threading.Thread(target=proxy)
        thread.start()
        for name in ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY", "all_proxy"):
            monkeypatch.setenv(name, f"http://127.0.0.1:{listener.getsockname()[1]}")
        for name in ("no_proxy", "NO_PROXY"):
            monkeypatch.delenv(name, raising=False)
        with pytest.raises(OutputError, match="does not answer"):
            client.submit(client.Server(address, TOKEN, timeout=0.5), STUDY)
        listener.shutdown(socket.SHUT_RDWR)
        thread.join()
    assert len(seen) == asked
    assert all(request.startswith(b"CONNECT ") and TOKEN.encode() not in request for request in seen)


def test_cancel_and_resume(tmp_path, etc_engine):
    with Service(tmp_path / "data", {"token": TOKEN}, {"ETC_TEST_SECONDS": "0.5"}, slow=True) as service:
        (tmp_path / "token").write_text(TOKEN + "\n")
        (tmp_path / "study.toml").write_text(STUDY)
        server = ["--server", service.url, "--token-file", tmp_path / "token"]
        study = json.loads(etc_engine("submit", tmp_path / "study.toml", *server, "--json").stdout)["id"]
        until(lambda: client.status(service.server, study)["done"] >= 1)
        cancelled = etc_engine("status", study, *server, "--cancel")
        assert cancelled.returncode == 0
        assert cancelled.stdout.split()[1] in ("cancelling", "cancelled")
        ended = client.wait(service.server, study, interval=0.05)
        assert ended["state"] == "cancelled"
        assert etc_engine("status", study, *server).stdout.splitlines()[0].count("cancelled") == 1
        assert etc_engine("fetch", study, *server, "-o", tmp_path / "out.nc").returncode == 2
        waited = etc_engine("submit", tmp_path / "study.toml", *server, "--wait")
        assert waited.returncode == 0
        assert waited.stdout == f"{study}\n"
        assert "6/6  served" in waited.stderr
        assert etc_engine("status", study, *server, "--remove").stdout == f"{study}  removed\n"
        assert client.studies(service.server) == []
        assert not (tmp_path / "data" / "studies" / study).exists()


def test_who_waits_outlasts_a_new_start_of_the_service(tmp_path):
    data, pace = tmp_path / "data", {"ETC_TEST_SECONDS": "0.5"}
    with Service(data, slow=True, environment=pace) as service:
        port = int(service.url.rsplit(":", 1)[1])
        study = client.submit(service.server, STUDY)["id"]
        seen: list[str] = []
        waiter = threading.Thread(
            target=lambda: seen.append(client.wait(service.server, study, interval=0.1, patience=60.0)["state"])
        )
        waiter.start()
        until(lambda: client.status(service.server, study)["done"] >= 1)
        server = service.server
    words = rf"the study continues; ask again with: etc-engine fetch {study}"
    with pytest.raises(OutputError, match=words):
        client.wait(server, study, interval=0.1, patience=0.3)
    with Service(data, {"port": port}, slow=True):
        waiter.join(timeout=60)
    assert seen == ["done"]


def test_a_line_of_status():
    study = {"id": "7f", "name": "a", "state": "running", "done": 3, "planned": 8, "reason": "", "cancelling": True}
    assert progress_of(study) == "7f  cancelling  3/8  a"
    cancelled = study | {"state": "cancelled", "reason": "cancelled", "cancelling": False}
    assert progress_of(cancelled) == "7f  cancelled  3/8  a"
    done = study | {"state": "done", "cancelling": False, "failed_cells": 4}
    assert progress_of(done).endswith("a  (4 cells failed)")
    assert progress_of(done | {"failed_cells": 1}).endswith("(1 cell failed)")
    hostile = progress_of(cancelled | {"name": "\x1b]0;mine\x07\n" + "x" * 500, "reason": "a\x1b[2J"})
    assert hostile.isprintable()
    assert hostile == "7f  cancelled  3/8  " + r"\x1b]0;mine\x07\n" + "x" * 42 + r"…  (a\x1b[2J)"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["submit", "missing.toml"], "cannot be read"),
        (["submit", "bad.toml"], "packing: missing"),
        (["submit", "large.toml"], "this service allows 100000"),
        (["submit", "good.toml", "-o", "none/out.nc"], "cannot write none/out.nc"),
        (["status", "0123456789abcdef"], "there is no study 0123456789abcdef"),
        (["status", "../x"], "study '../x': expected 16 hexadecimal digits"),
        (["status", ""], "study '': expected 16 hexadecimal digits, the identity that submit and status print"),
        (["fetch", "0123456789abcdef", "-o", "r.csv"], "written as .nc, its report as .html: found 'r.csv'"),
        (["submit", "good.toml", "-o", "r.csv"], "written as .nc: found 'r.csv'"),
        (["status", "--remove"], "need the identity"),
        (["status", "0123456789abcdef", "--remove"], "there is no study"),
        (["status", "0123456789abcdef", "--remove", "--cancel"], "exclude each other"),
        (["status", "--cancel"], "need the identity"),
        (["fetch", "0123456789abcdef", "-o", "out.nc"], "there is no study"),
        (["fetch", "0123456789abcdef"], "Missing option '-o'"),
    ],
)
def test_refusals_are_one_line(service, tmp_path, monkeypatch, etc_engine, arguments, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text('schema = 2\nname = "x"\nseed = 7\n[statistics]\nrealizations = 2\n')
    (tmp_path / "good.toml").write_text(STUDY)
    (tmp_path / "large.toml").write_text(STUDY.replace("realizations = 3", "realizations = 100000"))
    before = sorted(path.name for path in tmp_path.iterdir())
    done = etc_engine(*arguments, "--server", service.url)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert words in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("http://127.0.0.1:9", "does not answer"),
        ("here", "expected an address"),
        ("http://a:b@c", "expected an address"),
    ],
)
def test_wrong_addresses(etc_engine, address, words):
    done = etc_engine("status", "--server", address)
    assert done.returncode == 2
    assert words in done.stderr


def test_the_client_answers_datasets(service):
    study = client.submit(service.server, renamed("dataset"))
    assert client.wait(service.server, study["id"], interval=0.05)["state"] == "done"
    dataset = client.fetch(service.server, study["id"])
    assert dict(dataset.sizes)["density"] == 2
    assert dataset.conductivity_mean.notnull().any()
