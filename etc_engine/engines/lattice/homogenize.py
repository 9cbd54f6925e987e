"""Effective conductivity of spheres in a matrix by a particle lattice."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.box import AXES, Box, ball_measure
from etc_engine.engines.lattice.calibration import pack_lattice
from etc_engine.engines.lattice.fitted import NARROW, fitted_seeds
from etc_engine.engines.lattice.network import (
    COORDINATION,
    TRANSMISSIONS,
    Lattice,
    contact_lattice,
    laguerre_lattice,
    link_conductances,
)
from etc_engine.engines.lattice.steady import conductivity_tensor
from etc_engine.errors import GeometryError, InputError, PackingError
from etc_engine.medium.backbone import joined_axes
from etc_engine.medium.conduction import Conduction, Result, attempt
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.links import LinkSolution
from etc_engine.medium.medium import Medium
from etc_engine.medium.phases import PORE, check_phases, find_owners, of_owners, without_cut_axes
from etc_engine.packing.particles import ParticlePacking

BOUNDARIES = ("periodic", "walls")
"""Boundary conditions of a cell."""

SUPERCONDUCTOR = 1e8
"""Conductivity that stands for an infinite one, over the largest finite one."""

COARSER = 4
"""The error is estimated with lattices of so many times fewer particles."""

SAFETY = 1.5
"""The estimated error over the largest difference to them: 1.25 covers 120 of 120 simple cubic arrays."""

DENSE = 0.635
"""Density of the packing of a contact lattice, ..."""

LOOSER = 0.28
"""... less this part of the volume of a layer one mean radius thick along the walls."""

NOTHING = 1e-9
"""An effective conductivity below this part of the largest is none."""

FEWEST = 50
"""Particles of a lattice."""


def homogenize_lattice(
    medium: Medium,
    *,
    rng: np.random.Generator,
    particles: int = 20_000,
    boundary: str | None = None,
    transmission: str = "laguerre",
    interface_resistance: float = 0.0,
    tolerance: float = 1e-8,
    estimate_error: bool = True,
) -> EffectiveConductivity[LinkSolution]:
    """Effective conductivity tensor of a medium by a lattice of particles.

    Parameters
    ----------
    medium : Medium
        Spheres and what fills the pores. Insulating spheres take no part; perfectly conducting ones have 1e8 times the
        largest finite conductivity, and are refused where they join across the cell.
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
        Whether two more lattices are solved for ``model_error``, about half of the time on top; NaN otherwise.

    Returns
    -------
    EffectiveConductivity
        ``model_error`` is 1.5 times the larger difference to two independent lattices of a quarter of the particles,
        relative to the conductivity. Seeds of the second stand at half the distance from an interface where another
        inclusion is near, which moves the conductivity as far as the lattice does not resolve the gap: there all
        lattices err alike. Where the inclusions are too small for a quarter, the others have the same size. It
        covers the lattice, not the choice of the cell. It is an estimate and no bound.

    Raises
    ------
    InputError, GeometryError, PackingError, ConvergenceError

    Notes
    -----
    A link that crosses an interface meets its resistance once, also where two inclusions touch.

    Examples
    --------
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [1 / 3], Box((1.0, 1.0, 1.0), (True, True, True)))
    >>> from etc_engine.medium.medium import Pores
    >>> medium = Medium(sphere, 5.0, pores=Pores(1.0))
    >>> made = homogenize_lattice(medium, rng=np.random.default_rng(3), particles=1000)
    >>> bool(abs(made.tensor[0, 0] / 1.29213 - 1.0) < 0.003)  # exact for the simple cubic array
    True
    """
    start = time.perf_counter()
    if boundary is None:
        boundary = "periodic" if all(medium.packing.box.periodic) else "walls"
    _refuse(medium, particles, boundary, transmission)
    if not isinstance(tolerance, (int, float, np.number)) or not 0.0 < tolerance < 1.0:
        raise InputError(f"the tolerance must lie between 0 and 1, found {tolerance!r}")
    if not isinstance(rng, np.random.Generator):
        raise InputError(f"rng is a numpy.random.Generator, found {type(rng).__name__}")

    def conduct(count: int, narrow: float = NARROW) -> _Conducted:
        choices = _Choices(boundary, transmission, interface_resistance, tolerance, narrow)
        return _conduct(medium, rng, count, choices)

    fine, error = conduct(particles), np.nan
    if estimate_error:
        error = _estimate(fine, conduct, particles, medium)
    return replace(
        fine.result,
        unknowns=fine.nodes,
        model_error=error,
        solid_fraction=fine.volume_fraction,
        seconds=time.perf_counter() - start,
    )


def _estimate(fine: _Conducted, conduct: Callable[[int, float], _Conducted], particles: int, medium: Medium) -> float:
    """Relative error of the conductivity of a lattice, from two coarser ones."""
    along = np.diag(fine.result.tensor)
    scale = float(np.abs(along).max())
    if scale <= NOTHING * float(node_conductivities(medium, np.arange(-1, medium.packing.count)).max()):
        return 0.0
    differences = []
    for narrow in (NARROW, 0.5 * NARROW):
        try:
            other = conduct(max(particles // COARSER, FEWEST), narrow)
        except GeometryError:
            other = conduct(particles, narrow)
        differences.append(float(np.abs(along - np.diag(other.result.tensor)).max()))
    return SAFETY * max(differences) / scale


@dataclass(frozen=True, eq=False)
class MediumLattice:
    """A lattice of a medium.

    Parameters
    ----------
    lattice : Lattice
    owner : ndarray of int64, shape (n,)
        Row number of the inclusion that a node belongs to, `etc_engine.medium.phases.PORE` for none.
    """

    lattice: Lattice
    owner: Ints

    @property
    def volume_fraction(self) -> float:
        """Volume fraction of the inclusions' nodes."""
        volumes = self.lattice.volumes
        return float(volumes[self.owner != PORE].sum() / volumes.sum())


