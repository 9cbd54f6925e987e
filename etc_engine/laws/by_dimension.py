r"""The resistance law of a particle by the dimension of its box: the one place that asks for the dimension.

With T_o the mean temperature, Q the heat into the particle of radius R in d dimensions and S its sum, stored evenly,

    T_c = T_o e + H Q + w S e/(kappa R^(d-2)),

kappa R^(d-2) H being the matrices of the law, dimensionless, and w its warming. Of H a first harmonic
m u u^T/(kappa R^(d-2)) follows a change of flux slowly; a share of it belongs to the dipole that the particle stores.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Flags, Floats, Ints
from etc_engine.errors import InputError
from etc_engine.laws import disk, disk_chords, sphere, sphere_dents


@dataclass(frozen=True, eq=False)
class ResistanceLaw:
    """What an engine asks about the contacts of a particle.

    Parameters
    ----------
    name : str
        ``disk`` or ``sphere``.
    contact : str
        What a contact is: ``arc`` or ``disk``.
    self_resistances : dict of callable
        By method, kappa R^(d-2) h_ii of half-angles.
    pipe_resistances : dict of callable
        The same and further ones, which have no mutual resistances.
    matrices : callable
        (offsets, arms, alpha, method, cutting) -> kappa R^(d-2) H of all particles, packed. ``cutting`` marks the
        contacts behind which the particle ends; all of them if it is None.
    moments : callable
        (arms, alpha) -> first harmonic u of each contact, shape (s, d).
    cut : callable
        Half-angles -> area or volume behind a contact of the unit particle.
    warming : float
        kappa R^(d-2) times the temperature of the rim above the mean per heat stored, in the gauge of H.
    harmonic : float
        m, the weight of the first harmonic in kappa R^(d-2) H.
    share : float
        Part of the first harmonic that follows the stored dipole.
    widest_cut : float
        Half-angle [rad] up to which a wall may cut the particle with other contacts beside it.
    """

    name: str
    contact: str
    self_resistances: Mapping[str, Callable[[ArrayLike], Floats]]
    pipe_resistances: Mapping[str, Callable[[ArrayLike], Floats]]
    matrices: Callable[
        [Ints, Floats, Floats, str, Flags | None],
        Floats,
    ]
    moments: Callable[[Floats, Floats], Floats]
    cut: Callable[[Floats], Floats]
    warming: float
    harmonic: float
    share: float
    widest_cut: float


LAWS: Mapping[int, ResistanceLaw] = {
    2: ResistanceLaw(
        "disk",
        "arc",
        disk.SELF_RESISTANCE,
        disk.SELF_RESISTANCE,
        disk_chords.resistance_matrices,
        disk.first_moments,
        disk.segment_area,
        warming=(0.125 - np.log(2.0)) / np.pi,
        harmonic=1.0 / np.pi,
        share=6.0 / 7.0,
        widest_cut=0.5 * np.pi,
    ),
    3: ResistanceLaw(
        "sphere",
        "disk",
        sphere.SELF_RESISTANCE,
        sphere.PIPE_RESISTANCE,
        sphere_dents.resistance_matrices,
        sphere.first_moments,
        sphere_dents.cap_volume,
        warming=1.0 / (20.0 * np.pi),
        harmonic=3.0 / (4.0 * np.pi),
        share=7.0 / 8.0,
        widest_cut=np.radians(75.0),
    ),
}


def law_of(dimension: int) -> ResistanceLaw:
    """The law of disks in 2 dimensions, of spheres in 3.

    Raises
    ------
    InputError

    Examples
    --------
    >>> law_of(3).name
    'sphere'
    """
    if dimension not in LAWS:
        raise InputError(f"particles conduct in 2 or 3 dimensions, found {dimension}")
    return LAWS[dimension]


def length_scales(radii: Floats, dimension: int) -> Floats:
    """R^(d-2), which multiplies kappa in the resistance of a particle, shape (n,)."""
    return np.asarray(radii ** (dimension - 2))


def self_resistance(alpha: Floats, radii: Floats, dimension: int, method: str) -> Floats:
    """Resistance kappa h_ii between a contact and the mean of its particle, dimensionless or, of spheres, [1/m].

    Parameters
    ----------
    alpha : ndarray [rad]
        Half-angles of the contacts.
    radii : ndarray [m]
        Of their particles.
    dimension : int
    method : str
        A name of `ResistanceLaw.pipe_resistances`.

    Raises
    ------
    InputError
        If there is no such method.
    """
    law = law_of(dimension)
    if method not in law.pipe_resistances:
        raise InputError(f"a {law.name} has no method {method!r}: expected {', '.join(law.pipe_resistances)}")
    return law.pipe_resistances[method](alpha) / length_scales(radii, dimension)
