"""Kill a sweep again and again at random moments; nothing finished may be lost or changed.

By hand: ``python tests/faults/kills.py --kills 50``. Prints kills, kills that landed while units were being
computed, units lost and units changed, and ends with status 1 if there was any of the last two. A unit is
finished when its record is in a shard; what a rank was computing when it died is computed again.
"""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from etc_engine.sweep.dataset import differing_variables
from etc_engine.sweep.plan import Unit
from etc_engine.sweep.result_file import open_dataset
from etc_engine.sweep.shards import ShardReader, shard_folder

STAND_IN = Path(__file__).parent.parent / "stand_in.py"
MPIEXEC = Path(sys.executable).with_name("mpiexec")
STUDY = """
schema = 2
name = "kills"
seed = 271828
[packing]
radii = "uniform:0.01:0.02"
box = [1.0, 1.0]
density = [0.60, 0.65, 0.70, 0.75]
[contacts]
rule = "bonded"
contact_angle = [2.5, 5.0]
[statistics]
realizations = 4
relative_ci = 0.04
max_realizations = 16
"""
UNITS = 40
"""About as many units the study needs, for the choice of moments."""


@dataclass
class Tally:
    """What happened so far."""

    kills: int = 0
    landed: int = 0
    lost: int = 0
    changed: int = 0
    again: int = 0
    completed: int = 0
    refused: int = 0
    kinds: Counter[str] = field(default_factory=Counter)

    def __str__(self) -> str:
        kinds = ", ".join(f"{name} {n}" for name, n in sorted(self.kinds.items()))
        return (
            f"kills {self.kills} ({kinds}); landed mid-run {self.landed}; units lost {self.lost}; "
            f"units changed {self.changed}; sweeps completed {self.completed}; "
            f"units computed again because they had no record yet {self.again}; "
            f"starts refused because orphans held the lock {self.refused}"
        )


def kill_sweeps(folder: Path, kills: int, ranks: int, seed: int, unit_seconds: float = 0.08) -> Tally:
    """Kill sweeps until so many kills have been made, then let the last one finish."""
    rng = np.random.Generator(np.random.PCG64(seed))
    study, reference = folder / "study.toml", folder / "reference.nc"
    study.write_text(STUDY)
    tally, sweep = Tally(), _Sweep(folder, ranks, unit_seconds)
    began = time.monotonic()
    subprocess.run([*sweep.launcher, str(STAND_IN), str(study), "-o", str(reference)], check=True)
    start = time.monotonic() - began  # its units take no time
    compute = 2 * UNITS * unit_seconds / ranks
    while tally.kills < kills:
        kind = KINDS[int(rng.integers(len(KINDS)))]
        before = sweep.computed()
        alive = sweep.start_and_strike(kind, float(rng.uniform(0.5 * start, start + 0.5 * compute)), rng)
        if alive:
            tally.kills += 1
            tally.kinds[kind.__name__.strip("_")] += 1
            tally.landed += sweep.computed() > before and not sweep.output.exists()
        sweep.check(tally, reference)
    finished = tally.completed
    while tally.completed == finished:
        sweep.start_and_strike(None, 0.0, rng)
        sweep.check(tally, reference)
    tally.refused = sweep.refused
    return tally


class _Sweep:
    """One output that is computed in many attempts."""

    def __init__(self, folder: Path, ranks: int, unit_seconds: float) -> None:
        self.folder, self.unit_seconds = folder, unit_seconds
        self.launcher = [str(MPIEXEC), "-n", str(ranks)] * (ranks > 1) + [sys.executable]
        self.output, self.log = folder / "out.nc", folder / "log"
        self.known: dict[Unit, bytes] = {}
        self.refused = 0

    def start_and_strike(
        self, kind: Callable[[_Sweep, int, np.random.Generator], None] | None, delay: float, rng: np.random.Generator
    ) -> bool:
        """Start or go on; strike after a delay. Answers whether the sweep was alive then."""
        command = [*self.launcher, str(STAND_IN), str(self.folder / "study.toml"), "-o", str(self.output)]
        command += ["--policy", "resume", "--seconds", str(self.unit_seconds), "--log", str(self.log)]
        with (self.folder / "errors").open("w") as errors:
            running = subprocess.Popen(command, stderr=errors, stdout=subprocess.DEVNULL)
        if kind is None:
            running.wait(timeout=300)
        else:
            try:
                running.wait(timeout=delay)
            except subprocess.TimeoutExpired:
                family = descendants(running.pid)
                kind(self, running.pid, rng)
                running.wait(timeout=60)
                if kind is not _launcher:  # its orphans are met by the next attempt
                    wait_for_end(family)
                return True
        errors_text = (self.folder / "errors").read_text()
        if running.returncode == 2 and "another run is computing" in errors_text:
            self.refused += 1
            time.sleep(0.1)
        elif running.returncode not in (0, 75):
            raise RuntimeError(f"the sweep ended with status {running.returncode}: {errors_text}")
        return False

    def records(self) -> dict[Unit, bytes]:
        """The bits of all finished units."""
        reader = ShardReader(shard_folder(self.output))
        return {
            record.unit: b"".join(cell.conductivity.tobytes() for cell in record.result.cells)
            for record in reader.read(reader.files())
        }

    def computed(self) -> int:
        """Units computed since the sweep was begun, by all attempts."""
        return len(self.log.read_text().splitlines()) if self.log.exists() else 0

    def check(self, tally: Tally, reference: Path) -> None:
        """Count what is gone or different since the last look."""
        if self.output.exists():
            whole, mended = open_dataset(reference), open_dataset(self.output)
            if differing_variables(whole, mended):
                same = (whole["conductivity"] == mended["conductivity"]) | whole["conductivity"].isnull()
                tally.changed += max(1, int((~same.all(("contact_angle", "direction_i", "direction_j"))).sum()))
            tally.again += self.computed() - int((whole["worker_rank"] >= 0).sum())
            tally.completed += 1
            self.begin_anew()
            return
        now = self.records()
        tally.lost += len(self.known.keys() - now.keys())
        tally.changed += sum(now[unit] != bits for unit, bits in self.known.items() if unit in now)
        self.known = now

    def begin_anew(self) -> None:
        """Forget the finished sweep, and shards it had no time to remove; keep its file as the last one."""
        shutil.rmtree(shard_folder(self.output), ignore_errors=True)
        self.output.replace(self.folder / "last.nc")
        self.log.unlink(missing_ok=True)
        self.known = {}


