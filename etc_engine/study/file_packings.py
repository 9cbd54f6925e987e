"""Sweeps over packings in files: ``[packing] files``, each file or frame a realization."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field, model_validator

from etc_engine.arrays import Floats
from etc_engine.box import AXES, Box
from etc_engine.errors import EtcError, InputError, StudyError
from etc_engine.materials import find_solid
from etc_engine.medium.rules import RULES
from etc_engine.medium.sample_warnings import box_warnings, digit_warnings
from etc_engine.particle_files.collection import PackingSource, find_sources
from etc_engine.particle_files.parts import read_extremes
from etc_engine.particle_files.sample import Range, Sample, sample_box
from etc_engine.realization import RealizationSpec
from etc_engine.study.quantities import QUANTITIES
from etc_engine.study.schema import Positive, StudyTable, Word
from etc_engine.study.sweep import Study
from etc_engine.study.tables import ParticlesTable

FrameNumber = Annotated[int, Field(strict=True)]
Lengths = Annotated[tuple[Positive, ...], Field(min_length=2, max_length=3)]
Number = Annotated[float, Field(allow_inf_nan=False)]


class SourceTable(StudyTable):
    """One packing: a file, a frame of it, and the SHA-256 of the file."""

    file: Word = Field(description="a file")
    frame: FrameNumber = Field(description="a frame, from 0")
    sha256: Word = Field(description="of the file's bytes")


class FilesTable(StudyTable):
    """``[packing]`` of packings in files. What stands below ``sources`` is found when the study is read."""

    files: Word = Field(description="a pattern such as 'beds/*.dump', relative to the study file")
    frames: Literal["last", "all"] | FrameNumber | tuple[FrameNumber, ...] = Field(
        default="last", description="'last', 'all', the number of a frame from 0, or a list of such"
    )
    crop: tuple[str, ...] | None = Field(
        default=None, description="ranges low:high of each axis to keep, '' for all, such as ['', '0:0.024']"
    )
    file_box: Lengths | None = Field(default=None, description="edge lengths of the files' box, where they have none")
    file_periodic: str | None = Field(default=None, description="periodic axes of the files, where they do not say")
    dimension: Literal[2, 3] | None = Field(default=None, description="2 or 3, where the files cannot say")
    radius_column: Word | None = Field(default=None, description="the name of the column of radii")
    sources: tuple[SourceTable, ...] = Field(min_length=1, description="the packings, found when the study is read")
    box: Lengths = Field(description="edge lengths of the first packing")
    periodic: str = Field(default="", description="periodic axes of the packings")
    column: str = Field(default="", description="'conductivity' where the files have such a column")
    folder: str = Field(default="", description="where the study file was")

    @property
    def density(self) -> None:
        """Packings in files have the densities that they have."""
        return

    @property
    def method(self) -> str:
        """What takes the place of a packer."""
        return "files"

    def sample(self) -> Sample:
        """What part of each file is a packing.

        Raises
        ------
        InputError
        """
        return sample_of(self.model_dump())

    def source(self, realization: int) -> PackingSource:
        """The packing of a realization."""
        found = self.sources[realization]
        return PackingSource(Path(self.folder) / found.file, found.file, found.frame, found.sha256, self.sample())


class FileParticlesTable(ParticlesTable):
    """``[particles]`` of packings in files: their types may say what they are made of."""

    types: dict[str, Positive | Word] | None = Field(
        default=None, description="a table such as { 1 = 'Li4SiO4', 2 = 1.1 }: a conductivity or a material by type"
    )


class FileStudy(Study):
    """A sweep over packings in files."""

    KIND: ClassVar[str] = "files"

    packing: FilesTable = Field(description="a table")  # type: ignore[assignment]
    particles: FileParticlesTable = Field(default_factory=FileParticlesTable, description="a table")

    @model_validator(mode="after")
    def _check_files(self) -> FileStudy:
        count = len(self.packing.sources)
        if self.statistics.relative_ci is not None:
            raise ValueError("statistics.relative_ci: the number of packings in files is fixed: remove it")
        if self.statistics.realizations > count:
            raise ValueError(
                f"statistics.realizations: found {self.statistics.realizations}, the files hold {count} packings"
            )
        if self.conduction.distributed:
            self._check_distributed()
        if self.by_particle:
            given = self.particles.model_fields_set & {"conductivity", "material"}
            given -= {"material"} if self.particles.material is None else set()  # so it stands in a resolved study
            if given or (self.particles.types and self.packing.column):
                what = sorted(given)[0] if given else "types"
                own = "their types" if self.particles.types and given else "a column 'conductivity'"
                raise ValueError(f"particles.{what}: has no effect where the particles have {own}; remove one of them")
        for word in (self.particles.types or {}).values():
            if isinstance(word, str):
                try:
                    find_solid(word)
                except InputError as error:
                    raise ValueError(f"particles.types: {error}") from None
                if not self.values("temperature"):
                    raise ValueError(f"particles.types: {word!r} needs conduction.temperature: it depends on it")
        return self

    def _check_distributed(self) -> None:
        """Refuse what ranks that solve each packing together do not take."""
        if set(self.methods) != {"chord"}:
            other = next(method for method in self.methods if method != "chord")
            raise ValueError(f"conduction.distributed: works with method 'chord' only, found {other!r}")
        if not RULES[self.contacts.rule].local:
            able = ", ".join(repr(name) for name, rule in RULES.items() if rule.local)
            raise ValueError(
                f"contacts.rule: found {self.contacts.rule!r}, allowed with conduction.distributed: {able}"
            )
        if self.packing.crop is not None:
            raise ValueError("packing.crop: is not taken with conduction.distributed, write the part to a file")
        if self.particles.types is not None:
            raise ValueError("particles.types: is not taken with conduction.distributed, write a column 'conductivity'")
        allowed = {"particle_conductivity", "contact_angle", "bond_gap", "contact_radius", "contact_resistance"}
        for name, values in self.quantities.items():
            if name not in allowed and any(values):
                raise ValueError(f"{QUANTITIES[name].place}: is not taken with conduction.distributed")
        if self.particles.material is not None:
            raise ValueError("particles.material: is not taken with conduction.distributed, give the conductivity")

    @property
    def by_particle(self) -> bool:
        """Whether each particle has a conductivity of its own."""
        return bool(self.particles.types) or bool(self.packing.column)

    @property
    def quantities(self) -> dict[str, tuple[float, ...]]:
        """As in any sweep; without the conductivity of the particles where each has a separate one."""
        found = super().quantities
        if self.by_particle:
            found.pop("particle_conductivity", None)
        return found

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, and the packings that were found."""
        values = super().resolved()
        if self.by_particle:
            values["particles"].pop("conductivity", None)
        return values

    def identity(self) -> dict[str, Any]:
        """What decides the numbers of the result: the contents of the files, not where they are."""
        values = super().identity()
        values["packing"] = {key: value for key, value in values["packing"].items() if key != "folder"}
        return values

    def realization_spec(self, density: float | None) -> RealizationSpec:
        """The specification of the first packing; `for_realization` gives the others."""
        types = self.particles.types
        return replace(super().realization_spec(density), types=types)

    def _packing_spec(self, density: float | None) -> PackingSource:  # noqa: ARG002 - files have their own
        return self.packing.source(0)

    def for_realization(self, spec: RealizationSpec, realization: int) -> RealizationSpec:
        """The specification with the packing of a realization."""
        return replace(spec, packing=self.packing.source(realization))

    def remarks(self) -> tuple[str, ...]:
        """Digits that do not decide on contacts, bare walls and cut particles of the first packing."""
        source = self.packing.source(0)
        if self.conduction.distributed:  # no process reads a whole packing
            return ()
        table = source.read()
        bonded = RULES[self.contacts.rule].takes_gap
        gap = min(self.values("bond_gap"), default=0.0) if bonded else 0.0
        walls = [] if self.pores_conduct[0] else [k for k, flag in enumerate(table.packing.box.periodic) if not flag]
        found = [*table.notes, *digit_warnings(table, gap, bonded=bonded), *box_warnings(table, walls, gap)]
        return tuple(f"{source.name}: {sentence}" for sentence in found)

    def realization_coordinates(self) -> dict[str, tuple[list[Any], str]]:
        """The file and the frame of each realization."""
        chosen = self.packing.sources[: self.statistics.realizations]
        return {
            "file": ([source.file for source in chosen], "file of the packing"),
            "frame": ([source.frame for source in chosen], "frame of the file, from 0"),
        }


