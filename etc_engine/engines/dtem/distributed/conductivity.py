"""Effective conductivity of one packing that many ranks hold together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.box import Box
from etc_engine.engines.dtem.distributed.blocks import Part, make_part
from etc_engine.engines.dtem.distributed.nodes import Nodes, make_nodes
from etc_engine.engines.dtem.distributed.steady import PartialSolution, solve_part
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import EffectiveConductivity, effective_tensor
from etc_engine.medium.medium import check_conductivities
from etc_engine.medium.network import ContactNetwork
from etc_engine.packing.particles import ParticlePacking
from etc_engine.particle_files.digits import PrintedColumns
from etc_engine.particle_files.precision import Doubt, doubtful_contacts
from etc_engine.particle_files.table import ParticleTable
from etc_engine.ranks import Ranks, together
from etc_engine.structure.filling import Filling, find_filling, join_fillings


@dataclass(frozen=True, eq=False)
class Scattered:
    """Particles of a packing, each on one rank, in any order.

    Parameters
    ----------
    box : Box
    centers : ndarray, shape (n, d) [m]
        Of this rank.
    radii : ndarray, shape (n,) [m]
    conductivity : ndarray, shape (n,) [W/(m K)]
    origin : tuple of float [m]
        Low corner of the box in the coordinates of the file.
    printed : PrintedColumns, optional
        How finely the numbers are printed in a text file, the same on every rank.
    """

    box: Box
    centers: Floats
    radii: Floats
    conductivity: Floats
    origin: tuple[float, ...] = ()
    printed: PrintedColumns | None = None


@dataclass(frozen=True, eq=False)
class Census:
    """What a packing on many ranks is, as a whole.

    Parameters
    ----------
    particles, contacts : int
    wall_contacts : ndarray of int, shape (d,)
        With the two walls normal to each axis.
    density : float
        Sum of the full particle areas (volumes) over the box's.
    filling : Filling
        Where its particles are in the box.
    most_conductive : float [W/(m K)]
        Largest conductivity of a particle.
    doubt : Doubt or None
        Contacts that the printed digits do not decide.
    """

    particles: int
    contacts: int
    wall_contacts: Ints
    density: float
    filling: Filling
    most_conductive: float
    doubt: Doubt | None


def distributed_conductivity(
    particles: Scattered,
    contacts: Callable[[ParticlePacking], ContactNetwork],
    conduction: Conduction,
    ranks: Ranks,
    *,
    gap: float = 0.0,
) -> tuple[EffectiveConductivity[PartialSolution], Census]:
    """Effective conductivity of one packing by all ranks together; the energies are those of `element_conductivity`.

    Parameters
    ----------
    particles : Scattered
        What this rank holds of them.
    contacts : callable
        Packing -> network, by a rule in which a contact depends on its two particles alone.
    conduction : Conduction
        Of method ``chord``.
    ranks : Ranks
        Every rank makes this call.
    gap : float
        Largest gap of a contact, in mean radii of the pair.

    Returns
    -------
    result : EffectiveConductivity
        The same on every rank, but for its solutions.
    census : Census
        The same on every rank.

    Raises
    ------
    InputError, GeometryError, ConvergenceError
        On every rank, whichever met it.

    Notes
    -----
    A rank holds its particles and a layer of copies about them, as deep as a contact reaches; their contacts, elements
    and rows of the matrix; and what the solver makes of these. Nothing that grows with the whole packing is held.
    """
    together(ranks, lambda: check_conductivities(particles.conductivity))
    columns = particles.box, particles.centers, particles.radii, particles.conductivity
    part = make_part(*columns, gap, ranks, _two_steps(particles, ranks))
    nodes = make_nodes(part, contacts, ranks)
    result = effective_tensor(
        part.box,
        conduction.axes,
        lambda group: solve_part(nodes, group, ranks, method=conduction.method, tolerance=conduction.tolerance),
    )
    result = replace(result, model_error=max(error for one in result.solutions for error in one.model_errors))
    return result, _census(nodes, particles, gap, ranks)


def _census(nodes: Nodes, particles: Scattered, gap: float, ranks: Ranks) -> Census:
    part, walls = nodes.part, nodes.network.walls
    own = part.packing.select(np.arange(part.own))
    sums = np.array([part.own, nodes.own, *np.bincount(walls // 2, minlength=part.box.dimension)])
    count, contacts, *at_walls = np.asarray(ranks.add_up(sums)).tolist()
    places = np.clip(own.centers + part.corner, 0.0, part.box.lengths)  # rounding may leave the box
    filling = find_filling(ParticlePacking(places, own.radii, part.box))
    ends = ranks.share((float(own.measures.sum()), filling, float(part.conductivity[: part.own].max())))
    measures, fillings, conductivities = zip(*ends, strict=True)
    doubts = ranks.share(together(ranks, lambda: _doubt(nodes.part, particles, gap)))
    density, doubt = sum(measures) / part.box.volume, _sum_of_doubts(doubts)
    return Census(count, contacts, np.array(at_walls), density, join_fillings(fillings), max(conductivities), doubt)


def _two_steps(particles: Scattered, ranks: Ranks) -> float:
    """The most by which the printed digits of a file can mislead about a gap, twice [m]."""
    if particles.printed is None:
        return 0.0
    columns = [*particles.printed.positions[: particles.box.dimension], particles.printed.radius]
    values = [*(particles.centers + np.array(particles.origin or 0.0)).T, particles.radii]
    steps = [column.step(value).max(initial=0.0) for column, value in zip(columns, values, strict=True)]
    return 2.0 * float(max(ranks.share(sum(steps))))


def _doubt(part: Part, particles: Scattered, gap: float) -> Doubt | None:
    """Contacts in doubt of the own particles; a pair on two ranks counts on that of the lower number."""
    if particles.printed is None:
        return None
    home = part.packing.centers + part.corner - part.images * np.asarray(part.box.lengths)
    places = home + np.array(particles.origin or (0.0,) * part.box.dimension)

    def counts(i: Ints, j: Ints) -> Flags:
        a, b = part.numbers[i], part.numbers[j]
        first = np.where(a <= b, i, j)  # rows i <= j, own ones first; an own image counts once, seen from either side
        return np.asarray((first < part.own) & ((i < part.own) | (i == j)))

    table = ParticleTable(part.packing, printed=particles.printed)
    return doubtful_contacts(table, gap, counts=counts, places=places)


def _sum_of_doubts(doubts: list[Doubt | None]) -> Doubt | None:
    found = [doubt for doubt in doubts if doubt is not None]
    if not found:
        return None
    pairs, walls = sum(doubt.pairs for doubt in found), sum(doubt.wall_pairs for doubt in found)
    return Doubt(pairs, walls, max(doubt.step for doubt in found), found[0].remedy)
