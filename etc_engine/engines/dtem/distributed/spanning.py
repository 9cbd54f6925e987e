"""Which contacts of all ranks can carry a steady heat flow; the definition is that of `etc_engine.medium.backbone`.

Every rank joins its own particles to clusters; the copies say which clusters of two ranks are one, and displaced by
how many periods. What is shared between ranks is that graph of clusters, not particles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Ints
from etc_engine.engines.dtem.distributed.nodes import Nodes
from etc_engine.medium.backbone import Backbone, join_clusters, prune_dead_ends
from etc_engine.ranks import Ranks


@dataclass(frozen=True, eq=False)
class SharedClusters:
    """Clusters that reach into other ranks, or around a period.

    Parameters
    ----------
    names : ndarray of int, shape (c,)
        Number of the first own particle of each cluster of a rank, sorted.
    joined : ndarray of int, shape (c,)
        Which of them are one: by the place of the first.
    winding : ndarray of bool, shape (c, d)
        Axes around which each, as a whole, wraps.
    """

    names: Ints
    joined: Ints
    winding: Flags

    def places(self, names: Ints) -> tuple[Ints, Flags]:
        """Place of each name, and whether it is there at all."""
        if not self.names.size:
            return np.zeros(names.size, dtype=np.int64), np.zeros(names.size, dtype=np.bool_)
        place = np.minimum(np.searchsorted(self.names, names), self.names.size - 1)
        return place, self.names[place] == names


def distributed_backbone(nodes: Nodes, axes: tuple[int, ...], ranks: Ranks) -> Backbone:
    """Contacts of a part that take part in a load group; arguments as of `etc_engine.medium.backbone.find_backbone`.

    Returns
    -------
    Backbone
        Its ``clusters`` name the whole cluster of each own particle, -1 of one that takes no part.
    """
    part, network = nodes.part, nodes.network
    pairs, axis = network.pairs, axes[0]
    periodic = part.box.periodic[axis]
    driven: Flags = np.asarray((network.walls // 2 == axis) & (not periodic))
    labels, _ = join_clusters(part.packing.count, pairs, np.zeros_like(network.shifts))
    own = labels[: part.own]
    shared = _shared_clusters(nodes, labels, ranks)
    names = part.firsts[ranks.rank] + own
    place, known = shared.places(names)
    joined = np.where(known, shared.joined[place] if shared.names.size else -1, -1)
    if periodic:
        flags = np.zeros((part.own, len(axes)), dtype=np.bool_)
        flags[known] = shared.winding[joined[known]][:, list(axes)]
    else:
        ends = _touched_ends(network.wall_particles[driven], network.walls[driven] % 2, own)
        flags = _spanned(ends, own, joined, shared, ranks)[:, None]
    spans = np.asarray(ranks.add_up(flags.sum(axis=0))) > 0
    kept = _pruned(nodes, np.asarray(flags.any(axis=1)), driven, ranks)
    clusters = np.where(kept[: part.own], np.where(known, joined, shared.names.size + names), -1)
    contacts = np.asarray(kept[pairs].all(axis=1))
    return Backbone(contacts, driven & kept[network.wall_particles], clusters, tuple(bool(flag) for flag in spans))


def _shared_clusters(nodes: Nodes, labels: Ints, ranks: Ranks) -> SharedClusters:
    """The graph of the clusters of all ranks that meet at copies."""
    part = nodes.part
    first = part.firsts[ranks.rank]
    own = first + labels[: part.own]
    copies = np.unique(nodes.network.pairs[:, 1])
    copies = copies[copies >= part.own]
    theirs = part.with_copies(own, ranks)[copies]
    edges = np.column_stack([first + labels[copies], theirs, part.images[copies]])
    every = np.unique(np.concatenate(ranks.share(np.unique(edges, axis=0))), axis=0)
    names, ends = np.unique(every[:, :2], return_inverse=True)
    joined, winding = join_clusters(names.size, ends.reshape(-1, 2), np.ascontiguousarray(every[:, 2:]))
    return SharedClusters(names, joined, winding)


def _touched_ends(particles: Ints, ends: Ints, labels: Ints) -> Flags:
    """Which of the two walls each cluster of this rank touches, at the row of its first particle."""
    touches = np.zeros((labels.size, 2), dtype=np.bool_)
    touches[labels[particles], ends] = True
    return touches


def _spanned(ends: Flags, labels: Ints, joined: Ints, shared: SharedClusters, ranks: Ranks) -> Flags:
    """Whether the cluster of each own particle, as a whole, touches both walls."""
    touches = np.zeros((shared.names.size, 2), dtype=np.bool_)
    rows = np.flatnonzero((joined >= 0) & (labels == np.arange(labels.size)) & ends.any(axis=1))
    for places, found in ranks.share((joined[rows], ends[rows])):
        np.logical_or.at(touches, places, found)
    whole = ends[labels]
    whole[joined >= 0] = touches[joined[joined >= 0]]
    return np.asarray(whole.all(axis=1))


def _pruned(nodes: Nodes, in_play: Flags, driven: Flags, ranks: Ranks) -> Flags:
    """Particles and copies that keep at least two contacts when dead ends are taken away on all ranks."""
    part, network = nodes.part, nodes.network
    copies = np.repeat(np.arange(part.own, part.packing.count), 2)  # two contacts more: their own rank decides
    kept = part.with_copies(in_play, ranks)
    while True:
        walls = network.wall_particles[driven & kept[network.wall_particles]]
        pairs = network.pairs[kept[network.pairs].all(axis=1)]
        left = prune_dead_ends(kept, pairs, np.concatenate([walls, copies]))
        kept = part.with_copies(left[: part.own], ranks)
        if not ranks.add_up(np.array([int((left != kept).any())]))[0]:
            return kept


def pinned_nodes(nodes: Nodes, backbone: Backbone, ranks: Ranks) -> Ints:
    """Own nodes that are held, one of each cluster: that of the lowest rank which has one.

    Parameters
    ----------
    nodes : Nodes
    backbone : Backbone
        From `distributed_backbone`.
    ranks : Ranks
    """
    mine = backbone.contacts & (nodes.of_contacts < nodes.own)
    names, rows = np.unique(backbone.clusters[nodes.network.pairs[mine, 0]], return_index=True)
    before = ranks.share(names)[: ranks.rank]
    new = ~np.isin(names, np.concatenate([names[:0], *before]))
    found: Ints = nodes.of_contacts[mine][rows[new]]
    return found
