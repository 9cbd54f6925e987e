"""The study file of a sweep: read from TOML and checked before anything runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from etc_engine.box import Box, ball_radius, parse_periodic
from etc_engine.engines.voxel.voxelization import check_memory, coarsest_resolution
from etc_engine.errors import InputError, StudyError
from etc_engine.medium.rules import RULES
from etc_engine.packing import PackingSpec
from etc_engine.particle_files.collection import PackingSource
from etc_engine.realization import ENGINES, Conduction, RealizationSpec
from etc_engine.study.conditions import check_conditions
from etc_engine.study.files import A_SEED, SCHEMA, Seed, StudyFile, parse_toml, read_text, validated
from etc_engine.study.meaning import MEANING, OPTIONS, drop_meaningless, meaningless, refuse_meaningless
from etc_engine.study.model_inputs import check_models
from etc_engine.study.quantities import QUANTITIES, value_of
from etc_engine.study.tables import (
    ConductionTable,
    ContactsTable,
    ModelsTable,
    PackingTable,
    ParticlesTable,
    PoresTable,
    RadiationTable,
    StatisticsTable,
    distribution,
)

NEARLY = 0.9
"""Part of the resolution needed below which a study is refused; packers may scale given radii a little."""

DRAWN = ("uniform", "gaussian", "lognormal")
"""Distributions whose smallest radius depends on what is drawn."""


class Study(StudyFile):
    """A sweep: every list of physical values, and of methods, is a dimension; realizations are the last one."""

    WITHOUT_EFFECT: ClassVar[tuple[str, ...]] = ("name", "models")

    seed: Seed = Field(description=A_SEED)
    packing: PackingTable = Field(description="a table")
    particles: ParticlesTable = Field(default_factory=ParticlesTable, description="a table")
    contacts: ContactsTable = Field(default_factory=ContactsTable, description="a table")
    pores: PoresTable = Field(default_factory=PoresTable, description="a table")
    radiation: RadiationTable = Field(default_factory=RadiationTable, description="a table")
    conduction: ConductionTable = Field(default_factory=ConductionTable, description="a table")
    statistics: StatisticsTable = Field(description="a table")
    models: ModelsTable = Field(default_factory=ModelsTable, description="a table")

    @model_validator(mode="after")
    def _check(self) -> Study:
        dimension, engine = len(self.packing.box), ENGINES[self.conduction.engine]
        for method in self.methods:
            row = engine.methods[method]
            if dimension not in row.dimensions:
                works = " and ".join(f"{d}D" for d in row.dimensions)
                raise ValueError(
                    f"packing.box: method {method!r} of engine {engine.name!r} works in {works}, found "
                    f"{list(self.packing.box)}"
                )
            self._check_pores(method)
        if dimension not in RULES[self.contacts.rule].dimensions:
            raise ValueError(f"contacts.rule: {self.contacts.rule!r} does not work in {dimension}D (packing.box)")
        refuse_meaningless(self)
        if self.conduction.distributed and not hasattr(self.packing, "sources"):
            raise ValueError(
                "conduction.distributed: works only on packings in files (packing.files), which the ranks read in parts"
            )
        check_conditions(self)
        check_models(self)
        if not engine.needs_contacts:
            self._check_cell()
        densest = max((density for density in self.densities if density is not None), default=0.0)
        rule = self.contacts.rule
        if engine.needs_contacts and not RULES[rule].radii_may_grow and densest >= 1.0:
            raise ValueError(
                f"packing.density: found {densest}, allowed below 1 with rule = {rule!r}: its particles do not overlap"
            )
        return self

    def _check_pores(self, method: str) -> None:
        """Refuse pores that conduct with a method that leaves their heat out, and the reverse."""
        row, (some, every) = ENGINES[self.conduction.engine].methods[method], self.pores_conduct
        which = f"method {method!r} of engine {self.conduction.engine!r}"
        if row.pores == "no" and some:
            values = self.values("pore_conductivity")
            if self.pores.gas is None and max(values) > 0.0:
                raise ValueError(
                    f"pores.conductivity: found {max(values):g}, {which} does not model heat through them: allowed is 0"
                )
            key = "radiation.emissivity" if self.pores.gas is None else "pores.gas"
            raise ValueError(f"{key}: {which} does not model heat through the pores: remove it")
        if row.pores == "must" and not every:
            key = "pore_conductivity" if self.pores.gas is None else "pressure"
            raise ValueError(
                f"{QUANTITIES[key].place}: found {min(self.values(key)):g}, {which} is only valid with pores that "
                "conduct"
            )
        if self.pores_rarefied and not row.gas:
            raise ValueError(
                f"conduction.method: {which} models neither a rarefied gas nor radiation: with it leave out "
                "radiation.emissivity, pores.accommodation and, beside a gas, particles.material"
            )

    def _check_cell(self) -> None:
        """The box and the grid of an engine that solves the whole cell."""
        word = self.conduction.engine
        if self.packing.periodic and len(self.packing.periodic) < len(self.packing.box):
            raise ValueError(
                f"packing.periodic: found {self.packing.periodic!r}, engine = {word!r} takes a box with walls all "
                "around or with none"
            )
        if word != "voxel":
            return
        try:
            check_memory(self.packing.box, self.conduction.resolution)
        except InputError as error:
            raise ValueError(f"conduction.resolution: {error}") from None
        radius = self._smallest_radius()
        if radius is None:
            return
        needed = coarsest_resolution(self.packing.box, radius)
        if self.conduction.resolution < NEARLY * needed:
            raise ValueError(
                f"conduction.resolution: found {self.conduction.resolution}, too coarse for the smallest particle, of "
                f"diameter {2.0 * radius:.6g}: allowed is at least {needed}"
            )

    def _smallest_radius(self) -> float | None:
        """Least radius of the sweep where it does not depend on what is drawn, or None."""
        packing = self.packing
        radii = distribution(packing.radii)
        if packing.count is None or self.densities == (None,):
            return None if radii.scalable or radii.kind in DRAWN else radii.smallest
        if radii.kind != "equal":
            return None
        dimension = len(packing.box)
        measure = min(d for d in self.densities if d is not None) * float(np.prod(packing.box)) / packing.count
        return float(ball_radius(measure, dimension))

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods as a list, one or many."""
        method = self.conduction.method
        if method is None:
            engine = ENGINES[self.conduction.engine]
            try:
                return (engine.default_method(len(self.packing.box), self.pores_conduct[0]),)
            except InputError:  # none fits: the checks say what is wrong with the first
                return (next(iter(engine.methods)),)
        return (method,) if isinstance(method, str) else method

    @property
    def pores_conduct(self) -> tuple[bool, bool]:
        """Whether heat goes through the pores: with some of the values, with all of them."""
        glow = self.values("emissivity") or (0.0,)
        held = self.values("pore_conductivity" if self.pores.gas is None else "pressure") or (0.0,)
        return max(glow) > 0.0 or max(held) > 0.0, min(glow) > 0.0 or min(held) > 0.0

    @property
    def pores_rarefied(self) -> bool:
        """Whether surfaces radiate, or the gas has temperature jumps."""
        jumps = self.pores.accommodation is not None or self.particles.material is not None
        return max(self.values("emissivity"), default=0.0) > 0.0 or (self.pores.gas is not None and jumps)

    def values(self, name: str) -> tuple[float, ...]:
        """Values of a quantity, one or several; none where the study does not give any."""
        found = value_of(self, QUANTITIES[name])
        return () if found is None else found if isinstance(found, tuple) else (found,)

    @property
    def densities(self) -> tuple[float | None, ...]:
        """The densities of the sweep; None alone stands for the packer's own."""
        return self.values("density") or (None,)

    @property
    def quantities(self) -> dict[str, tuple[float, ...]]:
        """Values of what has a meaning on a packing, in the order of the dimensions; one, or several."""
        without = {place for place, _ in meaningless(self)}
        rows = {name: row for name, row in QUANTITIES.items() if row.changes != "packing" and row.place not in without}
        return {name: found for name in rows if (found := self.values(name))}

    @property
    def axes(self) -> dict[str, tuple[float, ...]]:
        """What is varied on each packing: the quantities with a list, in the order of the dimensions."""
        return {
            name: values
            for name, values in self.quantities.items()
            if isinstance(value_of(self, QUANTITIES[name]), tuple)
        }

    @property
    def shape(self) -> tuple[int, ...]:
        """Cells of a packing: along each axis, and methods."""
        return (*(len(values) for values in self.axes.values()), len(self.methods))

    @property
    def box(self) -> Box:
        """The box of every packing."""
        lengths = self.packing.box
        return Box(lengths, parse_periodic(self.packing.periodic, len(lengths)))

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, as plain JSON values, less what has no meaning in it.

        It is a study again, the same one.
        """
        values = super().resolved()
        values["conduction"]["method"] = self.conduction.method or self.methods[0]
        if not self.conduction.distributed:  # studies from before this key stay the same ones
            values["conduction"].pop("distributed", None)
        return drop_meaningless(self, values)

    def realization_spec(self, density: float | None) -> RealizationSpec:
        """The specification of one realization at a density of this study (None: the packer's own)."""
        rows = QUANTITIES
        si = {name: tuple(value * rows[name].si for value in values) for name, values in self.quantities.items()}
        return RealizationSpec(
            packing=self._packing_spec(density),
            rule=self.contacts.rule,
            conduction=tuple(self._conduction(method) for method in self.methods),
            values={name: values[0] for name, values in si.items() if name not in self.axes},
            axes={name: values for name, values in si.items() if name in self.axes},
            material=self.particles.material,
            gas=self.pores.gas,
            nonlinear=self.conduction.nonlinear,
        )

    def _packing_spec(self, density: float | None) -> PackingSpec | PackingSource:
        """What makes the packing of a realization."""
        growth = RULES[self.contacts.rule].radii_may_grow and ENGINES[self.conduction.engine].needs_contacts
        return self.packing.spec(density, radius_growth=growth)

    def for_realization(self, spec: RealizationSpec, realization: int) -> RealizationSpec:  # noqa: ARG002
        """The specification of one of the realizations; packings that are made differ in their random stream alone."""
        return spec

    def remarks(self) -> tuple[str, ...]:
        """What the user should know before the sweep runs."""
        return ()

    def realization_coordinates(self) -> dict[str, tuple[list[Any], str]]:
        """Coordinates along the realizations, with their meaning."""
        return {}

    def _conduction(self, method: str) -> Conduction:
        """How one of the methods conducts, with the options that it heeds."""
        table, heeded = self.conduction, ENGINES[self.conduction.engine].methods[method].options
        options = {name: getattr(table, name) for name in OPTIONS if name in heeded}
        return Conduction(table.engine, method, options, table.tolerance)


def read_study(path: Path) -> tuple[Study, str]:
    """The study in a file, and its text.

    Raises
    ------
    StudyError
        If the file is missing, is not TOML, has unknown keys or values that are not allowed; the message is
        one line that names the file, the key, what was found and what is allowed.
    """
    text = read_text(path)
    content = parse_toml(text, str(path))
    return study_of(content, str(path), path.parent), text


def parse_study(text: str, source: str = "study") -> Study:
    """The study in a text; ``source`` names it in errors.

    Examples
    --------
    >>> parse_study("schema = 2", "s.toml")
    Traceback (most recent call last):
    etc_engine.errors.StudyError: s.toml: name: missing, expected a name ... (and 3 more problems)
    """
    return study_of(parse_toml(text, source), source)


def study_of(content: Mapping[str, Any], source: str = "study", folder: Path | None = None) -> Study:
    """The study of a file's content: one that makes its packings, or one that finds them in files.

    Parameters
    ----------
    content : mapping
    source : str
        It names the file in errors.
    folder : Path, optional
        Of the study file; without one, files of packings must have been found before.

    Raises
    ------
    StudyError
    """
    from etc_engine.study.file_packings import FileStudy, find_packings, reads_files

    if not reads_files(content):
        return validated(content, Study, source)
    if folder is None and "sources" not in content["packing"]:
        raise StudyError(f"{source}: packing.files: packings in files are read by the command sweep, beside the files")
    return validated(find_packings(content, folder or Path(), source), FileStudy, source)


def study_schema() -> dict[str, Any]:
    """The JSON schema of a study file, with an example.

    Two words are added to the standard. ``x-with`` lists the words of a choice with which a key is valid. ``x-words``
    lists the words of a key that depend on another choice.

    Examples
    --------
    >>> keys = study_schema()["$defs"]["ContactsTable"]["properties"]
    >>> keys["coordination"]["x-with"]["contacts.rule"]
    ['coordination', 'load']
    """
    found = Study.model_json_schema()
    tables = {key: node["$ref"].rpartition("/")[2] for key, node in found["properties"].items() if "$ref" in node}
    for place, needs in MEANING.items():
        table, key = place.split(".")
        property_ = found["$defs"][tables[table]]["properties"][key]
        property_["x-with"] = {choice: list(words) for choice, words in needs.items()}
    methods = {word: list(engine.methods) for word, engine in ENGINES.items()}
    found["$defs"][tables["conduction"]]["properties"]["method"]["x-words"] = {"conduction.engine": methods}
    found["examples"] = [EXAMPLE]
    return found


EXAMPLE = {
    "schema": SCHEMA,
    "name": "example",
    "seed": 20261,
    "packing": {"radii": "uniform:0.01:0.02", "box": [1.0, 1.0], "density": [0.64, 0.70, 0.76]},
    "contacts": {"rule": "bonded", "contact_angle": [5.0, 10.0]},
    "statistics": {"realizations": 20},
    "models": {"names": ["hashin_shtrikman_upper", "effective_medium", "contact_mean_field"]},
}
"""A study that is ready to run."""
