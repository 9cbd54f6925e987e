"""Engine and Method: what a row of the table of engines says, and how it is asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from etc_engine.errors import EtcError, InputError
from etc_engine.medium.conduction import Conduction, Result
from etc_engine.medium.conductivity import EffectiveConductivity
from etc_engine.medium.field import ParticleField
from etc_engine.medium.medium import Medium
from etc_engine.medium.transient import ParticleSystem
from etc_engine.realization.options import Option
from etc_engine.realization.outcome import Outcome, outcome_of

NO, MAY, MUST = "no", "may", "must"
"""Whether the pores of a medium conduct: not with this method, if they do, or always."""

PARTICLE_BYTES = 1600.0
"""Measured peak of memory per particle."""


@dataclass(frozen=True)
class Method:
    """One method of an engine.

    Parameters
    ----------
    description : str
    dimensions : tuple of int
        Of the boxes it works in.
    contacts : bool
        Whether it needs a contact network.
    pores : str
        ``no``, ``may`` or ``must`` conduct.
    transient : bool
        Whether it has a transient form.
    options : tuple of str
        Options of the engine that it heeds.
    gas : bool
        Whether it takes rarefied gas and radiation between the particles.
    local : bool
        Whether properties may follow the local temperature.
    """

    description: str
    dimensions: tuple[int, ...]
    contacts: bool = True
    pores: str = NO
    transient: bool = False
    options: tuple[str, ...] = ()
    gas: bool = False
    local: bool = False


@dataclass(frozen=True)
class Engine:
    """One way to conduct heat through a medium.

    Parameters
    ----------
    name, description : str
    methods : mapping of str to Method
        The first that fits is the default, see `default_method`.
    solve : callable
        (media, conduction, seed) -> one result per medium.
    options : mapping of str to Option
        Further choices by name.
    system : callable, optional
        (medium, walls, method=, source=, options) -> ParticleSystem, of methods with a transient form.
    recover : callable, optional
        (medium, method, solution, load) -> ParticleField of one load of a solution.
    links : callable
        (medium, method, solution) -> the medium with every way from particle to particle that heat takes as a link.
    section : callable, optional
        (medium, method=, options) -> section through the heat flux, for a picture.
    remarks : callable
        (method, result) -> what a user should know about the accuracy of a result.
    distribute : callable, optional
        (particles, contacts, conduction, ranks, gap=) -> (conductivity, census) of one packing on many ranks, by the
        methods that heed the option ``distributed``.
    memory : callable
        (edge lengths, particles, options) -> expected bytes of a rank, particles included.
    """

    name: str
    description: str
    methods: Mapping[str, Method]
    solve: Callable[[Sequence[Medium], Conduction, int], list[Result]]
    options: Mapping[str, Option] = field(default_factory=dict)
    system: Callable[..., ParticleSystem] | None = None
    recover: Callable[[Medium, str, Any, int], ParticleField] | None = None
    links: Callable[[Medium, str, Any], Medium] = lambda medium, _, __: medium
    section: Callable[..., Any] | None = None
    remarks: Callable[[str, EffectiveConductivity[Any]], tuple[str, ...]] = lambda _, __: ()
    distribute: Callable[..., tuple[EffectiveConductivity[Any], Any]] | None = None
    memory: Callable[[Sequence[float], float, Mapping[str, Any]], float] = lambda _, n, __: PARTICLE_BYTES * n

    @property
    def dimensions(self) -> tuple[int, ...]:
        """Of the boxes that one of its methods works in."""
        return tuple(sorted({d for method in self.methods.values() for d in method.dimensions}))

    @property
    def needs_contacts(self) -> bool:
        """Whether its methods heed a contact network; otherwise they resolve the pores alone."""
        return any(method.contacts for method in self.methods.values())

    def default_method(self, dimension: int, pores_conduct: bool) -> str:
        """The first method that works in a dimension and with pores that conduct or do not.

        Raises
        ------
        InputError
            If there is none.
        """
        for name, method in self.methods.items():
            if dimension in method.dimensions and method.pores in ((MAY, MUST) if pores_conduct else (NO, MAY)):
                return name
        if dimension not in self.dimensions:
            works = " and ".join(f"{d}D" for d in self.dimensions)
            raise InputError(f"engine {self.name} works in {works}, found a medium in {dimension}D")
        what = "pores that conduct" if pores_conduct else "pores that do not conduct"
        raise InputError(f"engine {self.name} has no method for {what} in {dimension}D: use another engine")

    def find_method(self, name: str) -> Method:
        """The method of a name.

        Raises
        ------
        InputError
            If there is none.
        """
        if name not in self.methods:
            raise InputError(f"engine {self.name} has no method {name!r}: expected one of {', '.join(self.methods)}")
        return self.methods[name]

    def resolve(self, method: str, options: Mapping[str, Any]) -> dict[str, Any]:
        """The options that a method heeds, checked, with the defaults of those that are not given.

        Raises
        ------
        InputError
            If an option is unknown, means nothing to the method or has a value that is not allowed.
        """
        heeded = self.find_method(method).options
        for name in options:
            if name not in heeded:
                known = f"it heeds {', '.join(heeded)}" if heeded else "it heeds none"
                raise InputError(f"option {name} has no effect with method {method} of engine {self.name}: {known}")
        return {name: self.options[name].checked(name, options.get(name)) for name in heeded}

    def check(self, medium: Medium, method: str) -> None:
        """Refuse a medium that a method cannot take.

        Raises
        ------
        InputError
        """
        row = self.find_method(method)
        if medium.dimension not in row.dimensions:
            works = " and ".join(f"{d}D" for d in row.dimensions)
            able = [name for name, other in self.methods.items() if medium.dimension in other.dimensions]
            cure = f"; its methods there are {', '.join(able)}" if able else ""
            raise InputError(
                f"method {method} of engine {self.name} works in {works}, found a medium in {medium.dimension}D{cure}"
            )
        if row.contacts and medium.network is None:
            raise InputError(f"engine {self.name} needs contacts: give the medium a contact network")
        if row.pores == NO and medium.pores.conduct:
            able = [name for name, other in self.methods.items() if other.pores != NO]
            cure = f"use {' or '.join(able)}" if able else "use another engine, or pores that do not conduct"
            raise InputError(f"method {method} of engine {self.name} does not model heat through the pores: {cure}")
        if not row.gas and not medium.pores.plain:
            able = [name for name, other in self.methods.items() if other.gas]
            cure = f"use {' or '.join(able)}" if able else "use another engine, or a continuum without radiation"
            raise InputError(
                f"method {method} of engine {self.name} models neither the temperature jumps of a rarefied gas nor "
                f"radiation: {cure}"
            )
        if medium.local is not None and not row.local:
            able = [name for name, other in self.methods.items() if other.local]
            cure = f"use {' or '.join(able)}" if able else "use another engine, or properties at one temperature"
            raise InputError(
                f"method {method} of engine {self.name} does not model properties at the local temperature: {cure}"
            )
        if row.pores == MUST and not medium.pores.conduct:
            raise InputError(f"method {method} of engine {self.name} is only valid with pores that conduct")

    def conduct(self, media: Sequence[Medium], conduction: Conduction, seed: int) -> list[Outcome]:
        """Outcome of every medium, in order; an error of one becomes its status.

        Parameters
        ----------
        media : sequence of Medium
            Variants on one packing: what they share is shared.
        conduction : Conduction
        seed : int
            Of everything that the engine draws, the same for all media.
        """
        return [
            outcome_of(medium, result)
            for medium, result in zip(media, self.results(media, conduction, seed), strict=True)
        ]

    def results(self, media: Sequence[Medium], conduction: Conduction, seed: int) -> list[Result]:
        """Conductivity or error of every medium, as in `conduct`."""
        found: list[Result | None] = [self._refusal(medium, conduction) for medium in media]
        solvable = [row for row, refusal in enumerate(found) if refusal is None]
        if solvable:
            task = Conduction(
                conduction.engine,
                conduction.method,
                self.resolve(conduction.method, conduction.options),
                conduction.tolerance,
                conduction.axes,
            )
            try:
                solved = self.solve([media[row] for row in solvable], task, seed)
            except EtcError as error:
                solved = [error] * len(solvable)
            for row, result in zip(solvable, solved, strict=True):
                found[row] = result
        return [result for result in found if result is not None]

    def _refusal(self, medium: Medium, conduction: Conduction) -> EtcError | None:
        try:
            self.check(medium, conduction.method)
            self.resolve(conduction.method, conduction.options)
        except EtcError as error:
            return error
        return None
