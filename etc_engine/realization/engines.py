"""The engines by name. A row says what an engine can do, and is all that the other rooms ask about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from etc_engine.box import AXES
from etc_engine.engines.dtem import families as dtem
from etc_engine.engines.dtem.distributed.conductivity import distributed_conductivity
from etc_engine.engines.dtem.methods import dimensions_of
from etc_engine.engines.lattice import homogenize as lattice
from etc_engine.engines.pipe import steady as pipe
from etc_engine.engines.pipe.field import pipe_field
from etc_engine.engines.pipe.transient import pipe_system
from etc_engine.engines.voxel import homogenize as voxel
from etc_engine.engines.voxel.section import section_of
from etc_engine.errors import EtcError, InputError
from etc_engine.medium.conduction import Conduction
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.field import ParticleField
from etc_engine.medium.medium import Medium
from etc_engine.realization.engine import MAY, MUST, PARTICLE_BYTES, Engine, Method
from etc_engine.realization.options import (
    ANGLE_CURVE,
    BOUNDARY,
    BOUNDS,
    DEGREE,
    DIPOLES,
    DISTRIBUTED,
    ERROR_ESTIMATE,
    FRAME,
    GREEN,
    MATERIAL_CURVE,
    MODES,
    Option,
    whole_number,
    word_of,
)

VOXEL_BYTES, NODE_BYTES = 300.0, 3000.0
"""Measured peaks of memory per voxel and lattice node."""


def _voxel_memory(lengths: Sequence[float], particles: float, options: Mapping[str, Any]) -> float:
    counts = np.asarray(lengths) / min(lengths) * options["resolution"]
    return PARTICLE_BYTES * particles + VOXEL_BYTES * float(np.prod(counts))


def _lattice_memory(_: Sequence[float], particles: float, options: Mapping[str, Any]) -> float:
    return PARTICLE_BYTES * particles + NODE_BYTES * options["particles"]


def _elements(name: str, description: str, *options: str) -> Method:
    """A method of thermal elements with a transient form."""
    return Method(description, dimensions_of(name), transient=True, options=("angle_curve", "dipoles", *options))


def _grid(description: str) -> Method:
    """A method on voxels."""
    options = ("resolution", "boundary", "solver", "green", "threads")
    return Method(description, (2, 3), contacts=False, pores=MAY, options=options)


def _nodes(description: str) -> Method:
    """A method on a particle lattice."""
    return Method(description, (3,), contacts=False, pores=MAY, options=("particles", "boundary"))


ENGINES: Mapping[str, Engine] = {
    engine.name: engine
    for engine in (
        Engine(
            "dtem",
            "discrete thermal elements: particles with resistances between all of their contacts",
            {
                "chord": _elements("chord", "contact chords, each exact for a far source", "distributed"),
                "standard": _elements("standard", "uniform flux over the contact arcs (Feng et al. 2008)"),
                "enhanced": _elements("enhanced", "uniform flux with a tabulated correction (Feng et al. 2008)"),
                "arc": _elements("arc", "flux over the contact arcs in modes", "modes"),
                "exact": Method(
                    "particles cut by their contacts; of disks with two-sided bounds",
                    dimensions_of("exact"),
                    options=("modes",),
                ),
                "facets": Method(
                    "facet links: spheres and the fluid between them, one link per Laguerre facet",
                    (3,),
                    contacts=False,
                    pores=MUST,
                    transient=True,
                    options=("dipoles", "material_curve"),
                    gas=True,
                    local=True,
                ),
                "cell": Method(
                    "Laguerre cells: disks or spheres and the fluid between them (insulating pores of disks: chord)",
                    (2, 3),
                    pores=MAY,
                    transient=True,
                    options=("degree", "frame", "error_estimate", "bounds"),
                ),
            },
            lambda media, conduction, _: dtem.solve_series(media, conduction),
            {
                "modes": MODES,
                "angle_curve": ANGLE_CURVE,
                "dipoles": DIPOLES,
                "material_curve": MATERIAL_CURVE,
                "degree": DEGREE,
                "frame": FRAME,
                "error_estimate": ERROR_ESTIMATE,
                "bounds": BOUNDS,
                "distributed": DISTRIBUTED,
            },
            distribute=distributed_conductivity,
            system=dtem.system_of,
            recover=dtem.field_of,
            links=dtem.links_of,
            remarks=dtem.remarks_on,
        ),
        Engine(
            "pipe",
            "pipe network: particles at their mean temperatures, joined by the resistances of their contacts",
            {
                "chord": Method("resistance of a contact chord", (2, 3), transient=True),
                "uniform": Method("resistance under uniform flux (Feng et al. 2009)", (2, 3), transient=True),
                "holm": Method("2 kappa c, for small contacts of radius c", (3,), transient=True),
                "root-area": Method("2 kappa sqrt(A), as in some DEM codes: 1.77 times too much", (3,), transient=True),
            },
            lambda media, conduction, _: pipe.solve_series(media, conduction),
            system=pipe_system,
            recover=pipe_field,
        ),
        Engine(
            "lattice",
            "particle lattice: the whole medium as nodes and links",
            {
                "laguerre": _nodes("facets of a Laguerre tessellation fitted to the spheres"),
                "contact": _nodes("calibrated contact network (Haddad et al. 2021)"),
            },
            lattice.solve_series,
            {"particles": Option("particles of the lattice, about", 10_000, whole_number(50)), "boundary": BOUNDARY},
            memory=_lattice_memory,
        ),
        Engine(
            "voxel",
            "voxels: the whole medium on a regular grid, by FFT",
            {
                "laminate": _grid("a laminate in every voxel that an interface crosses"),
                "binary": _grid("every voxel has the conductivity at its centre"),
            },
            lambda media, conduction, _: voxel.solve_series(media, conduction),
            {
                "resolution": Option("voxels along the shortest edge of the box", 64, whole_number(2)),
                "boundary": BOUNDARY,
                "solver": Option("iteration", "cg", word_of("cg", "eyre-milton")),
                "green": GREEN,
                "threads": Option("threads of the FFT", 1, whole_number(1)),
            },
            section=section_of,
            memory=_voxel_memory,
        ),
    )
}


def find_engine(name: str) -> Engine:
    """The engine of a name.

    Raises
    ------
    InputError
        If there is none.
    """
    if name not in ENGINES:
        raise InputError(f"unknown engine {name!r}: expected one of {', '.join(ENGINES)}")
    return ENGINES[name]


def effective_conductivity(
    medium: Medium,
    *,
    engine: str = "dtem",
    method: str | None = None,
    axes: tuple[int, ...] | None = None,
    tolerance: float = 1e-10,
    seed: int = 1,
    **options: Any,
) -> EffectiveConductivity[Any]:
    """Effective conductivity of a medium by any engine.

    Parameters
    ----------
    medium : Medium
    engine, method : str
        A name of `ENGINES`, and one of its methods; the engine's own default for the medium if none is given.
    axes : tuple of int, optional
        Load axes; all by default.
    tolerance : float
        Relative error of the conductivity left by the iterative solver.
    seed : int
        Of everything that the engine draws.
    options
        Options of the engine that the method heeds.

    Returns
    -------
    EffectiveConductivity

    Raises
    ------
    InputError, GeometryError, PackingError, ConvergenceError

    Examples
    --------
    >>> from etc_engine import Box, Medium, ParticlePacking, Pores, bonded_contacts
    >>> disk = ParticlePacking([[0.5, 0.5]], [0.5], Box((1.0, 1.0), (True, True)))
    >>> round(effective_conductivity(Medium(disk, 2.0, bonded_contacts(disk, 0.1))).mean, 6)
    0.859369
    >>> round(effective_conductivity(Medium(disk, 2.0, pores=Pores(1.0)), engine="voxel", resolution=16).mean, 1)
    1.7
    """
    row = find_engine(engine)
    method = method or row.default_method(medium.dimension, medium.pores.conduct)
    result = row.results([medium], Conduction(engine, method, options, tolerance, axes), seed)[0]
    if isinstance(result, EtcError):
        raise result
    return result


def field_along(
    medium: Medium, result: EffectiveConductivity[Any], *, engine: str, method: str, axis: int = 0
) -> ParticleField:
    """Temperatures and heat flows of every particle and contact under the load along one axis.

    Parameters
    ----------
    medium : Medium
    result : EffectiveConductivity
        Of the medium, by the engine and method.
    engine, method : str
    axis : int
        One that was asked for.

    Raises
    ------
    InputError
        If the engine has no fields of particles, or the axis was not asked for.
    """
    row = find_engine(engine)
    if row.recover is None:
        raise InputError(f"engine {engine} has no temperatures of particles and contacts")
    for solution in result.solutions:
        if axis in solution.axes:
            return row.recover(medium, method, solution, solution.axes.index(axis))
    raise InputError(f"the conductivity along {AXES[axis]} was not asked for: there is no field of that load")


def linked_medium(
    medium: Medium, result: EffectiveConductivity[Any], *, engine: str, method: str, axis: int = 0
) -> Medium:
    """The medium with every way from particle to particle that heat takes as a link: that of `field_along`.

    Without temperatures, which cost about as much as the elements in pores that conduct. The medium itself where the
    engine has no other links.

    Parameters
    ----------
    medium, result, engine, method, axis
        As in `field_along`.
    """
    row = find_engine(engine)
    for solution in result.solutions:
        if axis in solution.axes:
            return row.links(medium, method, solution)
    return medium
