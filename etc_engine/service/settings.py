"""What the service was started with."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

DEFAULT_PORT = 8765
ENGINE = (sys.executable, "-m", "etc_engine")
"""The command line of this very installation."""


@dataclass(frozen=True)
class Limits:
    """Limits of requests, studies and runs.

    Parameters
    ----------
    study_bytes, upload_bytes : int
        Largest text of a study, and file of particles.
    units, cells : int
        Largest number of packings of a study (adaptive ones at their cap), and of results on them.
    particles : int
        Largest expected number of particles in a packing.
    memory_bytes : int
        Memory per rank, and of a single solve.
    study_seconds, solve_seconds : float
        Longest time of a study's batch (one start of it) and of a single solve.
    waiting : int
        Largest number of studies in the queue.
    solves : int
        Single solves at the same time; four times as many may wait, uploads under way included.
    connections, client_connections : int
        Connections at the same time, and those of one address.
    idle_seconds : float
        Longest time that a connection may wait with no request, or with the beginning of one.
    body_seconds, body_rate : float
        Time for a body to come: so long, and the time of its bytes at this rate [bytes/s].
    """

    study_bytes: int = 64 * 1024
    upload_bytes: int = 32 * 1024 * 1024
    units: int = 100_000
    cells: int = 1_000_000
    particles: int = 1_000_000
    memory_bytes: int = 8192 * 10**6
    study_seconds: float = 7 * 86400.0
    solve_seconds: float = 120.0
    waiting: int = 10_000
    solves: int = 1
    connections: int = 1000
    client_connections: int = 200
    idle_seconds: float = 20.0
    body_seconds: float = 20.0
    body_rate: float = 16 * 1024


@dataclass(frozen=True)
class Settings:
    """The options of ``serve``.

    Parameters
    ----------
    data : Path
        The data directory.
    host, port : str, int
        Where to listen; port 0 takes a free one.
    ranks : int
        Ranks of a batch.
    launcher : {"local", "slurm"}
        How batches are started.
    token : str
        What clients show; empty only on a loopback address.
    hosts : tuple of str
        Further names under which clients may call, such as that of a proxy.
    sbatch : tuple of str
        Further options of ``sbatch``.
    squeue_seconds : float
        How often Slurm is asked for the state of a job, and tried again while its controller does not reply.
    slurm_seconds : float
        How long a command of Slurm may take until the controller counts as not replying.
    limits : Limits
    engine : tuple of str
        The command that is followed by ``sweep``, ``solve`` or ``report``.
    """

    data: Path
    host: str = "127.0.0.1"
    port: int = DEFAULT_PORT
    ranks: int = 1
    launcher: Literal["local", "slurm"] = "local"
    token: str = field(default="", repr=False)
    hosts: tuple[str, ...] = ()
    sbatch: tuple[str, ...] = ()
    squeue_seconds: float = 5.0
    slurm_seconds: float = 60.0
    limits: Limits = field(default_factory=Limits)
    engine: tuple[str, ...] = ENGINE