def medium_lattice(
    medium: Medium,
    particles: int,
    rng: np.random.Generator,
    *,
    boundary: str = "periodic",
    transmission: str = "laguerre",
    narrow: float = NARROW,
) -> MediumLattice:
    """Lattice for a medium, as `homogenize_lattice` uses it; arguments are the same, and ``narrow`` of `fitted_seeds`.

    Returns
    -------
    MediumLattice
        With C_t = 1 where the transmission is ``contact``.

    Raises
    ------
    GeometryError
        If an inclusion holds no particle.
    """
    lengths = medium.packing.box.lengths
    box = Box(lengths, (boundary == "periodic",) * 3)
    if transmission == "laguerre":
        seeds = fitted_seeds(medium.packing, particles, rng, box, narrow=narrow)
        return MediumLattice(laguerre_lattice(seeds.packing), seeds.owner)
    packing = dense_packing(particles, box, rng)
    owner = find_owners(medium.packing, packing.centers)
    missing = np.setdiff1d(np.arange(medium.packing.count), owner)
    if missing.size:
        raise GeometryError(f"inclusion {missing[0]} holds no lattice particle: use more than {particles} particles")
    return MediumLattice(contact_lattice(packing, COORDINATION), owner)


def dense_packing(count: int, box: Box, rng: np.random.Generator) -> ParticlePacking:
    """A packing for a contact lattice, as dense as it soon gets: 0.635, and less between walls."""
    radius = (DENSE * box.volume / (float(ball_measure(1.0, 3)) * count)) ** (1.0 / 3.0)
    layers = sum(2.0 * radius / length for length, flag in zip(box.lengths, box.periodic, strict=True) if not flag)
    density = DENSE * max(1.0 - LOOSER * layers, 0.5)
    try:
        return pack_lattice(count, box.lengths, rng, periodic=box.periodic, density=density)
    except PackingError as refusal:
        if refusal.reached is None:
            raise
        return pack_lattice(count, box.lengths, rng, periodic=box.periodic, density=0.98 * refusal.reached)


def node_conductivities(medium: Medium, owner: Ints) -> Floats:
    """Conductivity at each node, a large number where it is infinite, shape (n,) [W/(m K)]."""
    k = of_owners(medium, np.arange(PORE, medium.packing.count))
    finite = np.isfinite(k)
    largest = float(k[finite].max(initial=0.0))
    return np.asarray(np.where(finite, k, SUPERCONDUCTOR * largest)[owner - PORE])


