"""The lock: one run at a time, stale locks recognised on this host, in this job and elsewhere."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from dataclasses import asdict, replace

import pytest

from etc_engine.durable import lock
from etc_engine.durable.lock import SILENCE, Holder, Lock, held_by
from etc_engine.errors import OutputError


def place(folder, holder, age=0.0):
    path = folder / "lock"
    path.write_text(json.dumps(asdict(holder)))
    now = path.stat().st_mtime
    os.utime(path, (now - age, now - age))


ELSEWHERE = replace(Holder.this_process("old"), host="elsewhere")


def test_a_second_run_is_refused_and_the_end_frees_the_lock(tmp_path):
    with Lock(tmp_path, "first"):
        assert held_by(tmp_path / "lock", "first")
        with pytest.raises(OutputError, match=f"process {os.getpid()} on .* is running"):
            Lock(tmp_path, "second").__enter__()
        assert held_by(tmp_path / "lock", "first")
    with Lock(tmp_path, "second"):
        assert held_by(tmp_path / "lock", "second")
    assert not list(tmp_path.iterdir())


def test_the_lock_of_a_killed_process_is_stale(tmp_path):
    code = (
        "import os, pathlib, sys\nfrom etc_engine.durable.lock import Lock\n"
        "Lock(pathlib.Path(sys.argv[1]), 'killed').__enter__()\nos.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    assert held_by(tmp_path / "lock", "killed")
    with Lock(tmp_path, "next"):
        assert held_by(tmp_path / "lock", "next")


@pytest.mark.parametrize(
    ("holder", "age", "free"),
    [
        (replace(ELSEWHERE, host=Holder.this_process("x").host, process_start="1"), 0.0, True),  # number reused
        (replace(ELSEWHERE, host=Holder.this_process("x").host, boot="before"), 0.0, True),  # rebooted
        (ELSEWHERE, SILENCE / 2, False),
        (ELSEWHERE, SILENCE + 1, True),
        (replace(ELSEWHERE, job="slurm 7"), 0.0, True),  # this is the same job, requeued
        (replace(ELSEWHERE, job="slurm 7", restarts=2), 0.0, False),
        (replace(ELSEWHERE, job="slurm 8"), 0.0, False),
    ],
)
def test_when_a_lock_is_stale(tmp_path, monkeypatch, holder, age, free):
    monkeypatch.setenv("SLURM_JOB_ID", "7")
    monkeypatch.setenv("SLURM_RESTART_COUNT", "2")
    place(tmp_path, holder, age)
    if free:
        with Lock(tmp_path, "next"):
            assert held_by(tmp_path / "lock", "next")
    else:
        with pytest.raises(OutputError, match="on elsewhere gave a sign of life"):
            Lock(tmp_path, "next").__enter__()


def test_a_lock_that_cannot_be_read_is_stale_only_when_old(tmp_path):
    path = tmp_path / "lock"
    path.write_text("{")
    with pytest.raises(OutputError, match="cannot be read"):
        Lock(tmp_path, "next").__enter__()
    now = path.stat().st_mtime
    os.utime(path, (now - SILENCE - 1, now - SILENCE - 1))
    with Lock(tmp_path, "next"):
        assert held_by(path, "next")


def test_the_holder_shows_signs_of_life_while_python_is_busy(tmp_path, monkeypatch):
    """sum over a range holds the interpreter, as a compiled kernel does: no thread of this process can run."""
    monkeypatch.setattr(lock, "BEAT", 0.02)
    with Lock(tmp_path, "first"):
        path = tmp_path / "lock"
        touched = 0
        for _ in range(100):
            os.utime(path, (1.0, 1.0))
            sum(range(3_000_000))
            touched += path.stat().st_mtime > 1.0
            if touched > 2:
                break
        assert touched > 2


def test_nothing_touches_a_lock_whose_process_was_killed(tmp_path):
    code = (
        "import os, pathlib, sys\nfrom etc_engine.durable import lock\nlock.BEAT = 0.02\n"
        "lock.Lock(pathlib.Path(sys.argv[1]), 'killed').__enter__()\nos.kill(os.getpid(), 9)"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path)], check=False)
    path = tmp_path / "lock"
    threading.Event().wait(0.5)  # for the shell to notice
    os.utime(path, (1.0, 1.0))
    threading.Event().wait(0.5)
    assert path.stat().st_mtime == 1.0


def test_of_many_that_find_a_stale_lock_one_gets_it(tmp_path):
    place(tmp_path, ELSEWHERE, SILENCE + 1)
    inside, most, refused = [], [], []
    gate = threading.Barrier(8)

    def run(number):
        gate.wait()
        try:
            with Lock(tmp_path, f"run{number}"):
                inside.append(number)
                most.append(len(inside))
                gate_out.wait()
                inside.remove(number)
        except OutputError:
            refused.append(number)
            gate_out.wait()

    gate_out = threading.Barrier(8)
    threads = [threading.Thread(target=run, args=(n,)) for n in range(8)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert max(most) == 1
    assert len(refused) == 7
