"""Every command that README and guide show runs, on small files that stand in for the reader's own."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest

from etc_engine.box import Box
from etc_engine.medium.rules import overlap_contacts
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.formats import write_particles
from etc_engine.particle_files.table import ParticleTable
from etc_engine.sweep.result_file import write_dataset

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "studies" / "site").glob("*.md"))]
LONG = (
    "--count 10000",
    "--count 2000",
    "homogenize inclusions.csv --box 1,1,1",
    "density_angle/study",
    "pebble_bed/study",
    "etc-engine warm",
)
"""Parts of commands that take minutes, or of the main job, which .ci/run runs."""
ORIGIN = (-0.01, 0.0)


def grid(lengths: tuple[float, ...], radius: float) -> ParticlePacking:
    """Particles on a grid, each overlapping its neighbours and the walls by 2 %."""
    counts = [max(1, round(length / (1.96 * radius))) for length in lengths]
    axes = [(np.arange(n) + 0.5) * length / n for n, length in zip(counts, lengths, strict=True)]
    centers = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(lengths))
    return ParticlePacking(centers, np.full(len(centers), radius), Box(lengths))


def contact_dump(packing: ParticlePacking) -> str:
    """Contacts of the grid with a force, in the columns of ``pair/gran/local pos id force contactArea heatFlux``."""
    rows = []
    for i, j in overlap_contacts(packing).pairs:
        places = [*(packing.centers[i] + ORIGIN), 0.0, *(packing.centers[j] + ORIGIN), 0.0]
        rows.append(" ".join(map(repr, map(float, [*places, i + 1, j + 1, 0, 1e3, 0, 0, 0, 0]))))
    head = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ENTRIES\n{len(rows)}\nITEM: BOX BOUNDS ff ff ff\n-1 1\n-1 1\n-1 1"
    return "\n".join([head, "ITEM: ENTRIES " + " ".join(f"c_c[{k + 1}]" for k in range(14)), *rows, ""])


@pytest.fixture
def desk(tmp_path, monkeypatch, made_sweep):
    """A folder with a file for every name on the pages."""
    tifffile = pytest.importorskip("tifffile")
    (tmp_path / "studies").symlink_to(ROOT / "studies")
    write_particles(tmp_path / "disks.csv", ParticleTable(grid((1.0, 1.0), 0.1)))
    spheres = grid((1.0, 1.0, 1.0), 0.16)
    write_particles(tmp_path / "spheres.csv", ParticleTable(spheres))
    write_particles(tmp_path / "spheres.dump", ParticleTable(grid((3e-3, 3e-3, 3e-3), 5e-4)))
    study = re.search(r"^```toml\n(.*?)^```", (ROOT / "studies" / "site" / "sweeps.md").read_text(), re.M | re.S)[1]
    for name in ("out.nc", "sweep.nc"):
        write_dataset(made_sweep(study, lambda density, *_: 0.3 * density), tmp_path / name)
    tifffile.imwrite(tmp_path / "scan.tif", np.arange(12**3, dtype=np.uint8).reshape(12, 12, 12) % 3)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def stand_in(folder: Path, page: str) -> None:
    """A bed of spheres; for the page on files of disks of two types, for that on gases a sweep over temperature too."""
    if page == "gas_load_temperature":
        shutil.copy(ROOT / "studies" / "pebble_bed" / "sweep.nc", folder / "out.nc")
    if page != "particles":
        write_particles(folder / "bed.dump", ParticleTable(grid((3e-3, 3e-3, 4e-3), 5e-4)))
        return
    packing = grid((0.02, 0.03), 0.001)
    (folder / "contacts.dump").write_text(contact_dump(packing))
    head = f"ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n{packing.count}\n"
    head += "ITEM: BOX BOUNDS ff ff pp\n-0.01 0.01\n0 0.03\n-1 1"
    rows = [f"{i + 1} {1 + i % 2} {x!r} {y!r} 0 0.001" for i, (x, y) in enumerate((packing.centers + ORIGIN).tolist())]
    (folder / "bed.dump").write_text("\n".join([head, "ITEM: ATOMS id type x y z radius", *rows, ""]))


def commands(page: Path) -> list[str]:
    found = []
    for text in re.findall(r"^```sh\n(.*?)^```", page.read_text(), re.M | re.S):
        for line in text.replace("\\\n", " ").splitlines():
            call = re.match(r"(?:mpirun -n \d+ )?etc-engine ([a-z][^#]*)", line)
            if call and not any(part in line for part in LONG):
                found.append(" ".join(call[1].rstrip(" &").split()))
    return found


EVERY = {command: page for page in reversed(PAGES) for command in commands(page)}
"""The first page that shows a command runs it."""


@pytest.mark.parametrize("page", sorted(set(EVERY.values())), ids=lambda page: page.stem)
def test_commands_run(page, desk, etc_engine):
    stand_in(desk, page.stem)
    for study in re.findall(r"^```toml\n(.*?)^```", page.read_text(), re.M | re.S):
        (desk / "study.toml").write_text(study)
        (desk / "out.nc").unlink()
    for command in commands(page):
        if EVERY[command] == page:
            done = etc_engine(*shlex.split(command))
            assert done.returncode == 0, f"{command}\n{done.stderr}"
