"""Many clients and slow ones: the service stays open to others, and small."""

from __future__ import annotations

import re
import resource
import socket
import time
from contextlib import ExitStack
from pathlib import Path

import pytest
from serving import STUDY, Service, ask, until

from etc_engine.service import client

HEAD = b"POST /api/solve?box=1,1 HTTP/1.1\r\nHost: localhost\r\n"
SHORT = {"idle_seconds": 1.0, "body_seconds": 1.0}


def dial(service: Service, sent: bytes = b"") -> socket.socket:
    connection = socket.create_connection(("127.0.0.1", int(service.url.rsplit(":", 1)[1])), timeout=60)
    connection.sendall(sent)
    return connection


def rest(connection: socket.socket) -> bytes:
    """All that comes until the other side closes."""
    found = b""
    try:
        while block := connection.recv(65536):
            found += block
    except ConnectionResetError:
        pass
    return found


def is_closed(connection: socket.socket) -> bool:
    """Whether the other side has closed a connection on which it says nothing."""
    try:
        return connection.recv(1, socket.MSG_DONTWAIT) == b""
    except BlockingIOError:
        return False
    except ConnectionResetError:
        return True


def memory(service: Service) -> float:
    """Largest resident memory of a service so far [MB]."""
    text = Path(f"/proc/{service.process.pid}/status").read_text()
    return int(re.search(r"VmHWM:\s*(\d+)", text)[1]) / 1024


@pytest.fixture(scope="module")
def strict(tmp_path_factory):
    """A service without patience."""
    limits = {**SHORT, "client_connections": 20}
    with Service(tmp_path_factory.mktemp("strict") / "data", {"limits": limits}, slow=True) as running:
        yield running


@pytest.mark.parametrize(
    ("sent", "answer"),
    [
        (b"", b""),
        (b"GET /api/studies HTTP/1.1\r\nHost: local", b""),
        (HEAD + b"Content-Length: 1000\r\n\r\nx,y", b"HTTP/1.1 408"),
        (HEAD + b"Transfer-Encoding: chunked\r\n\r\n3\r\nx,y\r\n", b"HTTP/1.1 408"),
        (b"GET /api/nothing HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\n", b"HTTP/1.1 404"),
        (b"GET / HTTP/1.1\r\n" + b"X-Long: " + b"a" * 100_000, b"HTTP/1.1 400"),
    ],
    ids=("idle", "half a head", "slow body", "slow chunks", "unread body", "head without end"),
)
def test_who_does_not_go_on_is_sent_away(strict, sent, answer):
    with dial(strict, sent) as connection:
        assert rest(connection).startswith(answer)
    assert "Traceback" not in strict.said()


def test_a_body_that_drips_is_not_waited_for(strict):
    with dial(strict, HEAD + b"Content-Length: 100000\r\n\r\n") as connection:
        connection.settimeout(0.2)
        answer = b""
        for _ in range(150):  # far below the expected rate; without a limit in time this goes on for ever
            try:
                connection.sendall(b"x")
                answer = connection.recv(100)
                break
            except TimeoutError:
                continue
        assert answer.startswith(b"HTTP/1.1 408")


def test_a_client_gets_no_more_than_its_connections(strict):
    """The ones that have waited longest make room; a request in a new one is served."""
    with ExitStack() as open_:
        before = [open_.enter_context(dial(strict)) for _ in range(60)]
        assert ask(f"{strict.url}/api/studies")[0] == 200
        until(lambda: all(map(is_closed, before[:30])))


def test_uploads_count_before_they_are_read(tmp_path):
    """Five have a place, whatever they send; the others are refused at once, and nothing is kept in memory."""
    with Service(tmp_path / "data", slow=True) as service, ExitStack() as open_:
        ask(f"{service.url}/api/studies")
        before, size = memory(service), 32 * 1024 * 1024
        head = HEAD + b"Content-Length: %d\r\n\r\n" % size
        placed = [open_.enter_context(dial(service, head)) for _ in range(5)]
        folders = service.data / "scratch"
        until(lambda: len(list(folders.iterdir())) == 5)
        with dial(service, head) as sixth:
            assert sixth.recv(100).startswith(b"HTTP/1.1 429")
        block = b"#" * (size - 1)
        for connection in placed:
            connection.sendall(block)
        until(lambda: sum(path.stat().st_size for path in folders.glob("*/upload")) > 4.9 * size)
        assert memory(service) - before < size / 1e6  # less than one of them
        for connection in placed:
            connection.close()
        until(lambda: not list(folders.iterdir()))
        assert client.solve(service.server, b"x,y,radius\n0.25,0.5,0.26\n0.75,0.5,0.26\n", box="1,1")["particles"] == 2


@pytest.mark.slow
def test_out_of_file_descriptors_is_one_line(tmp_path):
    """With 40 descriptors and 300 clients; the service lives on and computes a study.

    The supervisor, which needs a descriptor for the queue, may add a line of its own.
    """
    with Service(tmp_path / "data", slow=True) as service:
        resource.prlimit(service.process.pid, resource.RLIMIT_NOFILE, (40, 40))
        crowd = []
        for _ in range(300):
            crowd.append(dial(service))
        time.sleep(3.0)
        for connection in crowd:
            connection.close()
        until(lambda: ask(f"{service.url}/api/studies")[0] == 200)
        study = client.submit(service.server, STUDY)["id"]
        assert client.wait(service.server, study, interval=0.1)["state"] == "done"
        said = service.said().splitlines()
    supervisor = [line for line in said if "supervisor: unable to open database file; trying again" in line]
    connections = [line for line in said if "Too many open files" in line]
    assert len(supervisor) <= 1 <= len(connections) <= 3, said
    assert len(supervisor) + len(connections) == len(said), said
