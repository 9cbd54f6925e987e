"""The progress of a sweep on a terminal and in a log."""

from __future__ import annotations

import os
import pty
import re
import select
import signal
import subprocess
import sys
import termios
import time
from itertools import pairwise
from pathlib import Path

import pytest
from numba import njit

from etc_engine.cli import progress
from etc_engine.cli.progress import PackingProgress, Progress
from etc_engine.cli.ticker import COMPILING, Tally, progress_words

HELD = """
import ctypes, os, sys
from etc_engine.cli.progress import Progress
hold = ctypes.PyDLL(None).usleep  # keeps the interpreter, as a compiled kernel does
with Progress({seconds}) as shown:
    shown.report(0, 4, 0)
    print(shown._ticker.pid, flush=True)
    hold({hold})
    shown.report(1, 4, 0)
"""


def held(hold: float, seconds: float = 60.0) -> list[str]:
    """A command whose only unit holds the interpreter."""
    return [sys.executable, "-c", HELD.format(seconds=seconds, hold=int(1e6 * hold))]


def alive(number: int) -> bool:
    try:
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def gone(number: int, seconds: float = 10.0) -> bool:
    end = time.monotonic() + seconds
    while alive(number) and time.monotonic() < end:
        time.sleep(0.02)
    return not alive(number)


def on_a_terminal(command: list[str]) -> list[tuple[float, str]]:
    """What a command writes on a terminal of 80 columns, with the seconds since its start."""
    master, slave = pty.openpty()
    termios.tcsetwinsize(slave, (24, 80))
    started, written = time.monotonic(), []
    with subprocess.Popen(command, stdin=slave, stdout=subprocess.DEVNULL, stderr=slave):
        os.close(slave)
        while True:
            select.select([master], [], [])
            try:
                data = os.read(master, 65536)
            except OSError:  # Linux: no process has the other end open
                break
            written.append((time.monotonic() - started, data.decode()))
    os.close(master)
    return written


def test_a_bar_moves_while_a_unit_holds_the_interpreter():
    written = on_a_terminal(held(5.0))
    shown = [(at, text) for at, text in written if "0/4 units" in text]
    assert len(shown) >= 4, written
    assert max(b - a for (a, _), (b, _) in pairwise(shown)) < 5.0
    assert len(set(re.findall(r"\d\d:\d\d", "".join(text for _, text in shown)))) >= 4
    assert "1/4 units" in written[-1][1] + written[-2][1]


def test_a_log_gets_lines_while_a_unit_holds_the_interpreter():
    done = subprocess.run(held(1.2, 0.25), capture_output=True, text=True, check=True)
    lines = done.stderr.splitlines()
    assert 3 <= len(lines) <= 5, lines
    assert set(lines) == {"etc-engine: 0/4 units, 0 units/s, no estimate yet, failed cells: 0"}


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the process in /proc")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_killed_sweep_leaves_no_process(number):
    with subprocess.Popen(held(60.0), stdout=subprocess.PIPE, text=True) as sweep:
        assert sweep.stdout is not None
        ticker = int(sweep.stdout.readline())
        assert alive(ticker)
        sweep.send_signal(number)
    assert gone(ticker)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for the process in /proc")
def test_a_signal_to_all_leaves_the_bar_until_the_sweep_ends():
    """Ctrl-C reaches both: the sweep finishes its unit, and the bar stays so long."""
    with Progress() as shown:
        shown.report(0, 4, 0)
        assert shown._ticker is not None
        time.sleep(0.5)  # it has set its signals
        shown._ticker.send_signal(signal.SIGINT)
        shown._ticker.send_signal(signal.SIGTERM)
        time.sleep(0.2)
        assert shown._ticker.poll() is None
    assert shown._ticker.poll() == 0


def test_a_reader_that_is_stopped_holds_up_nothing(monkeypatch):
    monkeypatch.setattr(progress, "END_SECONDS", 0.1)
    with Progress() as shown:
        shown.report(0, 10**5, 0)
        assert shown._ticker is not None
        shown._ticker.send_signal(signal.SIGSTOP)
        for done in range(5000):  # more than a pipe holds
            shown.report(done, 10**5, 0)
    assert shown._ticker.poll() == -signal.SIGKILL


def test_a_log_is_left_alone_for_a_minute(capfd):
    with Progress() as shown:
        for done in range(50):
            shown.report(done, 100, 0)
    assert capfd.readouterr().err == ""


def test_a_log_says_that_kernels_are_compiled(capfd):
    @njit
    def inner(x):
        return x + 1.0

    @njit
    def outer(x):
        return inner(x) * 2.0

    sent: list[dict[str, object]] = []
    with Progress() as shown:
        shown.report(0, 3, 0)
        shown._send = sent.append  # type: ignore[method-assign,assignment]
        outer(1.0)
        outer(2.0)
    assert sent == [{"compiling": True}, {"compiling": False}]  # the inner kernel is part of it, the second call not
    assert capfd.readouterr().err == ""


def test_the_words_while_kernels_compile_fit_a_narrow_terminal():
    tally = Tally()
    tally.take({"done": 0, "planned": 1000, "failed": 0}, 0.0)
    tally.take({"compiling": True}, 0.0)
    assert tally.text(1.0) == f"0/1000 units, {COMPILING}"
    assert "compiling kernels (once per machine, about" in tally.text(1.0)
    assert len("  0%|| 00:05 ") + len(tally.text(1.0)) < 80
    tally.take({"compiling": False}, 2.0)
    assert "compiling" not in tally.text(2.0)


def test_the_compilation_before_the_first_unit_is_no_part_of_the_rate():
    """55 s of compilation, then a unit a second: 40 units are left after a minute."""
    tally = Tally()
    for done in range(6):
        tally.take({"done": done, "planned": 45, "failed": 0}, 55.0 + done if done else 0.0)
    assert tally.text(60.0) == "5/45 units, 1 units/s, 40 s to go, failed cells: 0"


def test_units_of_an_earlier_run_do_not_count_for_the_rate():
    tally = Tally()
    for done in (90, 91, 92):
        tally.take({"done": done, "planned": 100, "failed": 2}, 10.0 * (done - 90))
    assert tally.text(20.0) == "92/100 units, 0.1 units/s, 80 s to go, failed cells: 2"
    assert "no estimate yet" in progress_words(90, 100, 0, 0, 0.0)


def test_a_packing_bar_never_shrinks_and_is_for_terminals(capsys, monkeypatch):
    with PackingProgress() as shown:
        shown.report(0.5)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(progress, "BAR_DELAY", 0.0)
    with PackingProgress() as shown:
        for fraction in (0.2, 0.6, 0.4, 1.0):
            shown.report(fraction)
            assert shown._bar.n == max(fraction, 0.6 if fraction == 0.4 else 0.0)
    assert "packing:" in capsys.readouterr().err
