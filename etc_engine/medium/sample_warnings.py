"""What a user should know of the sample that a particle file makes: digits, bare walls, cut particles, free space."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.box import AXES, Box
from etc_engine.medium.medium import Medium
from etc_engine.medium.network import ContactNetwork
from etc_engine.medium.pores import VACUUM, Pores
from etc_engine.particle_files.precision import doubtful_contacts
from etc_engine.particle_files.table import ParticleTable
from etc_engine.structure.filling import Filling, find_filling, free_walls

EXCESS = 0.005
"""An excess below this part is the error of a method that solves particles and pores of nearly equal conductivity."""

BARE = 0.25
"""A driven wall with less than this part of the contacts that fit on it is bare."""


def digit_warnings(table: ParticleTable, gap: float, *, bonded: bool) -> list[str]:
    """Contacts that the printed digits of the file do not decide, in a sentence.

    Parameters
    ----------
    table : ParticleTable
    gap : float
        Threshold of the contact rule, in mean radii.
    bonded : bool
        Whether the rule has a bond gap; overlaps have none.
    """
    doubt = doubtful_contacts(table, gap)
    return [] if doubt is None else [doubt.sentence(gap, bonded=bonded)]


def widest_gap(network: ContactNetwork) -> float:
    """Largest gap between two particles in contact, over the mean of their radii; 0 without a gap.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.medium.rules import coordination_contacts
    >>> from etc_engine.packing import ParticlePacking
    >>> packing = ParticlePacking([[0.2, 0.5], [0.5, 0.5]], [0.1, 0.1], Box((1.0, 1.0)))
    >>> round(widest_gap(coordination_contacts(packing, 0.1, 1.0)), 12)
    1.0
    """
    packing = network.packing
    i, j = network.pairs.T
    apart = packing.centers[j] - packing.centers[i] + network.shifts * np.asarray(packing.box.lengths)
    reach = packing.radii[i] + packing.radii[j]
    gaps = (np.linalg.norm(apart, axis=1) - reach) / (0.5 * reach)
    return float(gaps.max(initial=0.0))


def box_warnings(table: ParticleTable, driven: Sequence[int], gap: float = 0.0) -> list[str]:
    """Walls that the particles do not reach, and walls that go through them, a sentence each.

    Parameters
    ----------
    table : ParticleTable
    driven : sequence of int
        Axes along which walls drive the heat.
    gap : float
        Largest gap of a contact with a wall, in radii.
    """
    packing = table.packing
    return filling_warnings(find_filling(packing), packing.box, table.origin, driven, gap, table.cropped)


def bare_wall_warnings(network: ContactNetwork, driven: Sequence[int], origin: tuple[float, ...] = ()) -> list[str]:
    """Driven walls with few contacts: all heat then crosses a few particles, and the bulk conducts better than the box.

    As many contacts fit on a wall as squares of the mean diameter (in 2D, as mean diameters). Walls without any
    contact are those of `filling_warnings`.

    Parameters
    ----------
    network : ContactNetwork
        In pores that insulate.
    driven : sequence of int
        Axes along which walls drive the heat.
    origin : tuple of float [m]
        Low corner of the box in the coordinates of the file; empty stands for zeros.
    """
    box = network.packing.box
    origin = origin or (0.0,) * box.dimension
    diameter = 2.0 * float(network.packing.radii.mean())
    found = []
    for axis in driven:
        across = np.delete(np.asarray(box.lengths), axis)
        places = float(np.prod(across / diameter))
        for wall in (2 * axis, 2 * axis + 1):
            count = int(np.count_nonzero(network.walls == wall))
            if 0 < count < BARE * places:
                where = f"{AXES[axis]} = {origin[axis] + (wall % 2) * box.lengths[axis]:g}"
                found.append(
                    f"only {count} particles touch the driven wall {where}, where about {places:.0f} fit side by side: "
                    "all heat crosses these, and the bulk conducts better than this box; see --crop and --periodic"
                )
    return found


def narrow_bond_warnings(network: ContactNetwork) -> list[str]:
    """Bonds narrower than the overlap of their particles: the bond is the contact, and the overlap does not count."""
    radii = network.packing.radii[network.pairs]
    apart = np.linalg.norm(network.branches, axis=1)
    overlap = np.flatnonzero(apart < radii.sum(axis=1) * (1.0 - 1e-9))
    apart, (own, other) = apart[overlap], radii[overlap].T
    cosines = (apart**2 + own**2 - other**2) / (2.0 * apart * own)
    wider = np.arccos(np.clip(cosines, -1.0, 1.0)) > network.angles[overlap, 0] * (1.0 + 1e-6)
    if not (count := int(np.count_nonzero(wider))):
        return []
    pairs = (
        "1 pair overlaps more widely than its bond"
        if count == 1
        else f"{count} pairs overlap more widely than their bonds"
    )
    return [f"{pairs}: the bond is the contact, not the overlap; to use the overlap leave the contact angle out"]


def filling_warnings(
    filling: Filling,
    box: Box,
    origin: tuple[float, ...],
    driven: Sequence[int],
    gap: float,
    cropped: tuple[bool, ...] = (),
) -> list[str]:
    """The sentences of `box_warnings`, from what is known of a sample.

    Parameters
    ----------
    filling : Filling
    box : Box
    origin : tuple of float [m]
        Low corner of the box in the coordinates of the file; empty stands for zeros.
    driven, gap
        As of `box_warnings`.
    cropped : tuple of bool
        Whether each wall was made by a crop; empty stands for none.
    """
    origin = origin or (0.0,) * box.dimension
    low, high = filling.radii
    faces = [f"{AXES[k // 2]} = {origin[k // 2] + (k % 2) * box.lengths[k // 2]:g}" for k in range(2 * len(origin))]
    free = set(free_walls(filling).tolist())
    found = []
    for wall, distance in enumerate(filling.free.tolist()):
        if wall // 2 in driven and distance > gap * low:
            found.append(
                f"nothing touches the driven wall {faces[wall]}: the nearest surface is {distance:.3g} m away "
                f"({distance / high:.2g} of the largest radius), so the wall drives no heat; see --crop and --box"
            )
        elif wall in free:
            found.append(
                f"the box is larger than the sample: between the wall {faces[wall]} and the nearest particle "
                f"{distance:.3g} m are free, which count as sample; see --crop and --box"
            )
    deep = filling.deep_cuts
    made = np.array(cropped or (False,) * deep.size)
    if deep[~made].any():
        where = ", ".join(f"{faces[k]} ({deep[k]})" for k in np.flatnonzero((deep > 0) & ~made))
        found.append(
            f"walls go through {deep[~made].sum()} particles by more than half a radius: {where}; the box may be "
            "wrapped around the centres (flag s): give the faces of the container with --box low:high,..."
        )
    if deep[made].any():
        found.append(
            f"the crop cuts {deep[made].sum()} particles by more than half a radius: its walls touch their middle"
        )
    return found


def excess_warnings(tensor: ArrayLike, conductivity: ArrayLike, pores: Pores = VACUUM, error: float = 0.0) -> list[str]:
    """A sample conducts no better than its best part; where it does, the box, the contacts or the method are wrong.

    Parameters
    ----------
    tensor : array_like, shape (d, d) [W/(m K)]
    conductivity : array_like, shape (n,) [W/(m K)]
        Of the particles.
    pores : Pores
        Radiation adds to the best conductor: with it there is no such limit.
    error : float
        Estimated relative error of the method; NaN if it has none.
    """
    best = max(float(np.max(conductivity)), pores.conductivity)
    most = float(np.nanmax(np.diag(np.atleast_2d(tensor))))
    slack = EXCESS if pores.conduct else 1e-9
    if pores.radiation > 0.0 or most <= best * (1.0 + max(slack, float(np.nan_to_num(error)))):
        return []
    if pores.conduct:
        return [
            f"the conductivity {most:.6g} W/(m K) exceeds that of the best conductor of the sample, {best:.6g}: the "
            "method errs here, or walls go through particles, see --box"
        ]
    return [
        f"the conductivity {most:.6g} W/(m K) exceeds that of the particles, {best:.6g}: walls or contacts go "
        "through particles, see --box and the contact rule"
    ]


def rarefied_warnings(medium: Medium) -> list[str]:
    """A gas whose temperature jump is longer than a particle radius is no continuum between the particles.

    Examples
    --------
    >>> from etc_engine.box import Box
    >>> from etc_engine.packing import ParticlePacking
    >>> sphere = ParticlePacking([[0.5, 0.5, 0.5]], [0.5], Box((1.0, 1.0, 1.0)))
    >>> rarefied_warnings(Medium(sphere, 1.0, pores=Pores(0.1, jump_length=0.2)))
    []
    """
    jump, radius = 0.5 * medium.pores.jump_length, float(medium.packing.radii.mean())
    if jump <= radius:
        return []
    return [
        f"the temperature jump of the gas at one surface is {jump:.3g} m long, more than the mean radius {radius:.3g} "
        "m: the gas is no continuum and its share of the conductivity is not reliable; pressure 0 gives the exact limit"
    ]
