"""Families of methods: how a method of thermal elements is solved, read and marched, by its name and dimension."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from etc_engine.engines.dtem import between_walls
from etc_engine.engines.dtem import conductivity as elements
from etc_engine.engines.dtem import facet_medium as sphere_facets
from etc_engine.engines.dtem.cell import medium as disk_cells
from etc_engine.engines.dtem.cell.transient import cell_system
from etc_engine.engines.dtem.cell_3d import medium as sphere_cells
from etc_engine.engines.dtem.facet_transient import sphere_system
from etc_engine.engines.dtem.field import recover_field
from etc_engine.engines.dtem.transient import element_system
from etc_engine.errors import InputError
from etc_engine.medium.conduction import Conduction, Result
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.field import ParticleField
from etc_engine.medium.medium import Medium
from etc_engine.medium.transient import ParticleSystem


@dataclass(frozen=True)
class Family:
    """Methods that share their solver.

    Parameters
    ----------
    solve : callable
        (media, conduction) -> one result per medium.
    recover : callable
        (medium, solution, load) -> ParticleField.
    links : callable
        (medium, solution) -> the medium with every way from particle to particle that heat takes as a link.
    remarks : callable
        (method, result) -> what a user should know about the accuracy of a result.
    system : callable, optional
        (medium, walls, method=, source=, capacities=, options) -> ParticleSystem.
    limit : str, optional
        Method of `CONTACTS` that takes over where the pores insulate.
    foreign : mapping
        Options of the method that belong to the other dimension, with the values that say nothing.
    """

    solve: Callable[[Sequence[Medium], Conduction], list[Result]]
    recover: Callable[[Medium, Any, int], ParticleField]
    remarks: Callable[[str, EffectiveConductivity[Any]], tuple[str, ...]] = lambda _, __: ()
    links: Callable[[Medium, Any], Medium] = lambda medium, _: medium
    system: Callable[..., ParticleSystem] | None = None
    foreign: Mapping[str, Any] = field(default_factory=dict)
    limit: str | None = None


CONTACTS = Family(
    elements.solve_series,
    lambda _, solution, load: recover_field(solution, load),
    elements.accuracy_remarks,
    system=element_system,
)
"""Elements whose nodes are the contacts; heat takes no other way."""

FAMILIES: Mapping[tuple[str, int], Family] = {
    ("cell", 2): Family(
        disk_cells.solve_series,
        disk_cells.disk_field,
        disk_cells.accuracy_remarks,
        disk_cells.disk_links,
        cell_system,
        {"frame": None},
        "chord",
    ),
    ("cell", 3): Family(
        sphere_cells.solve_series,
        sphere_cells.sphere_field,
        sphere_cells.accuracy_remarks,
        system=sphere_cells.sphere_system,
        foreign={"degree": 3, "bounds": False},
    ),
    ("facets", 3): Family(
        between_walls.solve_series,
        sphere_facets.sphere_field,
        sphere_facets.accuracy_remarks,
        sphere_facets.sphere_links,
        sphere_system,
    ),
}
"""Families by method and dimension; every other method is one of `CONTACTS`."""


def family_of(method: str, medium: Medium) -> tuple[Family, str]:
    """The family that solves a medium by a method, and the method it uses.

    Raises
    ------
    InputError
        If the pores insulate, and the method has no limit for that.
    """
    family = FAMILIES.get((method, medium.dimension), CONTACTS)
    if family is CONTACTS or medium.pores.conduct:
        return family, method
    if family.limit is None:
        raise InputError(f"method {method} is only valid with pores that conduct in {medium.dimension}D")
    return CONTACTS, family.limit


def solve_series(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Effective conductivity of media on one packing, one result per medium.

    Raises
    ------
    InputError
        If an option belongs to the other dimension, or the pores must conduct and do not.
    """
    found: dict[int, Result] = {}
    for conduct in (True, False):
        rows = [row for row, medium in enumerate(media) if medium.pores.conduct == conduct]
        if rows:
            some = [media[row] for row in rows]
            found |= dict(zip(rows, _solve_alike(some, conduction), strict=True))
    return [found[row] for row in range(len(media))]


def _solve_alike(media: Sequence[Medium], conduction: Conduction) -> list[Result]:
    """Results of media whose pores all conduct, or all insulate."""
    family, method = family_of(conduction.method, media[0])
    if method != conduction.method:
        return family.solve(media, replace(conduction, method=method, options={}))
    for name, neutral in family.foreign.items():
        if conduction.options.get(name, neutral) != neutral:
            raise InputError(f"option {name} has no effect with method {method} in {media[0].dimension}D: leave it out")
    own = {name: value for name, value in conduction.options.items() if name not in family.foreign}
    return family.solve(media, replace(conduction, options=own))


def field_of(medium: Medium, method: str, solution: Any, load: int) -> ParticleField:
    """Temperatures and heat flows of one load of a solution."""
    return family_of(method, medium)[0].recover(medium, solution, load)


def links_of(medium: Medium, method: str, solution: Any) -> Medium:
    """The medium with every way from particle to particle that heat takes as a link."""
    return family_of(method, medium)[0].links(medium, solution)


def system_of(medium: Medium, walls: Mapping[str, Any], *, method: str, **options: Any) -> ParticleSystem:
    """A medium ready to be marched in time, by a method with a transient form."""
    family, method = family_of(method, medium)
    assert family.system is not None, method
    return family.system(medium, walls, method=method, **options)


def remarks_on(method: str, result: EffectiveConductivity[Any]) -> tuple[str, ...]:
    """What a user should know about the accuracy of a result."""
    family = FAMILIES.get((method, result.tensor.shape[0]), CONTACTS)
    return family.remarks(method, result)
