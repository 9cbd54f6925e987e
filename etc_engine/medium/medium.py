"""Medium: a packing, what its particles and its pores are made of, and the links between neighbours."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from etc_engine.arrays import Floats
from etc_engine.box import Box
from etc_engine.errors import InputError
from etc_engine.medium.local import LocalProperties
from etc_engine.medium.network import LARGEST, ContactNetwork
from etc_engine.medium.pores import VACUUM, Pores, check_conductivity
from etc_engine.packing.particles import ParticlePacking
from etc_engine.structure.union import solid_fraction

__all__ = ["VACUUM", "Medium", "Pores", "check_conductors", "medium_of", "per_particle"]


@dataclass(frozen=True, eq=False)
class Medium:
    """Particles in a box, what they and the pores are made of, and which of them touch.

    Parameters
    ----------
    packing : ParticlePacking
    conductivity : float or ndarray, shape (n,) [W/(m K)]
        Of all particles, or of each; not negative, infinite for a perfect conductor. Kept as an array.
    network : ContactNetwork, optional
        The links that an engine on contacts needs.
    pores : Pores
    heat_capacity : float or ndarray, shape (n,), optional [J/(m3 K)]
        rho c of all particles, or of each, for a transient. Kept as an array.
    local : LocalProperties, optional
        Conductivities over the temperature, where they follow the local one; those above are at one temperature.

    Raises
    ------
    InputError
        If a value is not allowed, or the network links other particles than those of the packing.

    Examples
    --------
    >>> disks = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> Medium(disks, 2.0).conductivity
    array([2., 2.])
    """

    packing: ParticlePacking
    conductivity: Floats
    network: ContactNetwork | None = None
    pores: Pores = VACUUM
    heat_capacity: Floats | None = None
    local: LocalProperties | None = None

    def __post_init__(self) -> None:
        n = self.packing.count
        values = per_particle(self.conductivity, n, "conductivity")
        for value in (values.min(initial=np.inf), values.max(initial=0.0), values[values > 0.0].min(initial=np.inf)):
            check_conductivity(float(value), "a particle")
        object.__setattr__(self, "conductivity", values)
        if self.heat_capacity is not None:
            stored = per_particle(self.heat_capacity, n, "heat capacity")
            if not (np.isfinite(stored) & (stored > 0.0)).all():
                raise InputError(f"the heat capacity must be positive and finite, found {stored.min():g}")
            object.__setattr__(self, "heat_capacity", stored)
        if self.network is not None and self.network.packing is not self.packing:
            raise InputError("the contact network must be of the packing of the medium: make both from the same one")

    def __repr__(self) -> str:
        """Particles, their conductivity, and what links them."""
        low, high = float(self.conductivity.min()), float(self.conductivity.max())
        k = f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"
        links = "no links" if self.network is None else f"{self.network.count} links by rule {self.network.rule}"
        pores = f", pores of {self.pores.conductivity:.4g} W/(m K)" if self.pores.conduct else ""
        return f"<Medium: {self.packing.count} particles of {k} W/(m K), {links}{pores}>"

    @property
    def box(self) -> Box:
        """The box of the packing."""
        return self.packing.box

    @property
    def dimension(self) -> int:
        """2 for disks, 3 for spheres."""
        return self.packing.dimension

    @cached_property
    def solid_fraction(self) -> float:
        """Exact area (volume) of the union of the particles inside the box, over the box's."""
        return solid_fraction(self.packing)

    @property
    def links(self) -> ContactNetwork:
        """The contact network.

        Raises
        ------
        InputError
            If there is none.
        """
        if self.network is None:
            raise InputError("this engine needs contacts: give the medium a contact network (overlap_contacts, ...)")
        return self.network

    def with_network(self, network: ContactNetwork) -> Medium:
        """The same particles with other contacts."""
        return replace(self, network=network)


def medium_of(
    network: ContactNetwork,
    conductivity: ArrayLike = 1.0,
    *,
    pores: Pores = VACUUM,
    heat_capacity: ArrayLike | None = None,
) -> Medium:
    """The medium of a contact network: its particles, of given conductivity and heat capacity.

    Parameters are as in `Medium`.

    Examples
    --------
    >>> from etc_engine.medium.rules import bonded_contacts
    >>> disks = ParticlePacking([[0.25, 0.5], [0.75, 0.5]], [0.25, 0.25], Box((1.0, 1.0)))
    >>> medium_of(bonded_contacts(disks, 0.1), 2.0).conductivity
    array([2., 2.])
    """
    stored = None if heat_capacity is None else np.asarray(heat_capacity, dtype=np.float64)
    return Medium(network.packing, np.asarray(conductivity, dtype=np.float64), network, pores, stored)


def check_conductors(medium: Medium) -> None:
    """Refuse particles that an engine on contacts cannot take: every one must conduct, and none perfectly.

    Raises
    ------
    InputError
    """
    check_conductivities(medium.conductivity)


def check_conductivities(values: Floats) -> None:
    """Refuse conductivities of particles as `check_conductors` does.

    Raises
    ------
    InputError
    """
    bad = ~((values >= 1.0 / LARGEST) & (values <= LARGEST))
    if bad.any():
        found = float(values[bad][0])
        if found > 0.0 and np.isfinite(found):
            raise InputError(f"the conductivity must lie between {1.0 / LARGEST:g} and {LARGEST:g}, found {found:g}")
        raise InputError(f"the conductivity must be positive and finite, found {found:g}")


def per_particle(values: ArrayLike, count: int, name: str) -> Floats:
    """One value for all particles, or one for each, as an array of shape (count,), which may be read only.

    Raises
    ------
    InputError
        If there are not as many.
    """
    array = np.array(values, dtype=np.float64)
    if array.ndim and array.shape != (count,):
        raise InputError(f"the {name} must be one number or an array of shape ({count},), found {array.shape}")
    return np.broadcast_to(array, (count,))
