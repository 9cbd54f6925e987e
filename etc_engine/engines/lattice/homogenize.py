"""Effective conductivity of spheres in a matrix by a particle lattice."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from etc_engine.box import AXES, Box
from etc_engine.engines.lattice.calibration import pack_lattice
from etc_engine.engines.lattice.fitted import fitted_seeds
from etc_engine.engines.lattice.network import (
    COORDINATION,
    TRANSMISSIONS,
    Lattice,
    contact_lattice,
    laguerre_lattice,
    link_conductances,
)
from etc_engine.engines.lattice.steady import LatticeConductivity, conductivity_tensor
from etc_engine.errors import GeometryError, InputError, PackingError
from etc_engine.medium.backbone import joined_axes
from etc_engine.medium.composite import MATRIX, Composite, Homogenized
from etc_engine.packing.particles import ParticlePacking

BOUNDARIES = ("periodic", "walls")
"""Boundary conditions of a cell."""

SUPERCONDUCTOR = 1e8
"""Conductivity that stands for an infinite one, over the largest finite one."""

COARSER = 4
"""The error is estimated with a lattice of so many times fewer particles."""

DENSE = 0.635
"""Density of the packing of a contact lattice, ..."""

LOOSER = 0.28
"""... less this part of the volume of a layer one mean radius thick along the walls."""

NOTHING = 1e-9
"""An effective conductivity below this part of the largest is none."""

FEWEST = 50
"""Particles of a lattice."""


def homogenize_lattice(
    composite: Composite,
    *,
    rng: np.random.Generator,
    particles: int = 20_000,
    boundary: str | None = None,
    transmission: str = "laguerre",
    interface_resistance: float = 0.0,
    tolerance: float = 1e-8,
    estimate_error: bool = True,
) -> Homogenized:
    """Effective conductivity tensor of a composite by a lattice of particles.

    Parameters
    ----------
    composite : Composite
        Spheres in a matrix. Insulating spheres take no part; perfectly conducting ones have 1e8 times the largest
        finite conductivity, and are refused where they join across the cell.
    rng : numpy.random.Generator
        Source of the lattice.
    particles : int
        About so many lattice particles.
    boundary : str, optional
        ``periodic``: the box repeats; inclusions cut off by walls of their own box are cut there. ``walls``: two faces
        at temperatures and the others adiabatic, axis by axis. By default as the box is: walls, if it has any.
    transmission : str
        ``laguerre``: seeds fitted to the spheres, exact volume; ``contact``: a contact network of coordination number
        7.5 whose C_t is calibrated on the packing itself along each axis, each particle in the phase of its centre.
    interface_resistance : float [m2 K/W]
        Kapitza resistance of the interfaces.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    estimate_error : bool
        Whether a second lattice is solved for ``relative_error_estimate``, about a quarter of the time; NaN otherwise.

    Returns
    -------
    Homogenized
        ``relative_error_estimate`` is the difference to an independent lattice of a quarter of the particles, relative
        to the conductivity: the error of the finer one where it falls with the power 1.5 of the particles' distance
        (``laguerre`` falls with the power 2 on separate spheres). Where the inclusions are too small for a quarter,
        it is the difference of two lattices of the same size. It covers the lattice, not the choice of the cell.

    Raises
    ------
    InputError, GeometryError, PackingError, ConvergenceError

    Notes
    -----
    A link that crosses an interface meets its resistance once, also where two inclusions touch.

    Examples
    --------
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [1 / 3], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> made = homogenize_lattice(Composite(sphere, 1.0, 5.0), rng=np.random.default_rng(3), particles=1000)
    >>> bool(abs(made.tensor[0, 0] / 1.29213 - 1.0) < 0.003)  # exact for the simple cubic array
    True
    """
    start = time.perf_counter()
    if boundary is None:
        boundary = "periodic" if all(composite.inclusions.box.periodic) else "walls"
    _refuse(composite, particles, boundary, transmission)
    if not isinstance(tolerance, (int, float, np.number)) or not 0.0 < tolerance < 1.0:
        raise InputError(f"the tolerance must lie between 0 and 1, found {tolerance!r}")
    if not isinstance(rng, np.random.Generator):
        raise InputError(f"rng is a numpy.random.Generator, found {type(rng).__name__}")

    def conduct(count: int) -> _Conducted:
        return _conduct(composite, rng, count, boundary, transmission, interface_resistance, tolerance)

    fine, error = conduct(particles), np.nan
    if estimate_error:
        try:
            other = conduct(max(particles // COARSER, FEWEST))
        except GeometryError:
            other = conduct(particles)
        scale = float(np.abs(np.diag(fine.result.tensor)).max())
        difference = float(np.abs(np.diag(fine.result.tensor - other.result.tensor)).max())
        conducts = scale > NOTHING * float(
            node_conductivities(composite, np.arange(-1, composite.inclusions.count)).max()
        )
        error = difference / scale if conducts else 0.0
    return Homogenized(
        tensor=fine.result.tensor,
        volume_fraction=fine.volume_fraction,
        unknowns=fine.nodes,
        iterations=fine.result.iterations,
        relative_error_estimate=error,
        seconds=time.perf_counter() - start,
    )


@dataclass(frozen=True, eq=False)
class CompositeLattice:
    """A lattice of a composite.

    Parameters
    ----------
    lattice : Lattice
    owner : ndarray of int64, shape (n,)
        Row number of the inclusion that a node belongs to, `etc_engine.medium.composite.MATRIX` for none.
    """

    lattice: Lattice
    owner: NDArray[np.int64]

    @property
    def volume_fraction(self) -> float:
        """Volume fraction of the inclusions' nodes."""
        volumes = self.lattice.volumes
        return float(volumes[self.owner != MATRIX].sum() / volumes.sum())


