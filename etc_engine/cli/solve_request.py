"""What ``etc-engine solve`` is asked for: the words of its options, and the medium and the solution they describe."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from etc_engine.cli.physics_options import PhysicsWords

if TYPE_CHECKING:
    from etc_engine.box import Box
    from etc_engine.medium.conductivity import EffectiveConductivity
    from etc_engine.medium.medium import Medium
    from etc_engine.medium.network import ContactNetwork
    from etc_engine.particle_files.table import ParticleTable
    from etc_engine.realization import Engine

BOND_GAP = 1e-6
ESTIMATED = 5_000
"""Up to so many particles the discretization error is estimated where a method can; it takes three times as long."""


@dataclass(frozen=True)
class SolveRequest:
    """The physics asked for, in the words of the options."""

    axis: str | None
    engine: str
    method: str | None
    pipe_resistance: str | None
    modes: int | None
    degree: int | None
    bounds: bool
    contact_angle: float | None
    bond_gap: float
    conductivity: float | None
    pore_conductivity: float
    contact_resistance: float
    physics: PhysicsWords

    def refuse_words(self, fields: bool = False) -> None:
        """Refuse spellings of earlier versions, and options that mean nothing together.

        Parameters
        ----------
        fields : bool
            Whether a field is to be written; it would be that of walls of 1 and 0, not of ``--wall-temperatures``.
        """
        from etc_engine.errors import InputError

        if self.method == "pipe" or self.pipe_resistance is not None:
            found = "--method pipe" if self.method == "pipe" else f"--pipe-resistance {self.pipe_resistance}"
            raise InputError(f"{found} is now --engine pipe --method {self.pipe_resistance or 'chord'}")
        if self.bond_gap != BOND_GAP and not self.takes_gap:
            if self.rule == "overlap":
                raise InputError(
                    "--bond-gap is only valid with --contact-angle, which is missing: overlaps have no gap"
                )
            raise InputError(f"--bond-gap has no effect with the contact rule {self.rule}: leave it out")
        if self.physics.temperature is not None and not 0.0 < self.physics.temperature < inf:
            raise InputError(f"--temperature is a positive number of kelvins, found {self.physics.temperature:g}")
        self.physics.refuse_two_resistances(self.contact_resistance)
        if fields and self.physics.walls is not None:
            raise InputError(
                "--wall-temperatures gives conductivities: no field at the local temperature is written; leave out -o, "
                "--plot and --vtk, or the wall temperatures"
            )

    @property
    def bonded(self) -> bool:
        """Whether contacts are bonds of a given width."""
        return self.contact_angle is not None or self.physics.contact_radius is not None

    @property
    def asks_for_contacts(self) -> bool:
        """Whether a width or a rule of contacts is given; without one there need not be any."""
        return self.bonded or self.physics.contact_rule is not None

    @property
    def rule(self) -> str:
        """The word of the contact rule."""
        return self.physics.rule_for(self.contact_angle)

    @property
    def takes_gap(self) -> bool:
        """Whether the contact rule joins particles across a gap that the user gives."""
        from etc_engine.medium.rules import find_rule

        return find_rule(self.rule).takes_gap and not self.closest

    @property
    def closest(self) -> bool:
        """Whether the contacts are the closest pairs, as many as give a coordination number."""
        return self.physics.coordination is not None

    def gap(self, network: ContactNetwork) -> float:
        """Largest gap of a contact in mean radii: the user's, that of the closest pairs, or 0."""
        from etc_engine.medium.sample_warnings import widest_gap

        if self.closest:
            return widest_gap(network)
        return self.bond_gap if self.takes_gap else 0.0

    def medium(self, table: ParticleTable, particles: Path, dumped: ContactNetwork | None) -> Medium:
        """The particles of a file with contacts, those of a contact dump if there is one, and materials."""
        from math import radians

        import numpy as np

        from etc_engine.errors import InputError
        from etc_engine.medium.medium import Medium

        if self.conductivity is not None and self.physics.material is not None:
            raise InputError("--material and --conductivity both say what the particles are: leave one of them out")
        if self.conductivity is not None and table.conductivity is not None:
            raise InputError(
                f"{particles} has a conductivity column (or --types gives one): leave --conductivity out, or "
                "take the column out"
            )
        if dumped is not None and (self.bonded or self.physics.contact_rule is not None):
            raise InputError("--contacts and --contact-angle or --rule say how wide contacts are: give one of them")
        solid = self.physics.solid() if self.conductivity is None else self.conductivity
        given = 1.0 if solid is None else solid
        kappa = np.asarray(given if table.conductivity is None else table.conductivity)
        half_angle = None if self.contact_angle is None else radians(self.contact_angle)
        network = dumped or self.physics.network(table.packing, half_angle, self.bond_gap)
        pores = self.physics.pores(table.packing, self.pore_conductivity)
        network = network.with_resistance(self.contact_resistance)
        network = self.physics.roughened(network, kappa, pores)
        return Medium(table.packing, kappa, network, pores)

    def solve(self, medium: Medium, engine: Engine, method: str, axes: tuple[int, ...]) -> EffectiveConductivity[Any]:
        """The conductivity along the axes."""
        from etc_engine.errors import InputError
        from etc_engine.realization import effective_conductivity

        if not engine.needs_contacts:
            raise InputError(
                f"engine {engine.name} resolves the pores: use etc-engine homogenize FILE --engine {engine.name} "
                "--matrix ... --inclusion ..."
            )
        given = {"modes": self.modes, "degree": self.degree, "bounds": self.bounds or None}
        options = {name: value for name, value in given.items() if value is not None}
        if "error_estimate" in engine.find_method(method).options and medium.packing.count <= ESTIMATED:
            options["error_estimate"] = True
        return effective_conductivity(medium, engine=engine.name, method=method, axes=axes, **options)

    def between_walls(self, medium: Medium, method: str, axes: tuple[int, ...]) -> dict[str, Any]:
        """Record of the conduction between two walls at the local temperature, if it is asked for."""
        from etc_engine.errors import InputError

        if self.physics.walls is None:
            return {}
        if method != "facets":
            raise InputError(f"--wall-temperatures need method facets (spheres, pores that conduct), found {method}")
        return self.physics.between_walls(medium, axes)


def load_axes(word: str | None, box: Box) -> tuple[int, ...]:
    """Axes of a word; without one x, and the other axes too that come at no price in a periodic box."""
    from etc_engine.box import AXES
    from etc_engine.errors import InputError

    if word == "all" or (word is None and all(box.periodic)):
        return tuple(range(box.dimension))
    word = "x" if word is None else word
    if word not in tuple(AXES[: box.dimension]):
        raise InputError(f"--axis is one of {', '.join(AXES[: box.dimension])} or all, found {word!r}")
    return (AXES.index(word),)
