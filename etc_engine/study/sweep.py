"""The study file: what a sweep is made of, read from TOML and checked before anything runs."""

from __future__ import annotations

import hashlib
import json
import tomllib
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, model_validator

from etc_engine.box import Box, parse_periodic
from etc_engine.engines.voxel.voxelization import check_memory, coarsest_resolution
from etc_engine.errors import InputError, StudyError
from etc_engine.packing import PackingSpec
from etc_engine.realization import ENGINES, CompositeSpec, ConductionSpec, ContactSpec, Mixture, RealizationSpec
from etc_engine.study.schema import StudyTable, Word, first_problem
from etc_engine.study.tables import (
    CompositeTable,
    ConductionTable,
    ContactsTable,
    ModelsTable,
    PackingTable,
    StatisticsTable,
    distribution,
)

NEARLY = 0.9
"""Part of the resolution needed below which a study is refused; packers may scale given radii a little."""

DRAWN = ("uniform", "gaussian", "lognormal")
"""Distributions whose smallest radius depends on what is drawn."""

HINTS = {"conduction.pipe_resistance": "engine = 'pipe' has method = 'chord' or 'uniform', the resistance of its pipes"}
"""What to say of keys that other commands have."""

LONGEST_NAME = 80


def _printable(name: str) -> str:
    """Names stand in tables and on terminals."""
    if not (1 <= len(name) <= LONGEST_NAME and name.isprintable()):
        shown = name if len(name) <= LONGEST_NAME else f"{name[:20]}... ({len(name)} characters)"
        raise ValueError(f"found {shown!r}, allowed: 1 to {LONGEST_NAME} printable characters")
    return name


def _no_truth(value: object) -> object:
    """``true`` equals 1 in Python, and is no number of a schema."""
    return str(value).lower() if isinstance(value, bool) else value


