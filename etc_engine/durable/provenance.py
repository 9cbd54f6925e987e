"""Provenance: where a result comes from, as global attributes of its file."""

from __future__ import annotations

import json
import os
import platform
import resource
import shlex
import socket
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path
from urllib.parse import unquote, urlsplit

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
    """Commit of the engine: of its own repository, or of what it was installed from; else "unknown".

    An installation from a local clone has the commit of the clone, as long as its source is that of the clone.
    """
    home = Path(__file__).resolve().parents[2]
    if (home / ".git").exists():
        return _described(home, environment)
    try:
        origin = json.loads(distribution("etc-engine").read_text("direct_url.json") or "{}")
        commit = origin.get("vcs_info", {}).get("commit_id")
        address = urlsplit(origin.get("url", ""))
    except (PackageNotFoundError, ValueError, AttributeError):
        return "unknown"
    clone = Path(unquote(address.path))
    if commit is None and address.scheme == "file" and (clone / ".git").exists():
        same = _same_source(home / "etc_engine", clone / "etc_engine")
        return _described(clone, environment) if same else f"unknown ({clone} has changed since it was installed)"
    return str(commit or "unknown")


def _same_source(installed: Path, clone: Path) -> bool:
    """Whether both folders hold the same Python files."""
    files = sorted(path.relative_to(installed) for path in installed.rglob("*.py"))
    if files != sorted(path.relative_to(clone) for path in clone.rglob("*.py")):
        return False
    return all((installed / path).read_bytes() == (clone / path).read_bytes() for path in files)


def _described(clone: Path, environment: Mapping[str, str]) -> str:
    """Commit of a clone, with -dirty where it has changes; else "unknown"."""
    try:
        done = subprocess.run(
            ["git", "-C", str(clone), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"],
            capture_output=True,
            text=True,
            check=True,
            timeout=20,
            env={**environment, "GIT_OPTIONAL_LOCKS": "0"},
        )
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return done.stdout.strip()


def peak_bytes() -> int:
    """The most memory this process has held."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak
