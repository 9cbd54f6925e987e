"""What ``chord`` is estimated to miss, where the two sides of a contact may lie on two ranks.

The terms are those of `etc_engine.engines.dtem.model_error` and `etc_engine.engines.dtem.sphere_error`. Each contact
adds up what its sides know: 1/kappa, the slope of the temperature along it, and the width.
"""

from __future__ import annotations

import numpy as np

from etc_engine.arrays import Floats
from etc_engine.engines.dtem.distributed.nodes import Nodes
from etc_engine.engines.dtem.model_error import disk_estimate, disk_terms, film_energy, flow_sums
from etc_engine.engines.dtem.sphere_error import sphere_estimate, sphere_slopes
from etc_engine.medium.backbone import Backbone
from etc_engine.medium.sides import ContactSides, contact_sides
from etc_engine.ranks import Ranks


def distributed_error(
    nodes: Nodes, backbone: Backbone, sides: ContactSides, flows: Floats, energy: float, ranks: Ranks
) -> float:
    """Estimated relative error of the conductivity of one load, in magnitude; the same on every rank.

    Parameters
    ----------
    nodes : Nodes
    backbone : Backbone
        Of the contacts of this rank.
    sides : ContactSides
        Of the own particles; wall contacts are nodes beyond the others.
    flows : ndarray, shape (s,)
        Heat flow into the particle at each side.
    energy : float
        Of all ranks.
    ranks : Ranks
        Every rank makes this call.
    """
    if energy == 0.0:
        return 0.0
    flows = np.ascontiguousarray(flows)
    kappa = nodes.part.conductivity[: nodes.part.own]
    own = kappa[sides.particles]
    every = contact_sides(nodes.network.select(backbone.contacts, backbone.wall_contacts))  # own ones first
    padded = np.concatenate([flows, np.zeros(every.nodes.size - flows.size)])
    film = float(ranks.add_up(np.array([film_energy(every, nodes.part.conductivity, padded)]))[0]) / energy
    if sides.dimension == 2:
        segments, moments, close, slopes = disk_terms(sides, kappa, flows)
        inner, at_walls = _at_contacts(nodes, sides, own, slopes[:, None], ranks)
        local = np.array([segments, moments, inner, at_walls, close, *flow_sums(sides, kappa, flows)])
        sums = np.asarray(ranks.add_up(local))
        terms = np.array([sums[0], sums[1], 0.5 * np.pi * (sums[2] + sums[3]), sums[4]]) / energy
        return disk_estimate(terms, sums[5:]) + film
    powers, vectors = sphere_slopes(sides, kappa, flows)
    inner, at_walls = _at_contacts(nodes, sides, own, vectors, ranks)
    sums = np.asarray(ranks.add_up(np.array([inner, at_walls, powers, float(np.abs(flows).sum())])))
    crossing = 8.0 / 3.0 * float(sums[0] + sums[1]) / energy
    return sphere_estimate(crossing, float(sums[2] / sums[3])) + film


def _at_contacts(nodes: Nodes, sides: ContactSides, own: Floats, slopes: Floats, ranks: Ranks) -> tuple[float, float]:
    """Sums over the own contacts and the own wall contacts.

    Of disks sum (s_A + s_B)^2/(1/a + 1/b) and sum a s^2; of spheres sum c^3 |s_A - s_B|^2/(1/a + 1/b) and
    sum a c^3 |s|^2, with a and b the conductivities and c the smaller width of the two sides.
    """
    spheres = slopes.shape[1] == 3
    widths = sides.radii[sides.particles] * np.sin(sides.alpha) if spheres else np.ones(own.size)
    squares = (slopes**2).sum(axis=1)
    wall = sides.nodes >= nodes.count
    at_walls = float((own * widths**3 * squares)[wall].sum())
    at = sides.nodes[~wall]
    added = np.zeros((nodes.count, slopes.shape[1] + 2))
    np.add.at(added, at, np.column_stack([1.0 / own, squares, slopes])[~wall])
    narrow = np.full(nodes.count, np.inf)
    np.minimum.at(narrow, at, widths[~wall])
    received = ranks.exchange([(added[taken], narrow[taken]) for taken in nodes.taken])
    for given, (more, width) in zip(nodes.given, received, strict=True):
        added[given] += more
        narrow[given] = np.minimum(narrow[given], width)
    added, narrow = added[: nodes.own], narrow[: nodes.own]
    used = added[:, 0] > 0.0
    resist, both, total = added[used, 0], added[used, 1], (added[used, 2:] ** 2).sum(axis=1)
    across = 2.0 * both - total if spheres else total
    return float((narrow[used] ** 3 * across / resist).sum()), at_walls
