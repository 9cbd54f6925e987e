"""A real Slurm on this machine, for tests: munge, a controller and some nodes, in a folder that is removed at the end.

Needs root and the Debian packages ``slurm-wlm`` and ``munge``; neither systemd nor anything in /etc is used. By hand::

    python tests/cluster/real_slurm.py COMMAND...     # runs COMMAND with SLURM_CONF set, then ends the daemons
"""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field
from pathlib import Path

DAEMONS = ("munged", "slurmctld", "slurmd")
CONF = """
ClusterName=tests
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller_port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
MpiDefault=pmi2
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=1,bf_interval=1,batch_sched_delay=0
ReturnToService=2
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
FirstJobId={first}
KillWait=5
MinJobAge=120
MessageTimeout=10
SlurmdParameters=config_overrides
"""


def missing() -> str:
    """Why no Slurm can be started here; empty if one can."""
    path = f"{os.environ.get('PATH', '')}{os.pathsep}/usr/sbin{os.pathsep}/sbin"
    absent = [name for name in (*DAEMONS, "sbatch", "srun") if shutil.which(name, path=path) is None]
    if absent:
        return f"not installed: {', '.join(absent)} (packages slurm-wlm and munge)"
    return "" if os.geteuid() == 0 else "a Slurm of its own needs root"


