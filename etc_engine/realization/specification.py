"""Everything that defines one realization but its random stream."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from etc_engine.medium.conduction import Conduction
from etc_engine.packing import PackingSpec
from etc_engine.particle_files.collection import PackingSource


@dataclass(frozen=True)
class RealizationSpec:
    """Specification of one realization: the packing, and every medium made of it and solved.

    Parameters
    ----------
    packing : PackingSpec or PackingSource
        What makes the packing, or the file that holds it.
    rule : str
        Contact rule, a word of `etc_engine.medium.rules.RULES`.
    conduction : tuple of Conduction
        One per method.
    values : mapping of str to float
        Physical values in SI units (angles in radians), by the names of `etc_engine.study.quantities.QUANTITIES`.
    axes : mapping of str to tuple of float
        Those of which there are several; each combination is a medium, the last axis running fastest.
    material : str or mapping, optional
        Solid of the particles by name, or as a table: its conductivity at ``temperature`` takes the place of a number.
    gas : str or mapping, optional
        What fills the pores, by name or mole fractions, see `etc_engine.materials.gas_state`.
    types : mapping of str to float or str, optional
        Of packings in files: conductivity [W/(m K)] or material by type of particle.
    nonlinear : bool
        Whether solid, gas and radiation follow the temperature from one wall to the other:
        ``temperature + temperature_difference/2`` at the low end, ``temperature - temperature_difference/2`` at the far
        end.
    """

    packing: PackingSpec | PackingSource
    rule: str = "overlap"
    conduction: tuple[Conduction, ...] = (Conduction(),)
    values: Mapping[str, float] = field(default_factory=dict)
    axes: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    material: str | Mapping[str, Any] | None = None
    gas: str | Mapping[str, float] | None = None
    types: Mapping[str, float | str] | None = None
    nonlinear: bool = False

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells of a realization: along each axis, and methods."""
        return (*(len(values) for values in self.axes.values()), len(self.conduction))

    def combinations(self) -> Iterator[dict[str, float]]:
        """The physical values of each medium."""
        for values in itertools.product(*self.axes.values()):
            yield {**self.values, **dict(zip(self.axes, values, strict=True))}
