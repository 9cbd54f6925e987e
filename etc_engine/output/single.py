"""The netCDF of a single solve: particles, contacts, temperatures and heat flows with labels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.box import AXES
from etc_engine.medium.field import ParticleField

if TYPE_CHECKING:
    import xarray

WALLS = ("x=0", "x=L", "y=0", "y=L", "z=0", "z=L")
UNITS = {2: ("W m-1", "m K W-1"), 3: ("W", "K W-1")}
"""Of heat flows and of resistances, by dimension; in 2D per unit thickness."""


def solve_dataset(field: ParticleField, attributes: Mapping[str, Any]) -> xarray.Dataset:
    """Dataset of one load of a steady solution.

    Parameters
    ----------
    field : ParticleField
    attributes : mapping
        Global attributes: the conductivity, how it was computed, the command.

    Returns
    -------
    xarray.Dataset
        Dimensions ``particle``, ``contact``, ``wall_contact``, ``side`` (of a contact: first, second particle).
    """
    import xarray

    medium, network = field.medium, field.medium.links
    packing, flow, resistance = medium.packing, UNITS[medium.dimension][0], UNITS[medium.dimension][1]
    places = {
        name: ("particle", column, "m", "centre")
        for name, column in zip(AXES[: medium.dimension], packing.centers.T, strict=True)
    }
    data = places | {
        "radius": ("particle", packing.radii, "m", "radius"),
        "conductivity": ("particle", np.array(medium.conductivity), "W m-1 K-1", "conductivity of the particle"),
        "temperature": ("particle", field.particle_temperatures, "K", "mean temperature of the particle"),
        "contact_particle": (("contact", "side"), network.pairs, "1", "particles in contact, row numbers from 0"),
        "contact_angle": (("contact", "side"), np.degrees(network.angles), "degree", "contact half-angle"),
        "contact_resistance": ("contact", network.resistances, resistance, "contact resistance"),
        "contact_temperature": ("contact", field.contact_temperatures, "K", "mean temperature of the contact"),
        "face_temperature": (("contact", "side"), field.face_temperatures, "K", "temperature of either face"),
        "heat_flow": ("contact", field.contact_flows, flow, "heat flow from the first to the second particle"),
        "wall_particle": ("wall_contact", network.wall_particles, "1", "particle at the wall, row number from 0"),
        "wall": ("wall_contact", np.array(WALLS, dtype=object)[network.walls], None, "wall"),
        "wall_contact_angle": ("wall_contact", np.degrees(network.wall_angles), "degree", "contact half-angle"),
        "wall_temperature": ("wall_contact", field.wall_temperatures, "K", "temperature of the wall contact"),
        "wall_heat_flow": ("wall_contact", field.wall_flows, flow, "heat flow from the particle into the wall"),
    }
    variables = {
        name: (dims, values, {"long_name": meaning} | ({"units": units} if units else {}))
        for name, (dims, values, units, meaning) in data.items()
    }
    box = packing.box
    general = {
        "Conventions": "CF-1.11",
        "box": list(box.lengths),
        "periodic": box.periodic_axes,
        "load_axis": AXES[field.axis],
        "load": "mean temperature gradient of 1 K/m"
        if box.periodic[field.axis]
        else "temperature 1 K at the low wall, 0 K at the far wall",
    }
    return xarray.Dataset(variables, attrs=general | dict(attributes))