@dataclass(frozen=True, eq=False)
class _Conducted:
    """One lattice and its conductivity."""

    result: EffectiveConductivity[LinkSolution]
    volume_fraction: float
    nodes: int


@dataclass(frozen=True)
class _Choices:
    """How a lattice is made and solved."""

    boundary: str
    transmission: str
    interface_resistance: float
    tolerance: float
    narrow: float


def _conduct(medium: Medium, rng: np.random.Generator, particles: int, choices: _Choices) -> _Conducted:
    transmission, tolerance, interface_resistance = (
        choices.transmission,
        choices.tolerance,
        choices.interface_resistance,
    )
    made = medium_lattice(
        medium, particles, rng, boundary=choices.boundary, transmission=transmission, narrow=choices.narrow
    )
    _refuse_joined(medium, made, interface_resistance)
    k = node_conductivities(medium, made.owner)
    conductances = link_conductances(made.lattice, k, interface_resistance=interface_resistance, phase=made.owner)
    result = conductivity_tensor(made.lattice, conductances, tolerance=tolerance)
    if transmission == "contact":
        bare = conductivity_tensor(made.lattice, link_conductances(made.lattice), tolerance=tolerance)
        scale = np.sqrt(np.diag(bare.tensor))
        result = replace(result, tensor=result.tensor / np.outer(scale, scale))
    result = replace(result, tensor=without_cut_axes(result.tensor, medium, choices.boundary))
    return _Conducted(result, made.volume_fraction, made.lattice.count)


def _refuse_joined(medium: Medium, made: MediumLattice, interface_resistance: float) -> None:
    """Refuse perfect conductors whose particles are linked all the way across the cell."""
    perfect = np.append(np.isinf(medium.conductivity), False)[made.owner]
    if not perfect.any():
        return
    lattice = made.lattice
    i, j = lattice.pairs.T
    linked = perfect[i] & perfect[j] & (lattice.sections > 0.0)
    if interface_resistance > 0.0:
        linked &= made.owner[i] == made.owner[j]
    ends = perfect[lattice.wall_particles]
    joined = joined_axes(
        lattice.packing,
        lattice.pairs[linked],
        lattice.shifts[linked],
        lattice.wall_particles[ends],
        lattice.walls[ends],
    )
    if joined:
        raise GeometryError(
            f"perfect conductors (inf) join across the cell along {AXES[joined[0]]} in a lattice of {lattice.count} "
            "particles: the effective conductivity is infinite; give them a finite conductivity, or, where they are "
            "apart, more particles"
        )


def _refuse(medium: Medium, particles: int, boundary: str, transmission: str) -> None:
    if medium.dimension != 3:
        raise InputError(
            f"the particle lattice is three-dimensional, found particles in {medium.dimension} dimensions: "
            "use the engine voxel"
        )
    if not isinstance(particles, (int, np.integer)) or particles < FEWEST:
        raise InputError(f"a lattice needs a whole number of at least {FEWEST} particles, found {particles!r}")
    if boundary not in BOUNDARIES:
        raise InputError(f"unknown boundary {boundary!r}: expected one of {', '.join(BOUNDARIES)}")
    if transmission not in TRANSMISSIONS:
        raise InputError(f"unknown transmission {transmission!r}: expected one of {', '.join(TRANSMISSIONS)}")
    check_phases(medium)
    if medium.pores.conductivity == 0.0 and np.isinf(medium.conductivity).all():
        raise InputError("perfect conductors in an insulating matrix have no finite conductivity: change one of them")


def solve_series(media: Sequence[Medium], conduction: Conduction, seed: int) -> list[Result]:
    """Effective conductivity of media, one result per medium; all lattices start from the same seed."""

    def alone(medium: Medium) -> Result:
        return attempt(
            lambda: homogenize_lattice(
                medium,
                rng=np.random.default_rng(seed),
                transmission=conduction.method,
                tolerance=conduction.tolerance,
                **conduction.options,
            )
        )

    return [alone(medium) for medium in media]
