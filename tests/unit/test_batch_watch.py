"""The watch: when a rank has to end by itself."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from etc_engine.durable import watch
from etc_engine.durable.lock import Lock
from etc_engine.durable.watch import Watch


def test_a_rank_stays_while_its_run_holds_the_lock(tmp_path):
    with Lock(tmp_path, "mine"):
        assert Watch(tmp_path / "lock", "mine", launched=True).reason_to_leave() == ""
        assert "another run" in Watch(tmp_path / "lock", "other", launched=True).reason_to_leave()


def test_a_rank_leaves_when_rank_0_is_silent(tmp_path, monkeypatch):
    monkeypatch.setattr(watch, "SILENCE", 0.2)
    with Lock(tmp_path, "mine"):
        path = tmp_path / "lock"
        looking = Watch(path, "mine", launched=True)
        for _ in range(5):
            os.utime(path)
            assert looking.reason_to_leave() == ""
            time.sleep(0.1)
        time.sleep(0.2)
        assert "rank 0 has been silent" in looking.reason_to_leave()


def test_the_watch_ends_the_rank(tmp_path, monkeypatch):
    monkeypatch.setattr(watch, "LOOK", 0.01)
    reasons, left = [], threading.Event()

    def leave(reason):
        reasons.append(reason)
        left.set()

    with Watch(tmp_path / "lock", "mine", launched=False, leave=leave):
        assert left.wait(10.0)
    assert len(reasons) == 1
    assert "another run has taken over" in reasons[0]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes with parents")
def test_a_rank_whose_launcher_is_killed_leaves(tmp_path):
    """A shell stands in for the launcher; its child would sleep for a minute."""
    code = (
        "import pathlib, sys, time\nfrom etc_engine.durable import watch\nfrom etc_engine.durable.lock import Lock\n"
        "watch.LOOK = 0.05\nfolder = pathlib.Path(sys.argv[1])\n"
        "with Lock(folder, 'mine'), watch.Watch(folder / 'lock', 'mine', launched=True):\n"
        "    (folder / 'ready').touch()\n    time.sleep(60)\n"
    )
    errors = tmp_path / "errors"
    with errors.open("w") as stream:
        launcher = subprocess.Popen(
            ["sh", "-c", '"$@"; true', "sh", sys.executable, "-c", code, str(tmp_path)], stderr=stream
        )
    wait_until((tmp_path / "ready").exists)
    launcher.send_signal(signal.SIGKILL)
    launcher.wait()
    wait_until(lambda: "the launcher is gone" in errors.read_text())


def wait_until(condition) -> None:
    deadline = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.02)
