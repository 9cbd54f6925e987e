"""The scheduler: every rank computes, and takes its next unit from a shared counter.

The counter lives in a window of one-sided MPI on rank 0; a rank adds one to it and reads what was there
(Fetch_and_op), without any work of rank 0. One process needs no MPI: `Solo` takes the same calls.
This is the only module that imports mpi4py, and only when a launcher started more than one process.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from types import ModuleType
from typing import Any, NoReturn, Protocol, TypeVar, cast

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import EtcError, InputError
from etc_engine.ranks import Alone, Ranks

T = TypeVar("T")

LAUNCHER_SIZES = {
    "PMI_SIZE": "MPICH, Intel MPI or a relative",
    "OMPI_COMM_WORLD_SIZE": "Open MPI",
    "MV2_COMM_WORLD_SIZE": "MVAPICH",
    "SLURM_STEP_NUM_TASKS": "srun",
    "PALS_SIZE": "Cray PALS",
}
"""Where launchers write the number of processes. A batch script itself (no srun) has no such variable."""

STOP = 1 << 48
"""Added to the counter, this ends the work of every rank at its next unit."""

POLL_SECONDS = 0.005
ABORT_SECONDS = 0.5
"""Time for the launcher to pass on the last words of a rank before it ends all."""


class Communicator(Ranks, Protocol):
    """What a sweep needs of its ranks."""

    def broadcast(self, value: Any) -> Any:
        """The value of rank 0, on every rank."""

    def gather(self, value: Any) -> list[Any] | None:
        """The values of all ranks on rank 0, None elsewhere."""

    def wait_for_all(self, meanwhile: Callable[[], None]) -> None:
        """Return when every rank is here; call ``meanwhile`` now and then."""

    def add(self, slot: int, increment: int) -> int:
        """Add to a shared counter (slots 0 to 3) and return what was there before."""

    def close(self) -> None:
        """Give back what the counters hold; every rank calls it."""

    def abort(self, status: int) -> NoReturn:
        """End all ranks at once: the way out when this rank cannot go on."""


class Solo(Alone):
    """The communicator of a single process, without MPI."""

    def __init__(self) -> None:
        self._slots = [0, 0, 0, 0]

    def broadcast(self, value: Any) -> Any:
        """The value itself."""
        return value

    def gather(self, value: Any) -> list[Any]:
        """The value, as a list of one."""
        return [value]

    def wait_for_all(self, meanwhile: Callable[[], None]) -> None:
        """Nobody to wait for."""
        meanwhile()

    def add(self, slot: int, increment: int) -> int:
        """Add to a counter and return what was there before."""
        before = self._slots[slot]
        self._slots[slot] += increment
        return before

    def close(self) -> None:
        """Nothing to give back."""

    def abort(self, status: int) -> NoReturn:
        """End this process."""
        sys.exit(status)


class World:
    """The communicator of all ranks that a launcher started.

    Parameters
    ----------
    mpi : module
        ``mpi4py.MPI``.

    Notes
    -----
    Networks without atomic operations in hardware serve one-sided calls only while rank 0 is inside MPI;
    MPICH then wants ``MPIR_CVAR_ASYNC_PROGRESS=1``. Within a node, and on InfiniBand, none is needed.
    """

    def __init__(self, mpi: ModuleType) -> None:
        self._mpi = mpi
        self._comm = mpi.COMM_WORLD
        self.rank: int = self._comm.Get_rank()
        self.size: int = self._comm.Get_size()
        words = 4 if self.rank == 0 else 0
        self._window = mpi.Win.Allocate(8 * words, 8, comm=self._comm)
        if words:
            np.frombuffer(self._window.tomemory(), dtype=np.int64)[:] = 0
        self._comm.Barrier()
        self._window.Lock_all()

    def broadcast(self, value: Any) -> Any:
        """The value of rank 0, on every rank."""
        return self._comm.bcast(value, root=0)

    def gather(self, value: Any) -> list[Any] | None:
        """The values of all ranks on rank 0, None elsewhere."""
        answer: list[Any] | None = self._comm.gather(value, root=0)
        return answer

    def share(self, value: Any) -> list[Any]:
        """The values of all ranks, on every rank."""
        every: list[Any] = self._comm.allgather(value)
        return every

    def exchange(self, values: Sequence[Any]) -> list[Any]:
        """One value from each rank, for one value to each rank."""
        others = [None if rank == self.rank else value for rank, value in enumerate(values)]
        received: list[Any] = self._comm.alltoall(others)
        received[self.rank] = values[self.rank]  # not copied
        return received

    def add_up(self, values: Floats | Ints) -> Any:
        """Sum of an array over the ranks, on every rank."""
        own = np.ascontiguousarray(values)
        total = np.empty_like(own)
        self._comm.Allreduce(own, total, op=self._mpi.SUM)
        return total

    def wait_for_all(self, meanwhile: Callable[[], None]) -> None:
        """A barrier that sleeps: a spinning rank would take the core of one that still works."""
        request = self._comm.Ibarrier()
        while not request.Test():
            meanwhile()
            time.sleep(POLL_SECONDS)
        meanwhile()

    def add(self, slot: int, increment: int) -> int:
        """Fetch_and_op on the window of rank 0."""
        before = np.empty(1, dtype=np.int64)
        self._window.Fetch_and_op(np.array([increment], dtype=np.int64), before, 0, slot, self._mpi.SUM)
        self._window.Flush(0)
        return int(before[0])

    def close(self) -> None:
        """Free the window."""
        self._window.Unlock_all()
        self._window.Free()

    def abort(self, status: int) -> NoReturn:
        """MPI_Abort: without it the other ranks would wait for this one for ever."""
        sys.stderr.flush()
        time.sleep(ABORT_SECONDS)
        self._comm.Abort(status)
        sys.exit(status)


def launched_size(environment: Mapping[str, str] = os.environ) -> tuple[int, str]:
    """How many processes a launcher says it started, and which launcher; (1, "") without one.

    Examples
    --------
    >>> launched_size({"PMI_SIZE": "4"})
    (4, 'MPICH, Intel MPI or a relative')
    """
    for name, launcher in LAUNCHER_SIZES.items():
        if environment.get(name, "").isdigit():
            return int(environment[name]), launcher
    return 1, ""


def connect(environment: Mapping[str, str] = os.environ) -> Communicator:
    """The communicator for the way this process was started.

    ``ETC_ENGINE_MPI=1`` asks for MPI under a launcher that is not known here, ``=0`` refuses it.

    Raises
    ------
    InputError
        If several processes were started and MPI cannot join them: each would compute the whole sweep.
    """
    size, launcher = launched_size(environment)
    wish = environment.get("ETC_ENGINE_MPI", "")
    if wish == "0" or (size <= 1 and wish != "1"):
        return Solo()
    try:
        from mpi4py import MPI
    except (ImportError, RuntimeError) as error:
        raise InputError(
            f"{launcher or 'ETC_ENGINE_MPI=1'} wants {size} processes, but mpi4py finds no MPI library "
            f"({' '.join(str(error).split())}): load "
            "the MPI of this machine, or install the extra 'mpi'"
        ) from None
    seen = MPI.COMM_WORLD.Get_size()
    if launcher and size != seen:
        library = MPI.Get_library_version().splitlines()[0].strip()
        raise InputError(
            f"{launcher} started {size} processes but the MPI library ({library}) sees {seen}: launcher "
            "and library are of different kinds, use the mpiexec that belongs to the library"
        )
    return World(MPI)


def on_rank_zero(communicator: Communicator, action: Callable[[], T]) -> T:
    """What an action returns on rank 0, on every rank; an EtcError there is raised on every rank."""
    answer: tuple[T | None, EtcError | None] = (None, None)
    if communicator.rank == 0:
        try:
            answer = (action(), None)
        except EtcError as error:
            answer = (None, error)
    answer = communicator.broadcast(answer)
    if answer[1] is not None:
        raise answer[1]
    return cast(T, answer[0])
