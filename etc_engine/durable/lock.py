"""The lock of an output file: one run at a time, and a dead run does not block the next.

The lock is a small file with the holder's host, process and batch job, touched every few seconds. It is
stale when its process is gone (same host), when its batch job was requeued and this is the requeued job,
or when it has not been touched for `SILENCE` seconds (another host). Times are compared on the clock of
the file system, so clocks of hosts may differ.

A small process of its own does the touching. A thread cannot: a compiled kernel holds the interpreter for minutes, and
the lock would look stale. The process waits on a pipe that only this one holds open, so that it ends together with
the run, however the run ends.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType

from etc_engine.errors import OutputError

BEAT = 10.0
SILENCE = 120.0
HEART = """
import os, select, sys
path, run, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
while not select.select([0], [], [], seconds)[0]:
    try:
        with open(path) as lock:
            if run not in lock.read():
                break
        os.utime(path)
    except OSError:
        break
"""
"""Touches a lock while its run holds it, until standard input ends: path, run, seconds."""


@dataclass(frozen=True)
class Holder:
    """Who holds a lock."""

    run: str
    host: str
    boot: str
    process: int
    process_start: str
    job: str = ""
    restarts: int = 0

    @classmethod
    def this_process(cls, run: str, environment: Mapping[str, str] = os.environ) -> Holder:
        """The running process, with the batch job it belongs to."""
        slurm, pbs = environment.get("SLURM_JOB_ID"), environment.get("PBS_JOBID")
        return cls(
            run=run,
            host=socket.gethostname(),
            boot=boot_identity(),
            process=os.getpid(),
            process_start=process_start_of(os.getpid()),
            job=f"slurm {slurm}" if slurm else f"pbs {pbs}" if pbs else "",
            restarts=int(environment.get("SLURM_RESTART_COUNT", "0")),
        )


class Lock:
    """The lock in a folder, held from ``with`` to the end of its block.

    Parameters
    ----------
    folder : Path
        The folder to lock; it exists.
    run : str
        The identity of this run.

    Raises
    ------
    OutputError
        If a living process holds the lock; the message says which, and what to do.
    """

    def __init__(self, folder: Path, run: str) -> None:
        self.path = folder / "lock"
        self.holder = Holder.this_process(run)
        self._heart: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> Lock:
        while not self._create(self.path):
            reason = alive(self.path, read_holder(self.path), self.holder)
            if reason:
                raise OutputError(f"another run is computing this output ({reason}): wait for it, or end it first")
            self._remove_stale()
        command = [sys.executable, "-I", "-S", "-c", HEART, str(self.path), self.holder.run, str(BEAT)]
        quiet = subprocess.DEVNULL  # an inherited output would keep a launcher waiting
        self._heart = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=quiet, stderr=quiet)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._heart is not None:
            assert self._heart.stdin is not None
            self._heart.stdin.close()
            self._heart.wait()
        if held_by(self.path, self.holder.run):
            self.path.unlink(missing_ok=True)

    def _create(self, path: Path) -> bool:
        """Put a lock in place with its content, unless there is one: a link is atomic, also on NFS."""
        draft = path.with_name(f".{path.name}.{self.holder.run}.tmp")
        try:
            draft.write_text(json.dumps(asdict(self.holder)))
            os.link(draft, path)
        except FileExistsError:
            return False
        except FileNotFoundError:
            path.parent.mkdir(exist_ok=True)  # the run before us has just removed its empty folder
            return False
        except OSError as error:
            raise OutputError(f"cannot write lock {path}: {error.strerror}") from None
        finally:
            draft.unlink(missing_ok=True)
        return True

    def _remove_stale(self) -> None:
        """Remove a stale lock, one run at a time: what is stale on a second look under the bolt stays so."""
        bolt = self.path.with_name("bolt")
        if not self._create(bolt):
            time.sleep(0.02)
            silent = seconds_since_touched(bolt)
            if silent is not None and silent > SILENCE:  # whoever set it died within microseconds of that
                bolt.unlink(missing_ok=True)
            return
        try:
            if self.path.exists() and not alive(self.path, read_holder(self.path), self.holder):
                self.path.unlink(missing_ok=True)
        finally:
            bolt.unlink(missing_ok=True)


def held_by(path: Path, run: str) -> bool:
    """True while a run holds a lock."""
    holder = read_holder(path)
    return holder is not None and holder.run == run


def read_holder(path: Path) -> Holder | None:
    """Who holds a lock; None if there is no lock, or none that can be read."""
    try:
        return Holder(**json.loads(path.read_text()))
    except (OSError, ValueError, TypeError):
        return None


def alive(path: Path, holder: Holder | None, me: Holder) -> str:
    """Why the holder of a lock counts as alive, in words; empty if the lock is stale or gone."""
    silent = seconds_since_touched(path)
    if silent is None:
        return ""
    if holder is None:
        return "" if silent > SILENCE or not path.exists() else f"its lock {path} cannot be read"
    who = f"process {holder.process} on {holder.host}"
    if holder.job and holder.job == me.job and holder.restarts < me.restarts:
        return ""
    if holder.host == me.host:
        same = holder.boot == me.boot and process_start_of(holder.process) == holder.process_start
        return f"{who} is running" if same and holder.process_start else ""
    if silent > SILENCE:
        return ""
    return f"{who} gave a sign of life {silent:.0f} s ago; after {SILENCE:.0f} s without one it counts as dead"


def seconds_since_touched(path: Path) -> float | None:
    """Age of a lock on the clock of its file system; None if it is gone."""
    probe = path.with_name(f".clock.{os.getpid()}.{time.monotonic_ns()}.tmp")
    try:
        probe.touch()
        now = probe.stat().st_mtime
        return now - path.stat().st_mtime
    except FileNotFoundError:
        return None
    except OSError as error:
        raise OutputError(f"cannot write beside lock {path}: {error.strerror}") from None
    finally:
        probe.unlink(missing_ok=True)


def boot_identity() -> str:
    """Identity of this boot of the machine, where the system knows it."""
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return ""


def process_start_of(process: int) -> str:
    """When a process started, in the system's own ticks; empty if there is no such process."""
    try:
        status = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
        return "" if status[0] == "Z" else status[19]
    except OSError:
        pass
    if Path("/proc/self/stat").exists():
        return ""
    try:  # a system without /proc: a number in use is all there is to see
        os.kill(process, 0)
    except OSError:
        return ""
    return "running"
