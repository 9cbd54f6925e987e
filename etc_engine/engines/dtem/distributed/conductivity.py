"""Effective conductivity of one packing that many ranks hold together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.box import Box
from etc_engine.engines.dtem.distributed.blocks import make_part
from etc_engine.engines.dtem.distributed.nodes import Nodes, make_nodes
from etc_engine.engines.dtem.distributed.steady import PartialSolution, solve_part
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import EffectiveConductivity, effective_tensor
from etc_engine.medium.medium import check_conductivities
from etc_engine.medium.network import ContactNetwork
from etc_engine.packing.particles import ParticlePacking
from etc_engine.ranks import Ranks, together


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
    """

    box: Box
    centers: Floats
    radii: Floats
    conductivity: Floats


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
    fill_height : float [m]
        Highest surface along the last axis.
    most_conductive : float [W/(m K)]
        Largest conductivity of a particle.
    """

    particles: int
    contacts: int
    wall_contacts: Ints
    density: float
    fill_height: float
    most_conductive: float


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
    part = make_part(particles.box, particles.centers, particles.radii, particles.conductivity, gap, ranks)
    nodes = make_nodes(part, contacts, ranks)
    result = effective_tensor(
        part.box,
        conduction.axes,
        lambda group: solve_part(nodes, group, ranks, method=conduction.method, tolerance=conduction.tolerance),
    )
    return result, _census(nodes, ranks)


def _census(nodes: Nodes, ranks: Ranks) -> Census:
    part, walls = nodes.part, nodes.network.walls
    own = part.packing.select(np.arange(part.own))
    sums = np.array([part.own, nodes.own, *np.bincount(walls // 2, minlength=part.box.dimension)])
    count, contacts, *at_walls = np.asarray(ranks.add_up(sums)).tolist()
    last = own.centers[:, -1] + part.corner[-1] + own.radii
    ends = ranks.share((float(own.measures.sum()), float(last.max()), float(part.conductivity[: part.own].max())))
    measures, heights, conductivities = zip(*ends, strict=True)
    return Census(
        count, contacts, np.array(at_walls), sum(measures) / part.box.volume, max(heights), max(conductivities)
    )
