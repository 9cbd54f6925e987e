"""Launchers: how a batch is started, watched and ended, on this machine or through Slurm."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Protocol

from etc_engine.errors import InputError, OutputError
from etc_engine.service.processes import ProcessIdentity, kill_batch
from etc_engine.service.settings import Settings
from etc_engine.service.store import Store

SLURM = ("sbatch", "squeue", "scancel")
UNREACHABLE = (
    "unable to contact",
    "not responding",
    "timed out",
    "zero bytes were transmitted",
    "connection refused",
    "connect failure",
    "authentication error",
    "temporarily unable",
)
"""What commands of Slurm say when the controller, or munge, is down for a while."""
HELD_BY_SLURM = ("launch failed", "jobholdmaxrequeue")
"""Reasons for which Slurm itself holds a job, which then never starts: a node could not launch it."""
RANKS_PER_CORE = 16
"""More ranks than this are a mistake: one per core is fastest."""
HELD = 'ulimit -d "$1" 2>/dev/null; shift; exec "$@"'
"""Holds the memory of what follows (in kilobytes) and becomes it."""


class UnreachableError(OutputError):
    """The place where batches run does not reply; it may later."""


@dataclass(frozen=True)
class Ended:
    """A batch that has ended.

    Parameters
    ----------
    status : int, optional
        Its exit status, where it can be known.
    reason : str, optional
        Why it was given up, if not by itself.
    """

    status: int | None = None
    reason: str = ""


class Launcher(Protocol):
    """What the supervisor needs to know of the place where batches run."""

    concurrent: int
    """Batches at a time."""
    outlives: bool
    """Whether batches go on when the service stops."""

    @property
    def interval(self) -> float:
        """Seconds between two looks at a batch."""

    def start(self, study: str) -> str:
        """Start the batch of a study, unless one runs that could not be noted; returns how it is found again.

        Raises
        ------
        UnreachableError
            If the place does not reply, so that nothing is known of the study.
        OutputError
            If it refuses the batch.
        """

    def find(self, study: str) -> str:
        """A batch that was started and could not be noted; empty if there is none.

        Raises
        ------
        UnreachableError
            If the place does not reply.
        """

    def look(self, study: str, batch: str) -> Ended | None:
        """None while the batch runs or waits for its machines."""

    def stop(self, study: str, batch: str) -> None:
        """Ask a batch to end; it keeps what is finished."""

    def kill(self, study: str, batch: str) -> None:
        """End a batch and all that is left of it."""


@dataclass
class LocalLauncher:
    """``mpiexec`` on this machine, one batch at a time; without an mpiexec a single process."""

    store: Store
    settings: Settings
    concurrent: int = 1
    interval: float = 0.2
    outlives: bool = False
    _children: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    def command(self, study: str) -> list[str]:
        """The command line of a batch."""
        words = [*self.settings.engine, "sweep", str(self.store.study_file(study))]
        words += ["-o", str(self.store.result(study)), "--resume"]
        launcher = find_mpiexec() if self.settings.ranks > 1 else None
        return [launcher, "-n", str(self.settings.ranks), *words] if launcher else words

    def start(self, study: str) -> str:
        """Start it in a session of its own, so that signals to the service do not reach it."""
        kill_batch(self.store.result(study))
        kilobytes = str(self.settings.limits.memory_bytes // 1024)
        with self.store.log(study).open("ab") as log:
            child = subprocess.Popen(
                ["/bin/sh", "-c", HELD, "sh", kilobytes, *self.command(study)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                cwd=self.store.folder(study),
                env=batch_environment(),
            )
        self._children[study] = child
        return json.dumps(asdict(ProcessIdentity.of(child.pid)))

    def find(self, study: str) -> str:  # noqa: ARG002 - the protocol's signature
        """Nothing: `start` ends what was not noted."""
        return ""

    def look(self, study: str, batch: str) -> Ended | None:
        """Of a child the exit status is known; of a batch of an earlier service only that it has ended."""
        child = self._children.get(study)
        if child is not None:
            status = child.poll()
            if status is None:
                return None
            del self._children[study]
            return Ended(status)
        return None if batch and _identity(batch).alive else Ended()

    def stop(self, study: str, batch: str) -> None:  # noqa: ARG002 - the protocol's signature
        """SIGTERM to the launcher, which hands it on to every rank."""
        if batch:
            _identity(batch).signal(signal.SIGTERM)

    def kill(self, study: str, batch: str) -> None:
        """SIGKILL to everything that computes this result."""
        kill_batch(self.store.result(study))
        if batch:
            _identity(batch).signal(signal.SIGKILL)
        child = self._children.get(study)
        if child is not None:
            with suppress(subprocess.TimeoutExpired):
                child.wait(timeout=10.0)


@dataclass
class SlurmLauncher:
    """``sbatch`` with the script of ``jobs/``; the service, not the script, queues a stopped job again."""

    store: Store
    settings: Settings
    concurrent: int = 16
    outlives: bool = True

    @property
    def interval(self) -> float:
        """As the settings say: a controller is shared by many."""
        return self.settings.squeue_seconds

    def start(self, study: str) -> str:
        """Write the script beside the study and submit it; returns the number of the job.

        A job that was submitted earlier without the service noting its number is found by its name.
        """
        known = self.find(study)
        if known:
            return known
        folder = self.store.folder(study)
        shutil.copyfile(slurm_script(), folder / "slurm.sh")
        options = [f"--ntasks={self.settings.ranks}", f"--job-name={_job_name(study)}", f"--chdir={folder}"]
        options += [f"--output={self.store.log(study)}", *self.settings.sbatch]
        line = ["sbatch", "--parsable", *options, str(folder / "slurm.sh")]
        line += [str(self.store.study_file(study)), str(self.store.result(study)), str(self._status_file(study))]
        self._status_file(study).unlink(missing_ok=True)
        return self._ask(line).strip().splitlines()[-1].partition(";")[0]

    def find(self, study: str) -> str:
        """The number of a job of that name, of this user and in that folder."""
        line = ["squeue", "--noheader", f"--user={os.getuid()}", f"--name={_job_name(study)}", "--format=%i %Z"]
        for number, _, place in (row.strip().partition(" ") for row in self._ask(line).splitlines()):
            if place == str(self.store.folder(study)):
                return number
        return ""

    def look(self, study: str, batch: str) -> Ended | None:
        """Slurm forgets a job some minutes after its end, and then calls its number invalid.

        The exit status comes from the script of the job: it is there without accounting, and however late one looks.
        A job that Slurm holds after a failed launch is cancelled and counts as ended: nobody would release it.
        """
        if not batch:
            return Ended()
        try:
            found = self._ask(["squeue", "--noheader", f"--jobs={batch}", "--format=%T %r"])
        except UnreachableError:
            return None
        except OutputError as error:
            return Ended(self._status(study)) if "invalid job id" in str(error).lower() else None
        if any(words in found.lower() for words in HELD_BY_SLURM):
            self.stop(study, batch)
            return Ended(reason=f"Slurm holds its job: {found.strip().partition(' ')[2]}")
        return None if found.strip() else Ended(self._status(study))

    def stop(self, study: str, batch: str) -> None:  # noqa: ARG002 - the protocol's signature
        """``scancel``: SIGTERM now, SIGKILL after the site's KillWait."""
        if batch:
            with suppress(OutputError):
                self._ask(["scancel", batch])

    def kill(self, study: str, batch: str) -> None:
        """``scancel`` again, in case it was not heard, and with SIGKILL to the script and all ranks."""
        self.stop(study, batch)
        if batch:
            with suppress(OutputError):
                self._ask(["scancel", "--full", "--signal=KILL", batch])

    def _status_file(self, study: str) -> Path:
        return self.store.folder(study) / "status"

    def _status(self, study: str) -> int | None:
        """What the script wrote at its end; None if it was killed."""
        try:
            return int(self._status_file(study).read_text())
        except (OSError, ValueError):
            return None

    def _ask(self, line: Sequence[str]) -> str:
        """What a command of Slurm prints.

        Raises
        ------
        UnreachableError
            If the controller does not reply in time, or the command says that it cannot reach it.
        OutputError
            If it cannot be run or refuses.
        """
        seconds = self.settings.slurm_seconds
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        environment = {**batch_environment(), "PATH": path, "ETC_MAX_RESTARTS": "0"}
        try:
            done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=seconds, env=environment)
        except subprocess.TimeoutExpired:
            raise UnreachableError(f"{line[0]} has not replied for {seconds:g} s: trying again") from None
        except OSError as error:
            raise OutputError(f"{line[0]} cannot be run: {error}") from None
        if not done.returncode:
            return done.stdout
        reason = " ".join(done.stderr.split()) or f"status {done.returncode}"
        if any(words in reason.lower() for words in UNREACHABLE):
            raise UnreachableError(f"{reason}: trying again")
        raise OutputError(f"{line[0]} refuses: {reason}")


