"""Provenance: where a result comes from, as global attributes of its file."""

from __future__ import annotations

import json
import os
import platform
import shlex
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path
from typing import Any

import numpy as np

import etc_engine
from etc_engine.batch.study import Study

LIBRARIES = ("numpy", "scipy", "pyamg", "numba", "xarray", "netCDF4", "mpi4py")


@dataclass(frozen=True)
class Run:
    """One start of a sweep; a sweep that was interrupted has several."""

    run: str
    started: str
    command: str
    host: str
    ranks: int
    job: str
    engine: str
    commit: str


def this_run(run: str, ranks: int, job: str) -> Run:
    """The description of the running process as a run."""
    return Run(run, now(), command_line(), socket.gethostname(), ranks, job, engine_version(), engine_commit())


def command_line() -> str:
    """The command that started this process, to be typed again."""
    program, *arguments = sys.argv
    if Path(program).name in ("etc-engine", "__main__.py"):
        program = "etc-engine"
    return shlex.join([program, *arguments])


def now() -> str:
    """The time, in ISO 8601 and UTC."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def attributes(study: Study, text: str, runs: Sequence[Run], hosts: Sequence[str]) -> dict[str, Any]:
    """Global attributes of the result of a sweep."""
    ended = now()
    return {
        "Conventions": "CF-1.11",
        "title": f"{study.name}: effective thermal conductivity over random realizations",
        "source": f"etc_engine {engine_version()}, engine {study.conduction.engine}",
        "history": f"{ended} {runs[-1].command}",
        "study": text,
        "study_resolved": json.dumps(study.resolved()),
        "study_digest": study.digest(),
        "seed": np.int64(study.seed),
        "confidence_level": study.statistics.confidence,
        "versions": json.dumps(versions()),
        "commit": runs[-1].commit,
        "command": runs[-1].command,
        "hosts": ", ".join(sorted(set(hosts))),
        "runs": json.dumps([asdict(run) for run in runs]),
        "started": runs[0].started,
        "ended": ended,
    }


def versions() -> dict[str, str]:
    """Versions of what decides the bits of a result."""
    return {
        "etc_engine": engine_version(),
        "python": platform.python_version(),
        "machine": platform.machine(),
        **{name: _version(name) for name in LIBRARIES},
    }


def engine_version() -> str:
    """Version of this package."""
    return _version("etc-engine")


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def engine_commit(environment: Mapping[str, str] = os.environ) -> str:
    """Commit of the engine: of its own repository, or what it was installed from; else "unknown"."""
    home = Path(etc_engine.__file__).resolve().parent.parent
    if (home / ".git").exists():
        try:
            done = subprocess.run(
                ["git", "-C", str(home), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
                capture_output=True,
                text=True,
                check=True,
                timeout=20,
                env={**environment, "GIT_OPTIONAL_LOCKS": "0"},
            )
        except (OSError, subprocess.SubprocessError):
            return "unknown"
        return done.stdout.strip()
    try:
        origin = json.loads(distribution("etc-engine").read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return "unknown"
    return str(origin.get("vcs_info", {}).get("commit_id", "unknown"))
