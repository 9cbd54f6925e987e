"""The progress of a sweep on a terminal and in a log."""

from __future__ import annotations

import re
import sys

from etc_engine.cli import progress
from etc_engine.cli.progress import PackingProgress, Progress, progress_line


def test_a_log_is_left_alone_for_a_minute(capsys):
    with Progress() as shown:
        for done in range(50):
            shown.report(done, 100, 0)
    assert capsys.readouterr().err == ""


def test_a_log_gets_one_line_for_each_period(capsys, monkeypatch):
    clock = iter(range(0, 1000, 25))
    monkeypatch.setattr(progress.time, "monotonic", lambda: float(next(clock)))
    with Progress() as shown:
        for done in range(10):
            shown.report(20 + done, 120, 2)
    lines = capsys.readouterr().err.splitlines()
    assert 2 <= len(lines) <= 5
    assert re.fullmatch(r"etc-engine: 2\d/120 units, 0\.0\d+ units/s, \d+ s to go, failed cells: 2", lines[0]), lines[0]


def test_the_compilation_before_the_first_unit_is_no_part_of_the_rate(capsys, monkeypatch):
    """55 s of compilation, then a unit a second: 40 units are left after a minute."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with Progress() as shown:
        for done in range(1, 16):
            now[0] = 55.0 + done
            shown.report(done, 45, 0)
    first = capsys.readouterr().err.splitlines()[0]
    assert first == "etc-engine: 5/45 units, 1 units/s, 40 s to go, failed cells: 0"


def test_units_of_an_earlier_run_do_not_count_for_the_rate():
    assert "0.1 units/s, 100 s to go" in progress_line(90, 100, 0, 10, 100.0)
    assert "no estimate yet" in progress_line(90, 100, 0, 0, 0.0)


def test_a_terminal_gets_a_bar(capsys, monkeypatch):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with Progress() as shown:
        shown.report(30, 120, 0)
        shown.report(120, 120, 3)
    bar = capsys.readouterr().err
    assert "120/120" in bar
    assert "failed cells: 3" in bar


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
