"""``etc-engine warm``, and the list of kernels that it compiles."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from etc_engine import kernels
from etc_engine.errors import OutputError

ROOT = Path(kernels.__file__).parent
RECORD = Path(__file__).parents[1] / "kernels"
RARE = {
    "etc_engine.engines.dtem.element:_largest_ratio",  # beside unequal conductivities
    "etc_engine.engines.lattice.flux:_sum_halos",  # a study's own call
    "etc_engine.laws.disk:_mutual_resistances",  # public functions of closed forms
    "etc_engine.laws.sphere:_mutual",
    "etc_engine.medium.cut_contacts:_mark",  # particles that other contacts cut
    "etc_engine.structure.clipping:rank",  # only within other kernels, with literal arguments
}
"""Kernels that no common command needs: they are compiled when they are called."""
LISTED = kernels.listed_kernels()
WARM = """import sys; from pathlib import Path; from etc_engine import kernels; from etc_engine.cli import run
kernels.LIST = Path(sys.argv[1])
sys.exit(run(["warm", *sys.argv[2:]]))"""


def warm(folder: Path, kernel_list: Path, *words: str) -> subprocess.CompletedProcess[str]:
    line = [sys.executable, "-c", WARM, str(kernel_list), *words]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    return subprocess.run(line, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize("kernel", LISTED, ids=[kernel.name for kernel in LISTED])
def test_a_listed_kernel_exists_and_its_types_are_read_as_they_were_written(kernel):
    assert kernels.find(kernel.name).py_func.__name__ == kernel.name.partition(":")[2]
    assert [kernels.describe(kernels.numba_type(words)) for words in kernel.arguments] == kernel.arguments


def test_no_kernel_is_forgotten():
    """After a new kernel: ``python tests/kernels/record.py``."""
    written = set()
    for path in ROOT.rglob("*.py"):
        module = ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.FunctionDef) and any("njit" in ast.unparse(one) for one in node.decorator_list):
                written.add(f"{module}:{node.name}")
    assert written - {kernel.name for kernel in LISTED} == RARE


def test_kernels_are_compiled_once(tmp_path):
    few = tmp_path / "few.jsonl"
    few.write_text("".join(f"{json.dumps(kernel)}\n" for kernel in LISTED[1:3]))
    first, second = warm(tmp_path, few, "--jobs", "2"), warm(tmp_path, few, "--json")
    assert first.stdout.startswith("2 kernels ready, 2 compiled now, "), first.stderr
    assert json.loads(second.stdout) | {"seconds": 0.0} == {"kernels": 2, "compiled": 0, "seconds": 0.0}


def test_a_process_that_is_killed_is_one_line(tmp_path, monkeypatch):
    few = tmp_path / "few.jsonl"
    (tmp_path / "deadly.py").write_text("import os\nos._exit(1)\n")
    few.write_text('["deadly:kernel", [], []]\n')
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    done = warm(tmp_path, few)
    assert done.returncode == 2
    assert done.stderr.startswith("etc-engine: kernels cannot be compiled and kept: ")
    assert len(done.stderr.splitlines()) == 1


def refuse_to_compile(kernel):
    raise RuntimeError(f"cannot cache function '{kernel.name}': no locator available for file 'kernels.py'")


def test_no_folder_for_kernels_is_said_with_what_to_do(monkeypatch):
    monkeypatch.setattr(kernels, "compile_kernel", refuse_to_compile)
    monkeypatch.setattr(kernels, "listed_kernels", lambda: LISTED[:2])
    with pytest.raises(OutputError, match="set NUMBA_CACHE_DIR to a folder"):
        list(kernels.compile_all(1))


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_after_warm_no_command_compiles(tmp_path):
    """From an empty cache: the commands that the list was recorded from."""
    sys.path.insert(0, str(RECORD))
    try:
        import record
    finally:
        sys.path.remove(str(RECORD))
    done = warm(tmp_path, kernels.LIST)
    assert f"{len(LISTED)} compiled now" in done.stdout, done.stderr
    record.prepare(tmp_path)
    for words in record.JOBS:
        assert record.run(words, tmp_path, tmp_path / "cache").compiled == [], words
