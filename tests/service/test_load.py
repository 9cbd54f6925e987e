"""1000 idle and 50 slow clients while a batch runs: a client that behaves is served, and the batch ends as alone.

The figures: ``pytest -m slow tests/service/test_load.py -s``.
"""

from __future__ import annotations

import re
import resource
import selectors
import socket
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pytest

pytest.importorskip("fastapi", reason="the service needs the extra 'service'")

from serving import STUDY, Service, ask, until

from etc_engine.service import client
from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.result_file import open_dataset

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="counts descriptors in /proc"),
]
IDLE, SLOW = 1000, 50
MANY = STUDY.replace("realizations = 3", "realizations = 40")
DRIP = b"POST /api/solve?box=1,1 HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n"


class Crowd:
    """Clients that are there and want nothing, or send a byte a second. Whoever is sent away comes back."""

    def __init__(self, port: int, host_of: Callable[[int], str]) -> None:
        self._port, self._host_of = port, host_of
        self._selector = selectors.DefaultSelector()
        self._slow: dict[int, socket.socket] = {}
        self._ended = threading.Event()
        self.thread = threading.Thread(target=self._stay)
        self.returns = -(IDLE + SLOW)

    def _come(self, number: int) -> None:
        connection = socket.socket()
        connection.bind((self._host_of(number), 0))
        connection.settimeout(10.0)
        try:
            connection.connect(("127.0.0.1", self._port))
            if number >= IDLE:
                connection.sendall(DRIP)
                self._slow[number] = connection
        except OSError:
            connection.close()
            return
        finally:
            self.returns += 1
        connection.setblocking(False)
        self._selector.register(connection, selectors.EVENT_READ, number)

    def _leave(self, connection: socket.socket) -> int:
        number: int = self._selector.unregister(connection).data
        self._slow.pop(number, None)
        connection.close()
        return number

    def _stay(self) -> None:
        missing, dripped = set(range(IDLE + SLOW)), 0.0
        while not self._ended.is_set():
            for number in list(missing)[:100]:
                self._come(number)
            missing = set(range(IDLE + SLOW)) - {key.data for key in self._selector.get_map().values()}
            for key, _ in self._selector.select(0.2):
                connection = key.fileobj
                assert isinstance(connection, socket.socket)
                try:
                    closed = not connection.recv(65536)
                except BlockingIOError:
                    continue
                except OSError:
                    closed = True
                if closed:
                    missing.add(self._leave(connection))
            if time.monotonic() - dripped > 1.0:
                dripped = time.monotonic()
                for connection in self._slow.values():
                    with suppress(OSError):
                        connection.send(b"x")
        for key in list(self._selector.get_map().values()):
            assert isinstance(key.fileobj, socket.socket)
            self._leave(key.fileobj)

    @property
    def present(self) -> int:
        return len(self._selector.get_map())

    def __enter__(self) -> Crowd:
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self.thread.join()


def descriptors(service: Service) -> int:
    return len(list(Path(f"/proc/{service.process.pid}/fd").iterdir()))


def peak(service: Service) -> float:
    """Largest resident memory so far [MB]."""
    return int(re.search(r"VmHWM:\s*(\d+)", Path(f"/proc/{service.process.pid}/status").read_text())[1]) / 1024


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    """The result without any service."""
    folder = tmp_path_factory.mktemp("reference")
    (folder / "study.toml").write_text(MANY)
    script = Path(__file__).parents[1] / "stand_in.py"
    subprocess.run([sys.executable, script, folder / "study.toml", "-o", folder / "out.nc"], check=True)
    return open_dataset(folder / "out.nc")


@pytest.mark.parametrize(
    "host_of",
    [lambda _: "127.0.0.2", lambda number: f"127.1.{number // 250}.{number % 250 + 1}"],
    ids=("one address", "an address each"),
)
def test_a_crowd_keeps_no_other_client_out(tmp_path, reference, host_of):
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < 2 * (IDLE + SLOW):
        pytest.skip(f"the clients need {2 * (IDLE + SLOW)} descriptors, this process may have {hard}")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2 * (IDLE + SLOW)), hard))
    environment = {"ETC_TEST_SECONDS": "0.8"}
    with Service(tmp_path / "data", environment=environment, slow=True) as service:
        until(lambda: ask(f"{service.url}/api/studies")[0] == 200)
        before, memory, took, failed = descriptors(service), peak(service), [], []
        most = 0
        with Crowd(int(service.url.rsplit(":", 1)[1]), host_of) as crowd:
            until(lambda: crowd.returns >= 0)
            study = client.submit(service.server, MANY)["id"]
            state = "waiting"
            while state not in ("done", "failed"):
                began = time.perf_counter()
                try:
                    state = client.status(service.server, study)["state"]
                except Exception as error:  # each one counts
                    failed.append(error)
                took.append(time.perf_counter() - began)
                most = max(most, descriptors(service))
                assert time.perf_counter() - began < 60.0
                time.sleep(0.05)
            there, returns = crowd.present, crowd.returns
            result = client.fetch(service.server, study)
        grown = peak(service) - memory
        until(lambda: descriptors(service) <= before + 2)
        print(
            f"\n{len(took)} requests: median {1e3 * statistics.median(took):.1f} ms, worst {1e3 * max(took):.0f} ms, "
            f"{len(failed)} failed; memory +{grown:.0f} MB; descriptors {before}, at most {most}, "
            f"{descriptors(service)} after; {there} clients there at the end, {returns} returns"
        )
        assert not failed
        assert state == "done"
        assert differing_variables(reference, result) == []
        assert len(took) > 20  # the batch was watched while it ran; how fast depends on the machine
        assert grown < 150.0
        assert "Traceback" not in service.said()
