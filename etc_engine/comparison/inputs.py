"""What the result of a sweep knows of the further inputs of a model: sizes, contacts, temperature, gas, radiation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from etc_engine.box import ball_measure
from etc_engine.comparison.simulation import current_study
from etc_engine.materials import accommodation_from_masses, find_solid, gas_state, jump_length
from etc_engine.realization import Status
from etc_engine.sweep.table import measured

if TYPE_CHECKING:
    import xarray


def known_inputs(dataset: xarray.Dataset) -> dict[str, xarray.DataArray]:
    """Inputs of models by name, each on those dimensions of the sweep that vary it.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    dict of DataArray
        ``diameter`` [m]: of the sphere (disk) of the mean volume (area), of packings in files that of the first.
        ``coordination``: contacts of a particle, mean over the realizations that have a conductivity; links through
        pores do not count. ``temperature`` [K], ``emissivity`` and ``jump_length`` [m] of one
        surface where the study says them; an emissivity of 0 beside a gas without radiation.
    """
    import xarray

    study = current_study(dataset)
    found: dict[str, xarray.DataArray] = {}
    dimension = dataset.sizes["direction_i"]
    particles = dataset["particles"].where(dataset["particles"] > 0)
    volumes = dataset["packing_density"] * float(np.prod(study["packing"]["box"])) / particles
    files = "sources" in study["packing"]  # of these the box of the first is known
    volume = volumes.isel(realization=0, drop=True) if files else volumes.mean("realization")
    found["diameter"] = 2.0 * (volume / float(ball_measure(1.0, dimension))) ** (1.0 / dimension)
    valid = dataset["status"] <= int(Status.NOT_PERCOLATING)
    found["coordination"] = measured(dataset, "coordination").where(valid).mean("realization")
    for name in ("temperature", "emissivity"):
        if name in dataset.coords:
            found[name] = dataset[name].reset_coords(drop=True)
    if "temperature" in found and "emissivity" not in found:
        found["emissivity"] = xarray.DataArray(0.0)
    jumps = _jump_length(study, dataset)
    if jumps is not None:
        found["jump_length"] = jumps
    return found


def rarefied_words(dataset: xarray.Dataset) -> str | None:
    """The warning that in some conditions of a sweep the gas is no continuum between the particles.

    The temperature jump of one surface is then longer than the mean radius. Vacuum is exact and stays out.

    Parameters
    ----------
    dataset : xarray.Dataset
        Result of a sweep.

    Returns
    -------
    str or None
        One sentence with the temperature and pressure of the longest jump, or None where no jump is that long.
    """
    known = known_inputs(dataset)
    if "jump_length" not in known:
        return None
    jump = known["jump_length"]
    radius = 0.5 * float(known["diameter"].mean())
    rarefied = (jump > radius) & np.isfinite(jump)
    if not bool(rarefied.any()):
        return None
    place = np.unravel_index(int(np.argmax(jump.where(rarefied, 0.0).values)), jump.shape)
    at = jump[place]
    temperature, pressure = (
        float((at if name in jump.dims else dataset)[name]) for name in ("temperature", "pressure")
    )
    return (
        f"the temperature jump of the gas is longer than the mean radius {radius:.3g} m in {int(rarefied.sum())} of "
        f"{jump.size} conditions, at most {float(at):.3g} m at {temperature:g} K and "
        f"{pressure:g} Pa: the gas is no continuum there and its share of the conductivity is not "
        "reliable; pressure 0 gives the exact limit"
    )


def _jump_length(study: dict[str, Any], dataset: xarray.Dataset) -> xarray.DataArray | None:
    """Jump length of one surface at every temperature and pressure; infinite in vacuum."""
    import xarray

    gas, material = study["pores"].get("gas"), study["particles"].get("material")
    given = dataset["accommodation"] if "accommodation" in dataset.coords else None
    if gas is None or (given is None and material is None):
        return None
    accommodation = xarray.DataArray(np.nan) if given is None else given
    names = ("temperature", "pressure")
    conditions = [dataset[name].reset_coords(drop=True) for name in names]
    t, p, a = xarray.broadcast(*conditions, accommodation.reset_coords(drop=True))
    values = np.full(t.shape, np.inf)
    for place in np.ndindex(t.shape):
        if p.values[place] > 0.0:
            state = gas_state(gas, float(t.values[place]), float(p.values[place]))
            value = float(a.values[place])
            mass = None if material is None else find_solid(material).atomic_mass
            if np.isnan(value):
                value = np.nan if mass is None else min(accommodation_from_masses(mass, state), 1.0)
            values[place] = 0.0 if np.isnan(value) else jump_length(state, value)
    return t.copy(data=values)