def composite_lattice(
    composite: Composite,
    particles: int,
    rng: np.random.Generator,
    *,
    boundary: str = "periodic",
    transmission: str = "laguerre",
) -> CompositeLattice:
    """Lattice for a composite, as `homogenize_lattice` uses it; arguments are the same.

    Returns
    -------
    CompositeLattice
        With C_t = 1 where the transmission is ``contact``.

    Raises
    ------
    GeometryError
        If an inclusion holds no particle.
    """
    lengths = composite.inclusions.box.lengths
    box = Box(lengths, (boundary == "periodic",) * 3)
    if transmission == "laguerre":
        seeds = fitted_seeds(composite, particles, rng, box)
        return CompositeLattice(laguerre_lattice(seeds.packing), seeds.owner)
    packing = dense_packing(particles, box, rng)
    owner = composite.phase(packing.centers)
    missing = np.setdiff1d(np.arange(composite.inclusions.count), owner)
    if missing.size:
        raise GeometryError(f"inclusion {missing[0]} holds no lattice particle: use more than {particles} particles")
    return CompositeLattice(contact_lattice(packing, COORDINATION), owner)


def dense_packing(count: int, box: Box, rng: np.random.Generator) -> ParticlePacking:
    """A packing for a contact lattice, as dense as it soon gets: 0.635, and less between walls."""
    radius = (DENSE * box.volume / (4.0 / 3.0 * np.pi * count)) ** (1.0 / 3.0)
    layers = sum(2.0 * radius / length for length, flag in zip(box.lengths, box.periodic, strict=True) if not flag)
    density = DENSE * max(1.0 - LOOSER * layers, 0.5)
    try:
        return pack_lattice(count, box.lengths, rng, periodic=box.periodic, density=density)
    except PackingError as refusal:
        if refusal.reached is None:
            raise
        return pack_lattice(count, box.lengths, rng, periodic=box.periodic, density=0.98 * refusal.reached)


def node_conductivities(composite: Composite, owner: NDArray[np.int64]) -> NDArray[np.float64]:
    """Conductivity at each node, a large number where it is infinite, shape (n,) [W/(m K)]."""
    k = np.append(composite.inclusion, composite.matrix)
    finite = np.isfinite(k)
    largest = float(k[finite].max(initial=0.0))
    return np.asarray(np.where(finite, k, SUPERCONDUCTOR * largest)[owner])


@dataclass(frozen=True, eq=False)
class _Conducted:
    """One lattice and its conductivity."""

    result: LatticeConductivity
    volume_fraction: float
    nodes: int


def _conduct(
    composite: Composite,
    rng: np.random.Generator,
    particles: int,
    boundary: str,
    transmission: str,
    interface_resistance: float,
    tolerance: float,
) -> _Conducted:
    made = composite_lattice(composite, particles, rng, boundary=boundary, transmission=transmission)
    _refuse_joined(composite, made, interface_resistance)
    k = node_conductivities(composite, made.owner)
    conductances = link_conductances(made.lattice, k, interface_resistance=interface_resistance, phase=made.owner)
    result = conductivity_tensor(made.lattice, conductances, tolerance=tolerance)
    if transmission == "contact":
        bare = conductivity_tensor(made.lattice, link_conductances(made.lattice), tolerance=tolerance)
        scale = np.sqrt(np.diag(bare.tensor))
        result = LatticeConductivity(result.tensor / np.outer(scale, scale), result.fields)
    return _Conducted(result, made.volume_fraction, made.lattice.count)


def _refuse_joined(composite: Composite, made: CompositeLattice, interface_resistance: float) -> None:
    """Refuse perfect conductors whose particles are linked all the way across the cell."""
    perfect = np.append(np.isinf(composite.inclusion), False)[made.owner]
    if not perfect.any():
        return
    lattice = made.lattice
    i, j = lattice.pairs.T
    linked = perfect[i] & perfect[j] & (lattice.sections > 0.0)
    if interface_resistance > 0.0:
        linked &= made.owner[i] == made.owner[j]
    ends = perfect[lattice.wall_nodes]
    joined = joined_axes(
        lattice.count,
        lattice.pairs[linked],
        lattice.shifts[linked],
        lattice.wall_nodes[ends],
        lattice.walls[ends],
        lattice.packing.box,
    )
    if joined:
        raise GeometryError(
            f"perfect conductors (inf) join across the cell along {AXES[joined[0]]} in a lattice of {lattice.count} "
            "particles: the effective conductivity is infinite; give them a finite conductivity, or, where they are "
            "apart, more particles"
        )


def _refuse(composite: Composite, particles: int, boundary: str, transmission: str) -> None:
    if composite.dimension != 3:
        raise InputError(
            f"the particle lattice is three-dimensional, found inclusions in {composite.dimension} dimensions: "
            "use the engine voxel"
        )
    if not isinstance(particles, (int, np.integer)) or particles < FEWEST:
        raise InputError(f"a lattice needs a whole number of at least {FEWEST} particles, found {particles!r}")
    if boundary not in BOUNDARIES:
        raise InputError(f"unknown boundary {boundary!r}: expected one of {', '.join(BOUNDARIES)}")
    if transmission not in TRANSMISSIONS:
        raise InputError(f"unknown transmission {transmission!r}: expected one of {', '.join(TRANSMISSIONS)}")
    if composite.matrix == 0.0 and np.isinf(composite.inclusion).all():
        raise InputError("perfect conductors in an insulating matrix have no finite conductivity: change one of them")