def check_launcher(settings: Settings) -> None:
    """Refuse a launcher that cannot start anything here, before the first study waits for it.

    Raises
    ------
    InputError
        If commands of Slurm are not on the PATH, or this machine is asked for far more ranks than it has cores.
    """
    if settings.launcher == "slurm":
        missing = [name for name in SLURM if shutil.which(name) is None]
        if missing:
            raise InputError(
                f"launcher slurm needs {', '.join(SLURM)}, not on the PATH: {', '.join(missing)}; "
                "start the service on a login node, or with --launcher local"
            )
        return
    most = RANKS_PER_CORE * (os.cpu_count() or 1)
    if settings.ranks > most:
        raise InputError(f"found {settings.ranks} ranks, this machine takes at most {most} ({RANKS_PER_CORE} a core)")


def make_launcher(store: Store, settings: Settings) -> Launcher:
    """The launcher that the settings name."""
    return SlurmLauncher(store, settings) if settings.launcher == "slurm" else LocalLauncher(store, settings)


def find_mpiexec() -> str | None:
    """The mpiexec of this installation, or the first one on the PATH."""
    beside = Path(sys.executable).with_name("mpiexec")
    return str(beside) if beside.exists() else shutil.which("mpiexec")


def slurm_script() -> Path:
    """The script of ``jobs/``: in the installed package, or in the source tree."""
    packed = Path(__file__).with_name("slurm.sh")
    return packed if packed.exists() else Path(__file__).parents[2] / "jobs" / "slurm.sh"


def _job_name(study: str) -> str:
    return f"etc-engine-{study}"


def _identity(batch: str) -> ProcessIdentity:
    return ProcessIdentity(**json.loads(batch))


def batch_environment() -> dict[str, str]:
    """The environment for batches, which have no use for the token."""
    return {key: value for key, value in os.environ.items() if key != "ETC_ENGINE_TOKEN"}
