"""Whole files or none: links, permissions, devices and what killed processes leave behind."""

from __future__ import annotations

import os
import socket
import stat
import subprocess
import sys

import pytest

from etc_engine.durable.files import replacing
from etc_engine.errors import OutputError


def write(path, text):
    with replacing(path) as temporary:
        temporary.write_text(text)


def test_a_link_stays_and_the_file_behind_it_is_replaced(tmp_path):
    target, link = tmp_path / "target.nc", tmp_path / "link.nc"
    target.write_text("old")
    link.symlink_to(target)
    write(link, "new")
    assert link.is_symlink()
    assert target.read_text() == "new"


def test_a_dangling_link_is_written_through(tmp_path):
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "later")
    write(link, "new")
    assert link.is_symlink()
    assert (tmp_path / "later").read_text() == "new"


@pytest.mark.parametrize("mode", [0o640, 0o600, 0o755])
def test_permissions_stay(tmp_path, mode):
    path = tmp_path / "out.csv"
    path.write_text("old")
    path.chmod(mode)
    write(path, "new")
    assert stat.S_IMODE(path.stat().st_mode) == mode


def test_a_new_file_has_the_usual_permissions(tmp_path):
    plain, path = tmp_path / "plain", tmp_path / "out"
    plain.write_text("")
    write(path, "new")
    assert path.stat().st_mode == plain.stat().st_mode


def test_pipes_and_devices_are_refused_and_stay(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for place in (pipe, "/dev/null"):
        with pytest.raises(OutputError, match="a device or a pipe"):
            write(place, "new")
    assert stat.S_ISFIFO(pipe.stat().st_mode)


def test_what_a_killed_process_left_is_removed_and_nothing_else(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    names = {
        "dead": f".z?.nc.etc-engine-{socket.gethostname()}-{dead.pid}-1.nc",
        "living": f".z?.nc.etc-engine-{socket.gethostname()}-{os.getpid()}-1.nc",
        "other output": f".za.nc.etc-engine-{socket.gethostname()}-{dead.pid}-1.nc",
        "other host": f".z?.nc.etc-engine-elsewhere-{dead.pid}-1.nc",
    }
    for name in names.values():
        (tmp_path / name).touch()
    write(tmp_path / "z?.nc", "new")
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {"z?.nc", *(name for key, name in names.items() if key != "dead")}


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "out"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert [(p.name, p.read_text()) for p in tmp_path.iterdir()] == [("out", "old")]


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(OutputError, match="cannot write"):
        write(tmp_path / "none" / "out", "new")
