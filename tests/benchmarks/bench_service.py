"""The service under load: what 50 polling clients cost a batch, and how fast 1000 queued studies are listed.

``python tests/benchmarks/bench_service.py [--pairs 3] [--clients 50] [--ranks 2] [--realizations 60]``

Batches with and without clients take turns. A client does what the page does: state every two seconds, queue every
four, figure when there are new packings. Clients run on this machine too and take from the batch what on other machines
they would not; the time the service itself spends on a processor is given beside it.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "service"))

from serving import STUDY, Service

from etc_engine.service import client

BATCH = """schema = 2
name = "load {number}"
seed = 20261
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.66, 0.70, 0.74]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = {realizations}
"""


def poll(url: str, study: str, begin: float, ended: threading.Event, times: list[float]) -> None:
    """One client, until told to stop."""
    connection = http.client.HTTPConnection(url.removeprefix("http://"), timeout=30)
    turn, drawn = 0, -1

    def get(path: str) -> bytes:
        started = time.perf_counter()
        connection.request("GET", path)
        body = connection.getresponse().read()
        times.append(time.perf_counter() - started)
        return body

    ended.wait(begin)
    while not ended.wait(2.0):
        if turn % 2 == 0:
            get("/api/studies?limit=200")
        done = json.loads(get(f"/api/studies/{study}"))["done"]
        if done != drawn:
            get(f"/api/studies/{study}/curve")
        turn, drawn = turn + 1, done
    connection.close()


def crowd(url: str, study: str, clients: int) -> None:
    """All clients, in a process of their own, until its standard input is closed; prints their times."""
    ended, times = threading.Event(), []
    threads = [
        threading.Thread(target=poll, args=(url, study, 2.0 * i / clients, ended, times)) for i in range(clients)
    ]
    for thread in threads:
        thread.start()
    sys.stdin.read()
    ended.set()
    for thread in threads:
        thread.join()
    print(json.dumps(times))


def processor_seconds(process: int) -> float:
    words = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def batch(service: Service, number: int, realizations: int, clients: int) -> tuple[float, float, list[float]]:
    """Seconds of a batch by its own log, seconds of the service on a processor, and times of the answers."""
    study = client.submit(service.server, BATCH.format(number=number, realizations=realizations))["id"]
    before, watchers = processor_seconds(service.process.pid), None
    if clients:
        line = [sys.executable, __file__, "--crowd", service.url, study, "--clients", str(clients)]
        watchers = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    ended = client.wait(service.server, study, interval=0.5)
    spent, times = processor_seconds(service.process.pid) - before, []
    if watchers is not None:
        times = json.loads(watchers.communicate()[0])
    found = re.search(r"computed now on \d+ ranks? in ([0-9.]+) s", ended["log"])
    assert found, ended
    return float(found.group(1)), spent, times


def measure_polling(pairs: int, clients: int, ranks: int, realizations: int) -> None:
    with tempfile.TemporaryDirectory() as folder, Service(Path(folder) / "data", {"ranks": ranks}) as service:
        batch(service, 0, 2, 0)  # compiles the kernels
        alone, watched, spent, times = [], [], [], []
        for pair in range(pairs):
            alone.append(batch(service, 2 * pair + 1, realizations, 0)[0])
            seconds, processor, answers = batch(service, 2 * pair + 2, realizations, clients)
            watched.append(seconds)
            spent.append(processor / (seconds * ranks))
            times += answers
            print(f"alone {alone[-1]:.2f} s, {clients} clients {watched[-1]:.2f} s", flush=True)
    ratio = statistics.median(two / one for one, two in zip(alone, watched, strict=True)) - 1.0
    rate = len(times) / sum(watched)
    print(f"slowed by {100 * ratio:.1f} % (median of pairs), clients on this machine included")
    print(f"service on a processor: {100 * statistics.mean(spent):.2f} % of the batch's {ranks} cores")
    print(f"{rate:.0f} requests/s, median {1e3 * statistics.median(times):.1f} ms, largest {1e3 * max(times):.0f} ms")


def measure_queue(count: int) -> None:
    with tempfile.TemporaryDirectory() as folder:
        environment = {"ETC_TEST_SECONDS": "600"}
        with Service(Path(folder) / "data", slow=True, environment=environment) as service:
            started = time.perf_counter()
            for number in range(count):
                client.submit(service.server, STUDY.replace("served", f"queued {number}"))
            print(f"{count} studies handed in: {1e3 * (time.perf_counter() - started) / count:.1f} ms each")
            times = []
            for _ in range(20):
                started = time.perf_counter()
                found = client.studies(service.server)
                times.append(time.perf_counter() - started)
            assert len(found) == count
            print(f"{count} listed: median {1e3 * statistics.median(times):.0f} ms, largest {1e3 * max(times):.0f} ms")
            client.cancel(service.server, found[-1]["id"])  # the one that runs: the service could not end before it


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--clients", type=int, default=50)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--realizations", type=int, default=60)
    parser.add_argument("--queued", type=int, default=1000)
    parser.add_argument("--crowd", nargs=2)
    options = parser.parse_args()
    if options.crowd:
        crowd(*options.crowd, options.clients)
        return
    measure_queue(options.queued)
    measure_polling(options.pairs, options.clients, options.ranks, options.realizations)


if __name__ == "__main__":
    main()