def _one_rank(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGKILL to one rank: what the out-of-memory killer does."""
    workers = rank_processes(launcher)
    if workers:
        kill(workers[int(rng.integers(len(workers)))], signal.SIGKILL)
    else:
        kill(launcher, signal.SIGKILL)


def _all_ranks(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGKILL to everything: a scheduler at the end of its patience."""
    for process in [launcher, *descendants(launcher)]:
        kill(process, signal.SIGKILL)


def _launcher(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGKILL to the launcher alone: its ranks may live on as orphans."""
    kill(launcher, signal.SIGKILL)


def _warning(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGTERM to the launcher, which hands it on."""
    kill(launcher, signal.SIGTERM)


def _warning_one(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGTERM to one rank only: the others have to hear of it."""
    workers = rank_processes(launcher)
    kill(workers[int(rng.integers(len(workers)))] if workers else launcher, signal.SIGTERM)


def _cut_shard(sweep: _Sweep, launcher: int, rng: np.random.Generator) -> None:
    """SIGKILL to everything, and half a record at the end of a shard, as a crash of the machine leaves it."""
    _all_ranks(sweep, launcher, rng)
    wait_for_end(descendants(launcher))
    shards = sorted(shard_folder(sweep.output).glob("*.shard"))
    if shards:
        whole = shards[-1].read_bytes()
        with shards[-1].open("ab") as stream:
            stream.write(whole[: int(rng.integers(1, 200))])


KINDS = (_one_rank, _all_ranks, _launcher, _warning, _warning_one, _cut_shard)


def kill(process: int, number: int) -> None:
    """A signal to a process that may have ended already."""
    try:
        os.kill(process, number)
    except ProcessLookupError:
        return


def descendants(process: int) -> list[int]:
    """All processes below one, from the system's table."""
    children: dict[int, list[int]] = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        children.setdefault(int(words[1]), []).append(int(stat.parent.name))
    found, todo = [], [process]
    while todo:
        below = children.get(todo.pop(), [])
        found += below
        todo += below
    return found


def rank_processes(launcher: int) -> list[int]:
    """The Python processes below a launcher."""
    return [process for process in descendants(launcher) if b"stand_in.py" in command_line(process)]


def command_line(process: int) -> bytes:
    """The command line of a process; empty if it has ended."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes()
    except OSError:
        return b""


def wait_for_end(processes: list[int], patience: float = 60.0) -> None:
    """Wait until processes are gone: orphans work on until they notice."""
    deadline = time.monotonic() + patience
    while any(b"stand_in.py" in command_line(process) for process in processes):
        if time.monotonic() > deadline:
            raise RuntimeError(f"processes {processes} do not end")
        time.sleep(0.02)


def main() -> int:
    """Kill, count, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--seed", type=int, default=None, help="of the moments and kinds; drawn if not given")
    options = parser.parse_args()
    seed = secrets.randbits(32) if options.seed is None else options.seed
    print(f"seed {seed}, {options.ranks} ranks", flush=True)
    folder = Path(tempfile.mkdtemp(prefix="kills-"))
    try:
        tally = kill_sweeps(folder, options.kills, options.ranks, seed)
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    print(tally)
    return 1 if tally.lost or tally.changed else 0


if __name__ == "__main__":
    sys.exit(main())
