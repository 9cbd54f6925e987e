"""Data flows one way: what each room may import."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "etc_engine"
LEAVES = {"arrays", "errors", "box", "ranks", "durable", "solvers", "laws", "models", "materials", "kernels"}
ORDER = (
    ("packing",),
    ("particle_files", "structure"),
    ("medium",),
    ("engines",),  # no engine imports another
    ("realization",),
    ("study",),
    ("sweep",),
    ("transient",),
    ("comparison",),
    ("output",),
    ("service",),
    ("cli",),
)
RANK = {room: rank for rank, rooms in enumerate(ORDER) for room in rooms}
# the one outside library that only one place may import, at any level
KEEPERS = {
    "mpi4py": {"sweep/scheduler.py"},  # engines that work on many ranks take them as an argument, see etc_engine.ranks
    "petsc4py": {"solvers/petsc.py"},
    "matplotlib": {"output/figures"},
    "pyamg": {"solvers"},
    "click": {"cli"},
    "CoolProp": {"materials/gases.py"},
    "fastapi": {"service"},
    "starlette": {"service"},
    "uvicorn": {"service/server.py", "service/connections.py"},
}


@cache
def modules() -> dict[str, ast.Module]:
    return {str(p.relative_to(ROOT)): ast.parse(p.read_text()) for p in sorted(ROOT.rglob("*.py"))}


def imported(tree: ast.Module) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def room_of(path: str) -> str:
    return Path(path).parts[0].removesuffix(".py")


def place_of(name: str) -> tuple[str, ...]:
    """Room of a module, and for an engine which one; an import of the package itself names the first thing taken."""
    parts = name.split(".")[1:]
    return tuple(parts[:2] if parts[:1] == ["engines"] else parts[:1])


@pytest.mark.parametrize("path", [p for p in modules() if room_of(p) not in ("__init__", "__main__")])
def test_each_room_imports_only_from_its_left_and_from_leaves(path):
    own = room_of(path)
    mine = place_of("etc_engine." + path.removesuffix(".py").replace("/", "."))
    assert own in LEAVES or own in RANK, f"{own} has no place in the house"
    for name in imported(modules()[path]):
        if name == "etc_engine":
            assert own == "cli", f"{path} imports the whole package: name the module"
        if not name.startswith("etc_engine."):
            continue
        other = place_of(name)
        if other[0] == "engines" and own == "engines":
            assert len(other) == 1 or other == mine, f"{path} imports another engine: {name}"
        elif other[0] in LEAVES and (own not in LEAVES or other[0] in ("arrays", "errors", "box", "ranks")):
            continue
        elif other[0] != own:
            assert own not in LEAVES, f"leaf {path} imports {name}"
            assert RANK[other[0]] < RANK[own], f"{path} imports {name}, which is not to its left"


@pytest.mark.parametrize("library", KEEPERS)
def test_each_library_has_its_keeper(library):
    for path, tree in modules().items():
        if any(name.split(".")[0] == library for name in imported(tree)):
            assert any(path.startswith(keeper) for keeper in KEEPERS[library]), f"{path} imports {library}"


def test_only_the_command_line_prints():
    for path, tree in modules().items():
        calls = [n.func.id for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)]
        assert "print" not in calls, path


def test_modules_stay_readable():
    long = {path: len((ROOT / path).read_text().splitlines()) for path in modules()}
    assert {path: lines for path, lines in long.items() if lines > 450} == {}


def test_nothing_refers_to_a_place_outside_the_project():
    pattern = re.compile(r"\.\./shared|/(?:work|root|tmp)/\w")
    for path in ROOT.rglob("*.py"):
        assert not pattern.search(path.read_text()), path


def test_help_loads_neither_numpy_nor_numba():
    code = "import sys\nfrom etc_engine.cli import run\nrun(['--help'])\nprint({'numpy','numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.rstrip().endswith("set()")
