"""Contacts of a part, and the nodes that stand for them: a contact between two ranks is a node of the lower one.

Both ranks find such a contact. Its name is the pair of particle numbers, the lower one first, and the periodic image
of the second as the first sees it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Flags, Ints
from etc_engine.engines.dtem.distributed.blocks import Part
from etc_engine.errors import InputError
from etc_engine.medium.network import ContactNetwork
from etc_engine.packing.particles import ParticlePacking
from etc_engine.ranks import Ranks, together


@dataclass(frozen=True, eq=False)
class Nodes:
    """The contacts that the own particles of a part have, and their nodes.

    Parameters
    ----------
    part : Part
    network : ContactNetwork
        Of own particles and copies: the first particle of each contact is an own one, as that of each wall contact.
    of_contacts : ndarray of int, shape (m,)
        Node of each contact: those of this rank first, then those of others. A particle that touches its own periodic
        image has two contacts of one node.
    own : int
        Nodes of this rank.
    count : int
        Nodes of this rank and of others.
    given : tuple of ndarray of int
        Own nodes that each other rank uses.
    taken : tuple of ndarray of int
        Nodes of each other rank that this rank uses, in the order of its ``given``.
    """

    part: Part
    network: ContactNetwork
    of_contacts: Ints
    own: int
    count: int
    given: tuple[Ints, ...]
    taken: tuple[Ints, ...]

    def with_others(self, values: np.ndarray, ranks: Ranks) -> np.ndarray:
        """Values at all nodes from those at the own ones, which come first; other ranks give the rest."""
        every = np.zeros((self.count, *values.shape[1:]), dtype=values.dtype)
        every[: self.own] = values
        for nodes, found in zip(self.taken, ranks.exchange([values[nodes] for nodes in self.given]), strict=True):
            every[nodes] = found
        return every


def make_nodes(part: Part, contacts: Callable[[ParticlePacking], ContactNetwork], ranks: Ranks) -> Nodes:
    """Contacts of a part by a rule, and their nodes.

    Parameters
    ----------
    part : Part
    contacts : callable
        A contact rule in which a contact depends on its two particles alone.
    ranks : Ranks

    Raises
    ------
    GeometryError
        If particles or contacts are none of the rule.
    """
    network, keys, keepers = together(ranks, lambda: _named_contacts(part, contacts, ranks))
    mine, copied = keepers == ranks.rank, network.pairs[:, 1] >= part.own
    own_keys, place, times = np.unique(keys[mine], return_inverse=True, return_counts=True)
    asked = [np.unique(keys[keepers == rank]) if rank != ranks.rank else keys[:0] for rank in range(ranks.size)]
    # both sides must have found a contact: rounding may decide a tangent pair differently on either
    places = [_places(own_keys, wanted) for wanted in ranks.exchange(asked)]
    answers = ranks.exchange([found >= 0 for found in places])
    kept = times == 2  # a particle and its own image, or two own particles across a period
    kept[place[~copied[mine]]] = True
    for found in places:
        kept[found[found >= 0]] = True
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    own = int(kept.sum())
    of_contacts = np.full(len(keys), -1)
    of_contacts[mine] = number[place]
    count, taken = own, []
    for rank, (wanted, answer) in enumerate(zip(asked, answers, strict=True)):
        names = wanted[answer]
        taken.append(np.arange(count, count + names.size))
        theirs = np.flatnonzero(keepers == rank) if rank != ranks.rank else keys[:0]
        at = _places(names, keys[theirs])
        of_contacts[theirs] = np.where(at >= 0, count + at, -1)
        count += names.size
    chosen = of_contacts >= 0
    given = tuple(number[found[found >= 0]] for found in places)
    network = network.select(chosen, np.ones(network.walls.size, dtype=np.bool_))
    return Nodes(part, network, of_contacts[chosen], own, count, given, tuple(taken))


def _named_contacts(
    part: Part, contacts: Callable[[ParticlePacking], ContactNetwork], ranks: Ranks
) -> tuple[ContactNetwork, Ints, Ints]:
    """The network of the own particles, the name of each contact as one number, and the rank that keeps its node."""
    try:
        network = contacts(part.packing)
    except InputError as error:
        where = f"rank {ranks.rank} of {ranks.size}, whose own particles are counted from 0"
        raise type(error)(f"{error} (on {where})" if ranks.size > 1 else str(error)) from None
    network = network.select(network.pairs[:, 0] < part.own, network.wall_particles < part.own)
    i, j = network.pairs.T
    a, b, image = part.numbers[i], part.numbers[j], part.images[j]
    turned = (b < a) | ((a == b) & _backwards(image))
    lower, upper = np.where(turned, b, a), np.where(turned, a, b)
    image = np.where(turned[:, None], -image, image)
    keepers = np.where(b < a, part.owners[j], ranks.rank)
    keys = (lower - part.firsts[keepers]) * part.total + upper
    for column in image.T:
        keys = keys * (2 * part.farthest + 1) + column + part.farthest
    return network, keys, keepers


def _backwards(image: Ints) -> Flags:
    """Whether the first component that is not zero is negative."""
    first = np.take_along_axis(image, (image != 0).argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.asarray(first < 0)


def _places(names: Ints, wanted: Ints) -> Ints:
    """Place of each wanted number among sorted ones, -1 where it is not among them."""
    if not names.size:
        return np.full(wanted.size, -1)
    place = np.minimum(np.searchsorted(names, wanted), names.size - 1)
    return np.where(names[place] == wanted, place, -1)
