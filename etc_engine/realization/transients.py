"""The transient system of a medium by any engine that has one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from etc_engine.arrays import Floats
from etc_engine.errors import InputError
from etc_engine.medium.medium import Medium
from etc_engine.medium.transient import ParticleSystem, Source
from etc_engine.medium.walls import WallCondition
from etc_engine.realization.engine import Engine
from etc_engine.realization.engines import ENGINES, find_engine


def transient_system(
    medium: Medium,
    walls: Mapping[str, WallCondition],
    *,
    engine: str = "dtem",
    method: str | None = None,
    source: Source = 0.0,
    capacities: Floats | None = None,
    **options: Any,
) -> ParticleSystem:
    """A medium ready to be marched in time, with the conditions at the walls of its box.

    Parameters
    ----------
    medium : Medium
        With contacts and heat capacities.
    walls : mapping of str to condition
        By the names of `etc_engine.medium.walls.WALLS`; a wall that is not named is insulated.
    engine, method : str
        As in `etc_engine.realization.engines.effective_conductivity`.
    source : float, array_like, shape (n,), or callable of t [W, in 2D W/m]
        Heat set free in all particles, or in each.
    capacities : ndarray, shape (n,), optional [J/K, in 2D J/(m K)]
        Of the particles; rho c times what their contacts leave of them by default.
    options
        Such as ``dipoles``.

    Raises
    ------
    InputError, GeometryError
        Also if the method has no transient form.

    Examples
    --------
    >>> from etc_engine import Box, Medium, ParticlePacking, bonded_contacts, march
    >>> from etc_engine.medium.walls import FixedTemperature
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0)))
    >>> medium = Medium(disk, 1.0, bonded_contacts(disk, 0.2), heat_capacity=1.0)
    >>> system = transient_system(medium, {"left": FixedTemperature(1.0)}, engine="pipe")
    >>> *_, late = march(system.heat, system.initial(0.0), [0.0, 40.0], steps=200)
    >>> system.particle_temperatures(late.temperatures).round(6)
    array([1.])
    """
    row = find_engine(engine)
    method = method or row.default_method(medium.dimension, medium.pores.conduct)
    row.check(medium, method)
    if row.system is None or not row.methods[method].transient:
        able = [name for name, other in row.methods.items() if other.transient]
        others = [name for name, other in ENGINES.items() if _has_transients(other)]
        cure = f"choose {', '.join(able)}" if able else f"use the engine {' or '.join(others)}"
        raise InputError(f"method {method} of engine {engine} has no transient form: {cure}")
    row.resolve(method, options)
    return row.system(medium, walls, method=method, source=source, capacities=capacities, **options)


def _has_transients(engine: Engine) -> bool:
    return any(method.transient for method in engine.methods.values())