def reads_files(content: Mapping[str, Any]) -> bool:
    """Whether the packings of a study are in files."""
    packing = content.get("packing")
    return isinstance(packing, Mapping) and "files" in packing


def find_packings(content: Mapping[str, Any], folder: Path, place: str) -> dict[str, Any]:
    """The content of a study with the packings that its pattern finds.

    Parameters
    ----------
    content : mapping
        Of a study file; as it is where the packings stand in it already.
    folder : Path
        Of the study file.
    place : str
        For messages.

    Raises
    ------
    StudyError
        If the files are not there or not understood, or boxes differ in dimension or periodic axes.
    """
    packing = dict(content["packing"])
    if "sources" in packing:
        return dict(content)
    for name in ("box", "periodic"):
        if name in packing:
            packing[f"file_{name}"] = packing.pop(name)
    try:
        sources = find_sources(
            folder, _text(packing["files"]), _frames(packing.get("frames", "last")), sample_of(packing)
        )
        box, column = _first_packing(content, sources[0])
    except (EtcError, TypeError, ValueError) as error:
        raise StudyError(f"{place}: packing.files: {error}") from None
    packing |= {
        "sources": [{"file": one.name, "frame": one.frame, "sha256": one.digest} for one in sources],
        "box": list(box.lengths),
        "periodic": box.periodic_axes,
        "column": column,
        "folder": str(folder.resolve()),
    }
    statistics = dict(content.get("statistics", {}))
    statistics.setdefault("realizations", len(sources))
    return {**content, "packing": packing, "statistics": statistics}


