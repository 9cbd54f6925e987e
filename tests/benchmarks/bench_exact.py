"""Method exact next to finite elements on the same assembly: unknowns, time, error; and its scaling.

Run by hand: ``OMP_NUM_THREADS=1 python tests/benchmarks/bench_exact.py [--disks 1e4] [--output DIRECTORY]``, with gmsh
and scikit-fem installed (without them the scaling alone); writes cost.csv and cost.png. Finite elements: quadratic
triangles on the union of the 12 disks of Feng et al. 2008, inside the box, on a plain mesh and on one graded into the
corners of the necks. Time is that of mesh, assembly and solution (SciPy's SuperLU).
"""

from __future__ import annotations

import argparse
import csv
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from etc_engine import Box, ParticlePacking, effective_conductivity, overlap_contacts, read_csv
from etc_engine.medium.medium import medium_of

PARTICLES = Path(__file__).parents[2] / "studies" / "feng2008" / "particles.csv"
MODES = range(1, 7)


def finite_elements(packing: ParticlePacking, size: float, ratio: float, growth: float) -> tuple[int, float]:
    """Unknowns and conductivity (Dirichlet energy) by P2 triangles of edge min(size, size ratio + growth distance)."""
    import gmsh
    import skfem
    from skfem.models.poisson import laplace

    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    disks = [(2, occ.addDisk(*c, 0.0, r, r)) for c, r in zip(packing.centers, packing.radii, strict=True)]
    union, _ = occ.fuse(disks[:1], disks[1:])
    box = [(2, occ.addRectangle(0.0, 0.0, 0.0, 1.0, 1.0))]
    occ.intersect(union, box)
    occ.synchronize()
    corners = [tag for _, tag in gmsh.model.getEntities(0)]
    mesh = gmsh.model.mesh
    field = mesh.field.add("Distance")
    mesh.field.setNumbers(field, "PointsList", corners)
    grading = mesh.field.add("MathEval")
    mesh.field.setString(grading, "F", f"Min({size}, {size * ratio} + {growth} * F{field})")
    mesh.field.setAsBackgroundMesh(grading)
    for option in ("MeshSizeFromPoints", "MeshSizeFromCurvature", "MeshSizeExtendFromBoundary"):
        gmsh.option.setNumber(f"Mesh.{option}", 0)
    mesh.generate(2)
    mesh.setOrder(2)
    nodes, coordinates, _ = mesh.getNodes()
    _, _, connectivity = mesh.getElements(2)
    place = np.zeros(int(nodes.max()) + 1, dtype=int)
    place[nodes.astype(int)] = np.arange(nodes.size)
    triangles = place[connectivity[0].astype(int)].reshape(-1, 6).T
    used, triangles = np.unique(triangles, return_inverse=True)
    points = coordinates.reshape(-1, 3)[used, :2].T
    gmsh.finalize()
    grid = skfem.MeshTri2(points, triangles.reshape(6, -1))
    basis = skfem.Basis(grid, skfem.ElementTriP2(), intorder=6)
    hot = basis.get_dofs(lambda x: x[0] < 1e-9)
    cold = basis.get_dofs(lambda x: x[0] > 1.0 - 1e-9)
    stiffness = laplace.assemble(basis)
    u = basis.zeros()
    u[hot.flatten()] = 1.0
    fixed = np.concatenate([hot.flatten(), cold.flatten()])
    u = skfem.solve(*skfem.condense(stiffness, x=u, D=fixed))
    return basis.N - fixed.size, float(u @ (stiffness @ u))


def meshes() -> Iterator[tuple[str, float, float, float]]:
    for size in (0.02, 0.01, 0.005, 0.0025):
        yield "plain P2", size, 1.0, 1.0
    for size, ratio, growth in ((0.04, 1e-3, 0.6), (0.03, 1e-4, 0.4), (0.03, 1e-5, 0.28), (0.02, 1e-6, 0.2)):
        yield "graded P2", size, ratio, growth


