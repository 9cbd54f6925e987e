"""Compilation shared out among ranks."""

from __future__ import annotations

import pytest

from etc_engine import kernels
from etc_engine.study.sweep import parse_study
from etc_engine.sweep import compilation
from etc_engine.sweep.scheduler import Solo

STUDY = """schema = 2
name = "bed"
seed = 1
packing = { radii = "equal:0.1", box = [1.0, 1.0] }
contacts = { rule = "bonded", contact_angle = 5.0 }
pores = { conductivity = [0.0, 0.1] }
conduction = { method = "cell" }
statistics = { realizations = 2 }
"""


class Rank(Solo):
    """One of several ranks that never wait."""

    def __init__(self, rank: int, size: int) -> None:
        super().__init__()
        self.rank, self.size = rank, size


@pytest.fixture
def compiled(monkeypatch):
    """The kernels that were compiled, in a process that compiles none."""
    found = []
    monkeypatch.setattr(compilation, "compile_kernel", found.append)
    monkeypatch.setattr(compilation, "is_compiled", lambda _: False)
    return found


def share(size: int, stopped: bool = False) -> None:
    for rank in range(size):
        compilation.share_compilation(parse_study(STUDY), Rank(rank, size), lambda: stopped)


@pytest.mark.parametrize("size", [2, 3, 200])
def test_each_kernel_is_compiled_by_one_rank(compiled, size):
    share(size)
    needed = kernels.needed_kernels({"advancing-front 2D", "dtem cell 2D", "dtem chord 2D", "sweep 2D"})
    assert len(needed) > 50
    assert sorted(map(str, compiled)) == sorted(map(str, needed))


def test_a_single_process_and_a_stopped_run_compile_nothing_ahead(compiled):
    share(1)
    share(2, stopped=True)
    assert compiled == []


def test_nothing_is_read_where_the_disk_holds_the_kernels(compiled, monkeypatch):
    monkeypatch.setattr(compilation, "is_compiled", lambda _: True)
    compilation.share_compilation(parse_study(STUDY), Rank(0, 2), lambda: False)
    assert compiled == []


def test_a_kernel_that_the_list_has_wrong_stops_no_sweep(monkeypatch):
    def fails(kernel: kernels.Kernel) -> bool:
        raise AttributeError(kernel.name)

    monkeypatch.setattr(compilation, "compile_kernel", fails)
    monkeypatch.setattr(compilation, "is_compiled", lambda _: False)
    share(2)


def test_every_kernel_comes_after_those_that_it_calls():
    before: set[str] = set()
    for kernel in kernels.listed_kernels():
        called = set(kernels.callees(kernel.name)) - {kernel.name}
        assert called & {one.name for one in kernels.listed_kernels()} <= before | {kernel.name}, kernel.name
        before.add(kernel.name)


def test_every_use_is_a_packer_a_method_or_the_sweep():
    from etc_engine.packing.algorithms import METHODS
    from etc_engine.realization import ENGINES

    packers = {f"{packer} {d}D" for packer in METHODS for d in (2, 3)}
    methods = {f"{name} {word} {d}D" for name, engine in ENGINES.items() for word in engine.methods for d in (2, 3)}
    uses = {use for kernel in kernels.listed_kernels() for use in kernel.uses}
    assert uses <= packers | methods | {"sweep 2D", "sweep 3D"}
    assert {"advancing-front 2D", "lubachevsky-stillinger 3D", "dtem cell 2D", "dtem facets 3D"} <= uses
