from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent / "service")]

from cluster_study import STUDY  # noqa: E402 - beside this file, once that is on the path
from real_slurm import Cluster, missing  # noqa: E402

SLOW_ENGINE = HERE.parent / "service" / "slow_engine.py"


@pytest.fixture(scope="session")
def slurm():
    """Two nodes with 32 processors each, so they say."""
    reason = missing()
    if reason:
        pytest.skip(f"no Slurm: {reason}")
    if shutil.which("mpiexec", path=str(Path(sys.executable).parent)) is None:
        pytest.skip("no MPI beside python: install the extra 'mpi'")
    with Cluster(nodes=2, cpus=32) as cluster:
        yield cluster


@pytest.fixture
def place(tmp_path):
    """A folder with a study, and a command ``etc-engine`` whose units take a while."""
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "etc-engine"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} {SLOW_ENGINE} "$@"\n')
    program.chmod(0o755)
    return tmp_path


@pytest.fixture
def slow(place):
    """The environment of a job that uses this command: ``slow(seconds a unit)``."""

    def environment(seconds: float) -> dict[str, str]:
        path = f"{place / 'bin'}:{os.environ['PATH']}"
        launcher = f"env PATH={path} srun --kill-on-bad-exit=1"
        return {
            "PATH": path,
            "ETC_LAUNCHER": launcher,
            "ETC_TEST_SECONDS": str(seconds),
            "ETC_TEST_LOG": str(place / "units"),
        }

    return environment
