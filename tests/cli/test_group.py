"""The command group: help, version, errors cut to one line, one thread a process."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest

from etc_engine import cli
from etc_engine.cli.threads import THREAD_VARIABLES
from etc_engine.errors import InputError


def etc_engine(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "etc_engine", *arguments],
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        env={**os.environ, **environment},
    )


def test_help_lists_commands_and_loads_nothing_heavy():
    heavy = ("numpy", "xarray", "numba", "scipy", "pydantic", "mpi4py", "matplotlib", "tqdm")
    code = (
        "import sys\nfrom etc_engine.cli import run\n"
        f"assert run(['--help']) == 0\nprint([m for m in {heavy!r} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "Commands:" in done.stdout or "Usage:" in done.stdout
    assert done.stdout.splitlines()[-1] == "[]"


def test_help_is_fast():
    started = time.perf_counter()
    assert etc_engine("--help").returncode == 0
    assert time.perf_counter() - started < 2.0  # 0.1 s on an idle machine; the bound leaves room for a busy one


def test_each_command_has_help():
    table = cli.CommandTable()
    for name in table.list_commands(click.Context(table)):
        done = etc_engine(name, "--help")
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(f"Usage: etc-engine {name}")


def test_version_is_a_name_and_a_number():
    done = etc_engine("--version")
    assert done.returncode == 0
    assert done.stdout.startswith("etc-engine ")


@pytest.mark.parametrize("arguments", [("nothing",), ("--nothing",)])
def test_usage_errors_are_one_line_and_status_2(arguments):
    done = etc_engine(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert "nothing" in done.stderr


@pytest.mark.parametrize(
    ("error", "status", "word"),
    [
        (InputError("found -1,\n expected a positive number"), 2, "found -1, expected"),
        (KeyboardInterrupt(), 130, "interrupted"),
        (ZeroDivisionError("oops"), 1, "unexpected ZeroDivisionError: oops"),
    ],
)
def test_what_a_command_raises_becomes_one_line(monkeypatch, capsys, error, status, word):
    @click.command("failing")
    def failing() -> None:
        raise error

    monkeypatch.setattr(cli.CommandTable, "get_command", lambda *_: failing)
    monkeypatch.setattr(cli, "hold_one_thread", lambda: None)  # the environment is this process's
    monkeypatch.delenv("ETC_ENGINE_TRACEBACK", raising=False)
    assert cli.run(["failing"]) == status
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = [line for line in captured.err.splitlines() if line]
    assert len(lines) == 1
    assert word in lines[0]


def test_what_a_command_returns_is_the_exit_status(monkeypatch):
    command = click.command("four")(lambda: 4)
    monkeypatch.setattr(cli.CommandTable, "get_command", lambda *_: command)
    monkeypatch.setattr(cli, "hold_one_thread", lambda: None)
    assert cli.run(["four"]) == 4


def _threads_seen(**environment: str) -> str:
    clean = {k: v for k, v in os.environ.items() if k not in THREAD_VARIABLES}
    code = (
        "from etc_engine.cli.threads import hold_one_thread\nhold_one_thread()\n"
        "import numpy, threadpoolctl\n"
        "numpy.ones((4, 4)) @ numpy.ones((4, 4))\n"
        "print({p['num_threads'] for p in threadpoolctl.threadpool_info()})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**clean, **environment}
    )
    return done.stdout.strip()


@pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="one core: BLAS never starts a second thread")
def test_one_thread_unless_asked():
    assert _threads_seen() == "{1}"
    assert _threads_seen(OPENBLAS_NUM_THREADS="2", OMP_NUM_THREADS="2") != "{1}"


LOST = "standard output cannot be written"
MANY = ("models",)
PACK = ("pack", "--radii", "equal:0.1", "--box", "1,1", "--seed", "5", "-o")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
@pytest.mark.parametrize("arguments", [("--help",), MANY, (*PACK, "-")])
def test_a_full_standard_output_ends_in_words(arguments):
    with Path("/dev/full").open("w") as full:
        done = _with_output(full, *arguments)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert f"{LOST} (No space left on device)" in done.stderr


@pytest.mark.parametrize("arguments", [("--version",), MANY, (*PACK, "-")])
def test_a_reader_that_leaves_ends_it_silently_and_a_closed_output_in_words(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = _with_output(writer, *arguments)
    os.close(writer)
    assert (done.returncode, done.stderr) == (141, "")
    none = subprocess.run(
        ["/bin/sh", "-c", '"$@" >&-', "sh", sys.executable, "-m", "etc_engine", *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert none.returncode == 2
    assert f"{LOST} (it is closed)" in none.stderr


def test_the_result_is_kept_where_nothing_can_be_printed(tmp_path):
    for name, redirection in (("a.csv", ">&-"), ("b.csv", "2>&-"), ("c.csv", ">&- 2>&- <&-")):
        subprocess.run(
            ["/bin/sh", "-c", f'"$@" {redirection}', "sh", sys.executable, "-m", "etc_engine", *PACK, tmp_path / name],
            capture_output=True,
            check=False,
        )
    whole = (tmp_path / "a.csv").read_text()
    assert whole.count("\n") > 10
    assert (tmp_path / "b.csv").read_text() == whole == (tmp_path / "c.csv").read_text()


def _with_output(output, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "etc_engine", *arguments], stdout=output, stderr=subprocess.PIPE, text=True, check=False
    )


def test_the_bare_command_shows_its_help():
    done = etc_engine()
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == etc_engine("--help").stdout
    assert "..." not in done.stdout.split("Commands:")[1]  # no sentence is cut
    assert "_ETC_ENGINE_COMPLETE=bash_source" in done.stdout


@pytest.mark.parametrize(("shell", "word"), [("bash", "complete -o nosort"), ("zsh", "compdef"), ("fish", "complete")])
def test_completion_is_there(shell, word):
    assert word in etc_engine(_ETC_ENGINE_COMPLETE=f"{shell}_source").stdout


def test_help_lists_every_word_of_engines_methods_and_rules():
    from etc_engine.medium.rules import RULES
    from etc_engine.realization.engines import ENGINES

    shown = {name: " ".join(etc_engine(name, "--help").stdout.split()) for name in ("solve", "homogenize")}
    for engine in ENGINES.values():
        text = shown["solve" if engine.needs_contacts else "homogenize"]
        assert f"{engine.name}: " in text
        options = text[text.index("--method ") :]
        for word in engine.methods:
            assert word in options, f"{engine.name} {word}"
    for word in RULES:
        assert word in shown["solve"]


def test_no_help_text_joins_two_ideas_by_a_semicolon():
    table = cli.CommandTable()
    for name in table.list_commands(click.Context(table)):
        command = table.get_command(click.Context(table), name)
        texts = [command.help, *(option.help for option in command.params if isinstance(option, click.Option))]
        joined = [text for text in texts if text and "; " in text]
        assert joined == []