@dataclass
class Cluster:
    """Nodes ``n1`` ... that pretend to have ``cpus`` processors each; use as a context manager."""

    nodes: int = 1
    cpus: int = 64
    folder: Path = field(default_factory=lambda: Path(tempfile.mkdtemp(prefix="slurm-")))
    _daemons: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        return [f"n{i + 1}" for i in range(self.nodes)]

    @property
    def environment(self) -> dict[str, str]:
        """What the commands of Slurm need to find this cluster and no other."""
        outside = {key: value for key, value in os.environ.items() if not key.startswith(("SLURM_", "PMI_", "SBATCH_"))}
        return {**outside, "SLURM_CONF": str(self.folder / "slurm.conf")}

    def __enter__(self) -> Cluster:
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(subprocess.SubprocessError, OSError):
            self.ask("scancel", "--signal=KILL", "--full", "--user=root")
        for name in reversed(list(self._daemons)):
            self.end(name)
        if not os.environ.get("KEEP_SLURM"):
            shutil.rmtree(self.folder, ignore_errors=True)

    def _start(self) -> None:
        self.folder.chmod(0o755)
        (self.folder / "state").mkdir()
        key = self.folder / "munge.key"
        key.touch(0o600)
        key.write_bytes(secrets.token_bytes(1024))
        controller, *ports = _free_ports(1 + self.nodes)
        first = 1000 + secrets.randbelow(1_000_000)  # not the numbers of an earlier cluster: MPI names files after them
        text = CONF.format(
            host=socket.gethostname().partition(".")[0], folder=self.folder, controller_port=controller, first=first
        )
        for name, port in zip(self.names, ports, strict=True):
            text += f"NodeName={name} NodeHostname=localhost NodeAddr=127.0.0.1 Port={port} CPUs={self.cpus}\n"
            (self.folder / f"spool-{name}").mkdir()
        text += f"PartitionName=short Nodes={','.join(self.names)} Default=YES MaxTime=INFINITE DefaultTime=10\n"
        (self.folder / "slurm.conf").write_text(text)
        self.begin_munge()
        self.begin_controller()
        for name in self.names:
            self._begin(name, ["slurmd", "-D", "-N", name])
        self.wait_until("sinfo", "--noheader", "--format=%T", shows="idle")

    def begin_munge(self) -> None:
        """Start munge with a key and a socket of its own."""
        here = self.folder
        files = [f"--key-file={here}/munge.key", f"--socket={here}/munge.socket", f"--pid-file={here}/munge.pid"]
        files += [f"--log-file={here}/munge.log", f"--seed-file={here}/munge.seed"]
        self._begin("munged", ["munged", "--foreground", "--force", *files])
        deadline = time.monotonic() + 20.0
        while not (here / "munge.socket").exists():
            assert time.monotonic() < deadline, (here / "munged.out").read_text()
            time.sleep(0.02)

    def begin_controller(self) -> None:
        """Start the controller, with the state of an earlier one if there is any."""
        self._begin("slurmctld", ["slurmctld", "-D", "-i"])

    def end(self, name: str, number: int = signal.SIGTERM) -> None:
        """End a daemon and wait for it."""
        daemon = self._daemons.pop(name)
        daemon.send_signal(number)
        try:
            daemon.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            daemon.kill()
            daemon.wait()

    def ask(self, *line: str, check: bool = True, timeout: float = 30.0) -> str:
        """What a command of Slurm prints."""
        done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=timeout, env=self.environment)
        assert done.returncode == 0 or not check, f"{line}: {done.stderr}"
        return done.stdout.strip()

    def wait_until(self, *line: str, shows: str, seconds: float = 60.0) -> None:
        """Ask again and again until a command shows a word."""
        deadline = time.monotonic() + seconds
        while shows not in (found := self.ask(*line, check=False)):
            assert time.monotonic() < deadline, f"{line}: {found!r} instead of {shows!r}"
            time.sleep(0.1)

    def submit(self, *words: str, environment: Mapping[str, str] | None = None, folder: Path | None = None) -> str:
        """The number of a job handed to sbatch."""
        done = subprocess.run(
            ["sbatch", "--parsable", *words],
            capture_output=True,
            text=True,
            check=False,
            timeout=30.0,
            cwd=folder,
            env={**self.environment, **(environment or {})},
        )
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def state(self, job: str) -> str:
        """The state of a job in Slurm's words, such as RUNNING."""
        return self.shown(job, "JobState")

    def shown(self, job: str, key: str) -> str:
        """A value that ``scontrol show job`` gives."""
        words = self.ask("scontrol", "--oneliner", "show", "job", job).split()
        return next(word.partition("=")[2] for word in words if word.startswith(f"{key}="))

    def start_now(self, job: str) -> None:
        """Start a requeued job, which would wait two minutes; a little it has to: its node counts in whole seconds."""
        self.wait(job, "PENDING")
        time.sleep(2.5)
        deadline = time.monotonic() + 30.0
        line = ["scontrol", "update", f"JobId={job}", "StartTime=now"]
        while subprocess.run(line, capture_output=True, env=self.environment, check=False).returncode:
            assert time.monotonic() < deadline, self.ask("scontrol", "show", "job", job)
            time.sleep(0.1)

    def wait(self, job: str, *states: str, seconds: float = 60.0) -> str:
        """Wait until a job is in one of some states; without any, until it has ended."""
        wanted = states or ("COMPLETED", "FAILED", "CANCELLED", "TIMEOUT", "NODE_FAIL", "OUT_OF_MEMORY")
        deadline = time.monotonic() + seconds
        while (state := self.state(job)) not in wanted:
            assert time.monotonic() < deadline, self.ask("scontrol", "show", "job", job)
            time.sleep(0.05)
        return state

    def _begin(self, name: str, line: Sequence[str]) -> None:
        path = f"{os.environ.get('PATH', '')}{os.pathsep}/usr/sbin{os.pathsep}/sbin"
        program = shutil.which(line[0], path=path)
        assert program is not None
        with (self.folder / f"{name}.out").open("ab") as log:
            self._daemons[name] = subprocess.Popen(
                [program, *line[1:]], stdin=subprocess.DEVNULL, stdout=log, stderr=log, env=self.environment
            )


def _free_ports(count: int) -> list[int]:
    with ExitStack() as held:
        sockets = [held.enter_context(closing(socket.socket())) for _ in range(count)]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


if __name__ == "__main__":
    with Cluster() as cluster:
        sys.exit(subprocess.run(sys.argv[1:], env=cluster.environment, check=False).returncode)
