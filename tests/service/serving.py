"""A real service in a process of its own, for tests: started, killed and started again."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from etc_engine.service.client import Server

HERE = Path(__file__).parent
SLOW_ENGINE = HERE / "slow_engine.py"
STUDY = """schema = 2
name = "served"
seed = 271828
[packing]
radii = "uniform:0.03:0.06"
box = [1.0, 1.0]
density = [0.55, 0.60]
[contacts]
rule = "bonded"
contact_angle = [5.0, 10.0]
[statistics]
realizations = 3
"""
START = """
import json, sys
from pathlib import Path
from etc_engine.errors import EtcError
from etc_engine.service.server import serve
from etc_engine.service.settings import Limits, Settings
options = json.loads(sys.argv[1])
limits = Limits(**options.pop("limits", {}))
for name in ("engine", "hosts", "sbatch"):
    if name in options:
        options[name] = tuple(options[name])
try:
    serve(Settings(Path(options.pop("data")), limits=limits, **options), lambda where: print(where, flush=True))
except EtcError as error:
    sys.exit(f"etc-engine: {error}")
"""


@dataclass
class Service:
    """A service and how to reach it; ``options`` are those of `Settings`."""

    data: Path
    options: Mapping[str, Any] = field(default_factory=dict)
    environment: Mapping[str, str] = field(default_factory=dict)
    slow: bool = False
    process: subprocess.Popen[str] | None = None
    url: str = ""

    def start(self) -> Service:
        options: dict[str, Any] = {"data": str(self.data), "port": 0, **self.options}
        if self.slow:
            options["engine"] = [sys.executable, str(SLOW_ENGINE)]
        with (self.data.parent / "service.log").open("a") as log:
            self.process = subprocess.Popen(
                [sys.executable, "-c", START, json.dumps(options)],
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                env={**os.environ, **self.environment},
            )
        self.url = self.process.stdout.readline().strip()
        assert self.url, (self.data.parent / "service.log").read_text()
        return self

    def end(self, number: int = signal.SIGTERM) -> int:
        """End it by a signal and wait."""
        if self.process is None:
            return 0
        self.process.send_signal(number)
        self.process.stdout.close()
        try:
            return self.process.wait(timeout=60)
        finally:
            self.process = None

    @property
    def server(self) -> Server:
        return Server(self.url, str(self.options.get("token", "")))

    def said(self) -> str:
        return (self.data.parent / "service.log").read_text()

    def __enter__(self) -> Service:
        return self.start()

    def __exit__(self, *_: object) -> None:
        self.end()


def ask(url: str, method: str = "GET", body: bytes | None = None, **headers: str) -> tuple[int, dict[str, str], bytes]:
    """Status, headers and body of any request; header names are given with underscores."""
    named = {name.replace("_", "-"): value for name, value in headers.items()}
    request = urllib.request.Request(url, body, named, method=method)
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, dict(answer.headers), answer.read()
    except urllib.error.HTTPError as error:
        with error:
            return error.code, dict(error.headers), error.read()


def until(condition: Callable[[], Any], seconds: float = 60.0) -> Any:
    """What a condition answers once that is true."""
    deadline = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < deadline, "it does not come"
        time.sleep(0.02)
    return found


def renamed(name: str) -> str:
    """The study under another name: another study."""
    return re.sub('name = ".*"', f'name = "{name}"', STUDY)
