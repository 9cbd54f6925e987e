"""The compiled kernels of the package: which they are, for which arguments, and how all of them are compiled at once.

numba compiles a kernel when it is first called and keeps the machine code on the disk. `kernels.jsonl` lists every
kernel with the types of its arguments: first those that call no other kernel, then those that call only these, and so
on. Processes that share the list out from its beginning therefore find on the disk what their kernels call.
"""

from __future__ import annotations

import json
import os
from collections.abc import Collection, Iterator
from concurrent.futures import BrokenExecutor, ProcessPoolExecutor, as_completed
from importlib import import_module
from multiprocessing import get_all_start_methods, get_context
from pathlib import Path
from typing import Any, NamedTuple

from etc_engine.errors import OutputError

LIST = Path(__file__).with_suffix(".jsonl")
NOWHERE = (
    "compiled kernels can be kept neither beside the package nor in the home folder: set NUMBA_CACHE_DIR to a folder "
    "that can be written"
)
"""What to do where numba says "no locator available"."""


class Kernel(NamedTuple):
    """A kernel, ``module:function``, and its arguments as `describe` writes them.

    ``uses`` are the packers and methods that call it from Python, such as "advancing-front 2D" or "dtem chord 2D".
    """

    name: str
    arguments: list[Any]
    uses: list[str]


def listed_kernels() -> list[Kernel]:
    """The kernels of the package, each after those that it calls."""
    return [Kernel(*json.loads(line)) for line in LIST.read_text().splitlines()]


def needed_kernels(uses: Collection[str]) -> list[Kernel]:
    """The listed kernels of some packers and methods, each after those that it calls."""
    kernels = listed_kernels()
    names: set[str] = set()
    waiting = {kernel.name for kernel in kernels if not set(uses).isdisjoint(kernel.uses)}
    while waiting:
        names |= waiting
        waiting = {callee for name in waiting for callee in callees(name)} - names
    return [kernel for kernel in kernels if kernel.name in names]


def callees(name: str) -> list[str]:
    """Names of the kernels that a kernel calls."""
    function = find(name).py_func
    called = [function.__globals__.get(word) for word in function.__code__.co_names]
    kernels = [one.py_func for one in called if hasattr(one, "py_func")]
    return [f"{one.__module__}:{one.__qualname__}" for one in kernels]


def describe(kind: Any) -> Any:
    """A numba type in words that JSON holds.

    Arrays are "float64 2C" or "float64 1C readonly", tuples are lists, named tuples are ``{"module:class": [...]}``.

    Examples
    --------
    >>> from numba import types
    >>> describe(types.UniTuple(types.Array(types.float64, 2, "C", readonly=True), 2))
    ['float64 2C readonly', 'float64 2C readonly']
    """
    types = _numba_types()
    if isinstance(kind, types.Array):
        return f"{kind.dtype} {kind.ndim}{kind.layout}{'' if kind.mutable else ' readonly'}"
    if isinstance(kind, types.BaseTuple):
        parts = [describe(part) for part in kind]
        named = isinstance(kind, types.BaseNamedTuple)
        return {f"{kind.instance_class.__module__}:{kind.instance_class.__qualname__}": parts} if named else parts
    return str(kind)


def numba_type(words: Any) -> Any:
    """The numba type that `describe` wrote.

    Examples
    --------
    >>> numba_type([["int64", "bool"], "float64 1C"])
    Tuple((Tuple((int64, bool)), Array(float64, 1, 'C', False, aligned=True)))
    """
    types = _numba_types()
    if isinstance(words, list):
        return types.BaseTuple.from_types([numba_type(part) for part in words])
    if isinstance(words, dict):
        ((name, parts),) = words.items()
        return types.BaseTuple.from_types([numba_type(part) for part in parts], find(name))
    name, _, rest = words.partition(" ")
    scalar = types.boolean if name == "bool" else getattr(types, name)
    if not rest:
        return scalar
    shape, _, readonly = rest.partition(" ")
    return types.Array(scalar, int(shape[:-1]), shape[-1], readonly=bool(readonly))


def compile_kernel(kernel: Kernel) -> bool:
    """Compile a kernel, or read it from the disk if it is there; returns whether it was compiled."""
    dispatcher = find(kernel.name)
    before = sum(dispatcher.stats.cache_misses.values())
    dispatcher.compile(tuple(numba_type(words) for words in kernel.arguments))
    return bool(sum(dispatcher.stats.cache_misses.values()) > before)


def is_compiled(kernel: Kernel) -> bool:
    """Whether the disk holds a kernel."""
    dispatcher = find(kernel.name)
    types = tuple(numba_type(words) for words in kernel.arguments)
    return dispatcher._cache.load_overload(types, dispatcher.targetctx) is not None


def compile_all(jobs: int) -> Iterator[bool]:
    """Compile every listed kernel in ``jobs`` processes.

    Parameters
    ----------
    jobs : int
        Number of processes.

    Yields
    ------
    bool
        For each kernel that is ready: whether it was compiled, not read from the disk.

    Raises
    ------
    OutputError
        If a kernel cannot be compiled or kept.
    """
    quickest = "fork" if "fork" in get_all_start_methods() else "spawn"  # Windows cannot fork
    with ProcessPoolExecutor(jobs, get_context(quickest)) as pool:
        started = [pool.submit(compile_kernel, kernel) for kernel in listed_kernels()]
        for future in as_completed(started):
            try:
                yield future.result()
            except (BrokenExecutor, OSError, RuntimeError) as error:
                pool.shutdown(cancel_futures=True)
                if "no locator available" in str(error):
                    raise OutputError(NOWHERE) from error
                raise OutputError(f"kernels cannot be compiled and kept: {error}") from error


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _numba_types() -> Any:
    from numba import types  # takes long to import: --help does without

    return types


def find(name: str) -> Any:
    """The object of a name such as ``module:function``."""
    module, _, attribute = name.partition(":")
    return getattr(import_module(module), attribute)
