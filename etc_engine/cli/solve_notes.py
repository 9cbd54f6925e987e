"""What ``etc-engine solve`` reports of contacts that a crop cuts, and of contacts that are missing."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from etc_engine.cli.solve_request import SolveRequest

NEAR_GAP = 0.02
"""Part of the pairs near the gap, and change of the conductivity, from which on the gap is questioned."""
RESOLVED = 20_000
"""Particles up to which the conductivity is computed again with other gaps."""

if TYPE_CHECKING:
    from etc_engine.medium.medium import Medium
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.particle_files.table import ParticleTable


def trim_cropped_walls(medium: Medium, table: ParticleTable, axes: tuple[int, ...]) -> Medium:
    """The medium cut by the driven walls of a crop, with a note on the particles that they cut."""
    import numpy as np

    from etc_engine.medium.cut_contacts import trim_crop

    driven = np.repeat(np.isin(np.arange(medium.dimension), axes), 2)
    walls = np.array(table.cropped or (False,) * driven.size) & driven
    if not (medium.links.geometric and walls.any()):
        return medium
    network, deep, cut = trim_crop(medium.links, walls)
    if deep:
        text = f"the crop goes through the middle of {deep} particles; their cut is taken at 75 degrees"
        click.echo(f"etc-engine: warning: {text}", err=True)
    if cut:
        text = f"the crop goes through {cut} contacts between particles, which are left out"
        click.echo(f"etc-engine: warning: {text}", err=True)
    return medium.with_network(network)


def warn_of_missing_contacts(network: ContactNetwork, asked: SolveRequest, *, given: bool, pores_conduct: bool) -> None:
    """A packing without a single contact is most likely a misunderstanding about the contact rule, or their file.

    Where the pores conduct it is one only if contacts were asked for.
    """
    from etc_engine.packing.neighbors import neighbor_pairs

    packing = network.packing
    if network.count or packing.count < 2:
        return
    near = neighbor_pairs(packing, relative_gap=1.0)
    if not near.count:
        return
    closest = float((near.gaps / (0.5 * packing.radii[near.pairs].sum(axis=1))).min())
    if given:
        rule, remedy = "the file of contacts has none between these particles", "see --contacts"
    elif asked.closest:
        rule, remedy = f"--coordination {asked.physics.coordination:g} makes no contact", "give a larger one"
    elif asked.takes_gap:
        rule, remedy = f"no surfaces are within {asked.bond_gap:g} mean radii", "see --bond-gap"
    else:
        instead = "--contact-angle" if asked.rule == "overlap" else f"--rule bonded or load instead of {asked.rule}"
        rule, remedy = "no particles overlap", f"touching particles conduct with {instead}"
    effect = "heat crosses the pores alone, without a contact" if pores_conduct else "nothing conducts"
    click.echo(
        f"etc-engine: warning: {rule}, so {effect}; the closest pair is {max(closest, 0.0):.2g} mean radii "
        f"apart: {remedy}",
        err=True,
    )


def warn_of_gap(asked: SolveRequest, medium: Medium, k: float, again: Callable[[float], float]) -> None:
    """How the conductivity changes with half and twice the bond gap, where many pairs lie between the two.

    Parameters
    ----------
    asked : SolveRequest
    medium : Medium
    k : float
        Conductivity at the gap asked for [W/(m K)].
    again : callable
        (gap in mean radii) -> conductivity [W/(m K)].
    """
    from etc_engine.packing.neighbors import neighbor_pairs

    gap, packing = asked.bond_gap, medium.packing
    if not asked.takes_gap or gap <= 0.0 or medium.pores.conduct or packing.count > RESOLVED or k <= 0.0:
        return
    fewer, more = (neighbor_pairs(packing, relative_gap=factor * gap).count for factor in (0.5, 2.0))
    if more - fewer <= NEAR_GAP * max(medium.links.count, 1):
        return
    low, high = again(0.5 * gap), again(2.0 * gap)
    if max(abs(low - k), abs(high - k)) > NEAR_GAP * k:
        click.echo(
            f"etc-engine: warning: {more - fewer} pairs have gaps near --bond-gap {gap:g}: the conductivity is "
            f"{low:.4g} with half the gap, {k:.4g} as asked, {high:.4g} with twice the gap",
            err=True,
        )