def _first_packing(content: Mapping[str, Any], source: PackingSource) -> tuple[Box, str]:
    """The box of a packing, and the name of its column of conductivities; one for many ranks is not read whole."""
    conduction = content.get("conduction", {})
    if isinstance(conduction, Mapping) and conduction.get("distributed") is True:
        ends = read_extremes(source.path, source.chosen())
        bounds, periodic, _ = sample_box(ends, source.sample)
        return Box(tuple((bounds[:, 1] - bounds[:, 0]).tolist()), periodic), _column(ends.conductivity)
    table = source.read()
    return table.packing.box, _column(table.conductivity)


def _column(conductivity: Floats | None) -> str:
    return "" if conductivity is None else "conductivity"


def sample_of(packing: Mapping[str, Any]) -> Sample:
    """The part of each file that a table asks for.

    Raises
    ------
    InputError
    """
    box, crop = packing.get("file_box"), packing.get("crop")
    return Sample(
        box=None if box is None else tuple((-inf, float(length)) for length in box),
        periodic=packing.get("file_periodic"),
        crop=() if not crop else tuple(_range(word, AXES[k]) for k, word in enumerate(crop)),
        dimension=packing.get("dimension"),
        radius_column=packing.get("radius_column"),
    )


def _range(word: object, axis: str) -> Range:
    low, mark, high = str(word).partition(":")
    try:
        if bool(str(word).strip()) != bool(mark):
            raise ValueError(word)
        return float(low) if low.strip() else -inf, float(high) if high.strip() else inf
    except ValueError:
        raise InputError(f"crop takes ranges low:high such as '0:0.024', or '', found {word!r} along {axis}") from None


def _text(value: object) -> str:
    if not isinstance(value, str) or not value:
        raise InputError(f"files takes a pattern such as 'beds/*.dump', found {value!r}")
    return value


def _frames(value: Any) -> Any:
    if value in ("last", "all"):
        return value
    numbers = value if isinstance(value, (list, tuple)) else [value]
    if not numbers or any(isinstance(n, bool) or not isinstance(n, int) for n in numbers):
        raise InputError(f"frames takes 'last', 'all', or whole numbers from 0, found {value!r}")
    return list(numbers)
