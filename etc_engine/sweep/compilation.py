"""Compilation shared out among the ranks of a sweep: without it every rank compiles the same kernels."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from etc_engine.kernels import compile_kernel, is_compiled, needed_kernels
from etc_engine.realization import ENGINES
from etc_engine.study.sweep import Study
from etc_engine.sweep.scheduler import Communicator, on_rank_zero


def share_compilation(study: Study, communicator: Communicator, stopped: Callable[[], bool]) -> None:
    """Compile what a study needs, each rank a part of it, if the disk does not hold it yet.

    Parameters
    ----------
    study : Study
    communicator : Communicator
        Every rank calls this function.
    stopped : callable
        Whether to leave the rest.
    """
    if communicator.size == 1:
        return
    kernels = needed_kernels(uses_of(study))
    if not kernels or on_rank_zero(communicator, lambda: is_compiled(kernels[-1])):
        return
    for kernel in kernels[communicator.rank :: communicator.size]:
        if stopped():
            break
        with suppress(Exception):  # the list only saves time: a kernel that it has wrong is compiled when it is called
            compile_kernel(kernel)
    communicator.wait_for_all(lambda: None)


def uses_of(study: Study) -> set[str]:
    """Packer and methods of a study in the words of `Kernel.uses`.

    Examples
    --------
    >>> from etc_engine.study.sweep import parse_study
    >>> text = '''schema = 2
    ... name = "bed"
    ... seed = 1
    ... packing = { radii = "equal:0.1", box = [1.0, 1.0] }
    ... contacts = { rule = "bonded", contact_angle = 5.0 }
    ... statistics = { realizations = 2 }'''
    >>> sorted(uses_of(parse_study(text)))
    ['advancing-front 2D', 'dtem chord 2D', 'sweep 2D']
    """
    dimension, engine = study.box.dimension, ENGINES[study.conduction.engine]
    methods = set(study.methods)
    if engine.needs_contacts and not all(study.pores_conduct):  # where pores insulate, a method of pores gives way
        methods.add(engine.default_method(dimension, False))
    words = {getattr(study.packing, "method", "files"), "sweep"} | {f"{engine.name} {method}" for method in methods}
    return {f"{word} {dimension}D" for word in words}