class Study(StudyTable):
    """A sweep: densities x contact angles (or contrasts) x methods x realizations of one kind of packing."""

    schema_: Annotated[Literal[1], BeforeValidator(_no_truth)] = Field(alias="schema", description="1")
    name: Annotated[Word, AfterValidator(_printable)] = Field(description="a name of 1 to 80 printable characters")
    seed: Annotated[int, Field(strict=True, ge=0, lt=2**63)] = Field(description="a whole number from 0 to 2**63 - 1")
    packing: PackingTable = Field(description="a table")
    contacts: ContactsTable = Field(default_factory=ContactsTable, description="a table")
    conduction: ConductionTable = Field(default_factory=ConductionTable, description="a table")
    composite: CompositeTable | None = Field(default=None, description="a table")
    statistics: StatisticsTable = Field(description="a table")
    models: ModelsTable = Field(default_factory=ModelsTable, description="a table")

    @model_validator(mode="after")
    def _check(self) -> Study:
        word, engine = self.conduction.engine, ENGINES[self.conduction.engine]
        if len(self.packing.box) not in engine.dimensions:
            works = " or ".join(f"{dimension}D" for dimension in engine.dimensions)
            raise ValueError(f"packing.box: engine {word!r} works in {works}, found {list(self.packing.box)}")
        if not engine.needs_contacts:
            self._check_composite()
        elif self.composite is not None:
            raise ValueError(f"composite: has no meaning with engine = {word!r}, which conducts through contacts alone")
        if self.contacts.rule == "bonded" and max(self.packing.density or (0.0,)) >= 1.0:
            raise ValueError(
                f"packing.density: found {max(self.packing.density or ())}, allowed below 1 "
                "with rule = 'bonded', whose disks do not overlap"
            )
        return self

    def _check_composite(self) -> None:
        """A matrix, walls or no walls, and nothing that is about contacts."""
        word, composite = self.conduction.engine, self.composite
        if composite is None:
            raise ValueError(f"composite: missing, engine = {word!r} needs a table with matrix_conductivity")
        if self.contacts != ContactsTable():
            raise ValueError(f"contacts: has no meaning with engine = {word!r}, which solves the whole medium")
        if self.conduction.contact_resistance != 0.0:
            raise ValueError(f"conduction.contact_resistance: has no meaning with engine = {word!r}")
        if composite.contrast is not None and "conductivity" in self.conduction.model_fields_set:
            raise ValueError("conduction.conductivity: composite.contrast gives that of the particles, take one out")
        if composite.contrast is not None and self.conduction.mixture is not None:
            raise ValueError("conduction.mixture: has no meaning with composite.contrast, take one out")
        if self.packing.periodic and len(self.packing.periodic) < len(self.packing.box):
            raise ValueError(
                f"packing.periodic: found {self.packing.periodic!r}, engine = {word!r} takes a box with walls all "
                "around or with none"
            )
        self._check_grid(composite)
        if "pore_conductivity" in self.models.model_fields_set:
            raise ValueError("models.pore_conductivity: composite.matrix_conductivity says it, take it out")

    def _check_grid(self, composite: CompositeTable) -> None:
        """The grid goes with its engine, and with the particles where their size is known beforehand."""
        word = self.conduction.engine
        foreign = "nodes" if word == "voxel" else "resolution"
        if foreign in composite.model_fields_set:
            raise ValueError(f"composite.{foreign}: has no meaning with engine = {word!r}, take it out")
        if word != "voxel":
            return
        try:
            check_memory(self.packing.box, composite.resolution)
        except InputError as error:
            raise ValueError(f"composite.resolution: {error}") from None
        radius = self._smallest_radius()
        if radius is None:
            return
        needed = coarsest_resolution(self.packing.box, radius)
        if composite.resolution < NEARLY * needed:
            raise ValueError(
                f"composite.resolution: found {composite.resolution}, too coarse for the smallest particle, of "
                f"diameter {2.0 * radius:.6g}: allowed is at least {needed}"
            )

    def _smallest_radius(self) -> float | None:
        """Least radius of the sweep where it does not depend on what is drawn, or None."""
        packing = self.packing
        radii = distribution(packing.radii)
        if packing.count is None or packing.density is None:
            return None if radii.scalable or radii.kind in DRAWN else radii.smallest
        if radii.kind != "equal":
            return None
        dimension = len(packing.box)
        measure = min(packing.density) * float(np.prod(packing.box)) / packing.count
        return float((measure / (np.pi if dimension == 2 else 4.0 / 3.0 * np.pi)) ** (1.0 / dimension))

    @property
    def variants(self) -> tuple[str, tuple[float, ...] | None]:
        """The second axis of the sweep: its name, and its values (None: there is one cell, and no axis)."""
        if self.composite is None:
            return "contact_angle", self.contacts.contact_angle
        return "contrast", self.composite.contrast

    @property
    def densities(self) -> tuple[float | None, ...]:
        """The densities of the sweep; None alone stands for the packer's own."""
        return self.packing.density or (None,)

    @property
    def box(self) -> Box:
        """The box of every packing."""
        lengths = self.packing.box
        return Box(lengths, parse_periodic(self.packing.periodic, len(lengths)))

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, as plain JSON values, less what has no meaning in it.

        It is a study again, the same one.
        """
        values = self.model_dump(mode="json", by_alias=True)
        if self.composite is not None:
            del values["contacts"]
            del values["models"]["pore_conductivity"]
            del values["composite"]["nodes" if self.conduction.engine == "voxel" else "resolution"]
            if self.composite.contrast is not None:
                del values["conduction"]["conductivity"]
        return values

    def identity(self) -> dict[str, Any]:
        """What decides the numbers of the result: everything but the name and the models."""
        resolved = self.resolved()
        if self.composite is None:
            del resolved["composite"]
        return {key: value for key, value in resolved.items() if key not in ("name", "models")}

    def digest(self) -> str:
        """SHA-256 of the identity: two studies with the same digest give the same bits."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()

    def realization_spec(self, density: float | None) -> RealizationSpec:
        """The specification of one realization at a density of this study (None: the packer's own)."""
        packing, contacts, conduction = self.packing, self.contacts, self.conduction
        mixture = conduction.mixture
        return RealizationSpec(
            packing=PackingSpec(
                method=packing.method,
                radii=distribution(packing.radii),
                box=self.box,
                count=packing.count,
                density=density,
                growth_rate=packing.growth_rate,
                radius_growth=contacts.rule == "overlap" and self.composite is None,
            ),
            contacts=ContactSpec(
                rule=contacts.rule,
                contact_angles=tuple(float(np.deg2rad(angle)) for angle in contacts.contact_angle or ()),
                bond_gap=contacts.bond_gap,
                coordination=contacts.coordination,
            ),
            conduction=ConductionSpec(
                engine=conduction.engine,
                methods=conduction.methods,
                conductivity=conduction.conductivity,
                contact_resistance=conduction.contact_resistance,
                mixture=None if mixture is None else Mixture(mixture.conductivity, mixture.fraction),
                tolerance=conduction.tolerance,
                angle_curve=conduction.angle_curve,
            ),
            composite=self._composite_spec(),
        )

    def _composite_spec(self) -> CompositeSpec | None:
        table = self.composite
        if table is None:
            return None
        return CompositeSpec(table.matrix_conductivity, table.contrast or (), table.resolution, table.nodes)


def read_study(path: Path) -> tuple[Study, str]:
    """Read and check a study file; answers the study and its text.

    Raises
    ------
    StudyError
        If the file is missing, is not TOML, has unknown keys or values that are not allowed; the message is
        one line that names the file, the key, what was found and what is allowed.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"study {path}: cannot be read ({error.strerror}), expected a TOML file") from None
    except UnicodeDecodeError:
        raise StudyError(f"study {path}: is not text in UTF-8, expected a TOML file") from None
    return parse_study(text, str(path)), text


def parse_study(text: str, source: str = "study") -> Study:
    """Check the text of a study file; ``source`` names it in errors.

    Examples
    --------
    >>> parse_study("[packing", "s.toml")
    Traceback (most recent call last):
    etc_engine.errors.StudyError: s.toml: is not valid TOML: ...
    """
    try:
        values = tomllib.loads(text)
    except RecursionError:
        raise StudyError(f"{source}: is not valid TOML: it is nested too deeply") from None
    except ValueError as error:  # beside its own errors: numbers of 5000 digits
        raise StudyError(f"{source}: is not valid TOML: {error}") from None
    try:
        return Study.model_validate(values)
    except ValidationError as error:
        raise StudyError(f"{source}: {first_problem(error, Study, HINTS)}") from None