def compare(output: Path | None) -> None:
    packing = read_csv(PARTICLES, Box((1.0, 1.0))).packing
    network = overlap_contacts(packing)
    truth = effective_conductivity(medium_of(network), method="exact", modes=9, axes=(0,)).tensor[0, 0]
    print(f"12 particles; truth {truth:.9f}, method exact with 9 modes")
    print(f"{'':22s}{'unknowns':>10s}{'seconds':>10s}{'error':>11s}")
    rows: list[tuple[str, int, float, float]] = []
    for modes in MODES:
        seconds = np.inf
        for _ in range(5):
            start = time.perf_counter()
            result = effective_conductivity(medium_of(network), method="exact", modes=modes, axes=(0,))
            seconds = min(seconds, time.perf_counter() - start)
        error = result.tensor[0, 0] / truth - 1.0
        rows.append(("exact", result.unknowns, seconds, error))
        print(f"{f'exact, {modes} modes':22s}{result.unknowns:10d}{seconds:10.4f}{error:11.1e}")
    try:
        import gmsh  # noqa: F401
        import skfem  # noqa: F401
    except ImportError as error:
        print(f"no finite elements here: {error}")
        return
    for name, size, ratio, growth in meshes():
        start = time.perf_counter()
        unknowns, value = finite_elements(packing, size, ratio, growth)
        seconds = time.perf_counter() - start
        rows.append((name, unknowns, seconds, value / truth - 1.0))
        print(
            f"{f'{name} {size:g}/{size * ratio:g}':22s}{unknowns:10d}{seconds:10.4f}{value / truth - 1.0:11.1e}",
            flush=True,
        )
    if output is not None:
        record(rows, output)


def record(rows: list[tuple[str, int, float, float]], output: Path) -> None:
    """Table and picture of the errors over unknowns and time."""
    with (output / "cost.csv").open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", "unknowns", "seconds", "relative_error"])
        writer.writerows((name, unknowns, f"{seconds:.4g}", f"{error:.3g}") for name, unknowns, seconds, error in rows)
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    for axes, column, label in zip(figure.subplots(1, 2, sharey=True), (1, 2), ("unknowns", "seconds"), strict=True):
        for name, marker in (("exact", "o"), ("graded P2", "s"), ("plain P2", "^")):
            mine = [row for row in rows if row[0] == name]
            axes.loglog([row[column] for row in mine], [abs(row[3]) for row in mine], marker=marker, label=name)
        axes.set(xlabel=label)
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("relative error of the conductivity, 12 particles")
    figure.axes[0].legend()
    figure.savefig(output / "cost.png", dpi=140)


def scale(largest: int) -> None:
    rng = np.random.default_rng(915)
    print(f"\n{'disks':>8s}{'modes':>7s}{'unknowns':>10s}{'seconds':>10s}{'ms/disk':>9s}{'conductivity':>14s}")
    for side in (10, 32, 100, 316):
        if side * side > largest:
            break
        grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1).reshape(-1, 2) + 0.5
        centers = (grid + 0.08 * rng.uniform(-1, 1, grid.shape)) / side
        packing = ParticlePacking(centers, rng.uniform(0.53, 0.58, side**2) / side, Box((1.0, 1.0)))
        network = overlap_contacts(packing)
        for modes in (1, 3):
            start = time.perf_counter()
            result = effective_conductivity(medium_of(network), method="exact", modes=modes, axes=(0,))
            seconds = time.perf_counter() - start
            print(
                f"{side**2:8d}{modes:7d}{result.unknowns:10d}{seconds:10.2f}{1e3 * seconds / side**2:9.2f}"
                f"{result.tensor[0, 0]:14.8f}",
                flush=True,
            )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--disks", type=float, default=1e4, help="largest number of disks of the scaling")
    parser.add_argument("--output", type=Path, help="where to write cost.csv and cost.png")
    options = parser.parse_args()
    compare(options.output)
    scale(int(options.disks))


if __name__ == "__main__":
    main()
