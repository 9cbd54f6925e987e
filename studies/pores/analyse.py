"""Disks in a conducting fluid: accuracy and cost of the methods: ``python analyse.py [figure.png]``

Three packings of forty disks whose conductivity is known from both sides (tests/data/pores): apart, touching,
overlapping. Prints the errors of the cell element, of voxels and of formulas, and draws them over the processor
time.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from etc_engine import Box, Medium, ParticlePacking, Pores, effective_conductivity, overlap_contacts
from etc_engine.models import CATALOGUE
from etc_engine.models.catalogue import evaluate
from etc_engine.output.figures.canvas import GREY, INK, TEXT, legend, new_panels, save
from etc_engine.structure.laguerre_2d import laguerre_cells

DATA = Path(__file__).parents[2] / "tests" / "data" / "pores"
CASES = {"ls60_equal": "apart, f = .60", "front_poly": "touching, f = .81", "front_over": "overlapping, f = .86"}
CONTRASTS = (10.0, 1000.0)
FORMULAS = ("maxwell", "effective_medium", "differential", "hashin_shtrikman_upper")


def load(case: str) -> tuple[ParticlePacking, np.ndarray]:
    """Packing of a case and the rows of the reference table."""
    table = np.genfromtxt(DATA / "reference.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    rows = table[table["case"] == case]
    disks = np.loadtxt(DATA / f"{case}.csv", delimiter=",", skiprows=1)
    box = Box((float(rows[0]["box_x"]), float(rows[0]["box_y"])), (True, True))
    return ParticlePacking(disks[:, :2], disks[:, 2], box), rows


def gap_network(packing: ParticlePacking, contrast: float) -> float:
    """Isothermal disks joined by the asymptotic conductance of every gap, C = k_f pi sqrt(R_eff/g).

    R_eff = 2 R_i R_j/(R_i + R_j), over Laguerre neighbours; a gap is at least R_eff/contrast^2, where the disks
    themselves limit the heat.
    """
    cells = laguerre_cells(packing.centers, packing.radii, packing.box)
    i, j = cells.cells.T
    effective = 2.0 * packing.radii[i] * packing.radii[j] / (packing.radii[i] + packing.radii[j])
    gaps = np.maximum(cells.gaps, effective / contrast**2)
    conductance = np.pi * np.sqrt(effective / gaps)
    branch = cells.distances.sum(axis=1)[:, None] * cells.normals
    n = packing.count
    rows, columns = np.concatenate((i, j, i, j)), np.concatenate((i, j, j, i))
    entries = np.concatenate((conductance, conductance, -conductance, -conductance))
    matrix = coo_matrix((entries, (rows, columns)), shape=(n, n)).tocsr()[1:, 1:]
    energies = []
    for axis in range(2):
        jump = conductance * branch[:, axis]
        load = np.bincount(i, jump, n) - np.bincount(j, jump, n)
        u = np.concatenate(([0.0], spsolve(matrix.tocsc(), load[1:])))
        energies.append(float((conductance * (branch[:, axis] + u[j] - u[i]) ** 2).sum()))
    return 0.5 * sum(energies) / packing.box.volume


def timed(medium: Medium, **options: object) -> tuple[float, float]:
    """Half the trace of the tensor and the processor time."""
    start = time.process_time()
    result = effective_conductivity(medium, **options)  # type: ignore[arg-type]
    return 0.5 * float(np.trace(result.tensor)), time.process_time() - start


def main(picture: str = "figure.png") -> None:
    figure, panels = new_panels(len(CONTRASTS), len(CASES), 3.0, sharex=True, sharey=True)
    axes = panels.reshape(len(CONTRASTS), len(CASES))
    for column, (case, label) in enumerate(CASES.items()):
        packing, rows = load(case)
        timed(Medium(packing, 10.0, overlap_contacts(packing), Pores(1.0)))  # compile
        timed(Medium(packing, 10.0, pores=Pores(1.0)), engine="voxel", resolution=64)
        for row, contrast in enumerate(CONTRASTS):
            reference = rows[rows["contrast_ks_over_kf"] == contrast][0]
            medium = Medium(packing, contrast, overlap_contacts(packing), Pores(1.0))
            panel = axes[row, column]

            def error(k: float, true: float = float(reference["k_mean"])) -> float:
                return 100.0 * (k / true - 1.0)

            cells = [timed(medium, method="cell", degree=degree) for degree in range(1, 6)]
            grids = (64, 128, 256, 512)
            voxels = [
                timed(Medium(packing, contrast, pores=Pores(1.0)), engine="voxel", resolution=n, tolerance=1e-6)
                for n in grids
            ]
            panel.loglog([t for _, t in cells], [abs(error(k)) for k, _ in cells], "o-", label="cell, degree 1 to 5")
            panel.loglog([t for _, t in voxels], [abs(error(k)) for k, _ in voxels], "s--", label="voxels, 64² to 512²")
            print(f"{case} contrast {contrast:g}: cell " + " ".join(f"{error(k):+.3f}" for k, _ in cells), end="")
            print(f" ({1e3 * cells[2][1]:.0f} ms at degree 3); voxels", end="")
            print(
                "".join(f" {n}: {error(k):+.2f} ({t:.1f} s)" for n, (k, t) in zip(grids, voxels, strict=True)), end=""
            )
            fraction = float(reference["solid_fraction"])
            found = {
                name: float(evaluate(name, k1=1.0, k2=contrast, fraction=fraction, dimension=2)) for name in FORMULAS
            }
            found["gap network"] = gap_network(packing, contrast)
            for style, (name, k) in zip(("-", "--", ":", "-.", (0, (1, 4))), found.items(), strict=True):
                text = CATALOGUE[name].label if name in CATALOGUE else name
                bound = name.startswith("hashin_shtrikman")
                panel.axhline(abs(error(k)), color=INK if bound else GREY, linewidth=0.9, linestyle=style, label=text)
                print(f"; {text} {error(k):+.0f}", end="")
            print(" [%]", flush=True)
            panel.set_title(f"{label}\ncontrast {contrast:g}", fontsize=TEXT)
    legend(figure, *axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
    figure.supxlabel("processor time [s]", fontsize=TEXT)
    figure.supylabel("error of the conductivity [%]", fontsize=TEXT)
    save(figure, picture)


if __name__ == "__main__":
    main(*sys.argv[1:])
