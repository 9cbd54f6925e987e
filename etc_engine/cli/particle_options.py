"""The options with which every command reads particles, and its notes on the sample."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import wraps
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError

if TYPE_CHECKING:
    from etc_engine.particle_files.sample import Range, Sample
    from etc_engine.particle_files.table import ParticleTable

OPTIONS = (
    click.option(
        "--box", help="Edge lengths (1,1) or faces (0:1,0:2), in the coordinates of the file. Replaces its box."
    ),
    click.option("--periodic", help="Periodic axes: x, y, xy, ... Walls elsewhere. Replaces what the file says."),
    click.option(
        "--crop", help="Part to keep, low:high per axis, such as 0:1,0.2:0.8 or ,0:0.024. Its faces are walls."
    ),
    click.option("--frame", type=int, help="Frame of a file with several, from 0. By default the last."),
    click.option(
        "--dimension", type=click.Choice(("2", "3")), help="2 for disks, 3 for spheres, where the file does not say."
    ),
    click.option("--types", help="Conductivity of each type of particle of the file [W/(m K)], such as 1=2.4,2=16."),
    click.option("--radius-column", help="Name of the column of radii. By default radius or diameter."),
)


@dataclass(frozen=True)
class SampleWords:
    """The words of the options."""

    box: str | None = None
    periodic: str | None = None
    crop: str | None = None
    frame: int | None = None
    dimension: str | None = None
    radius_column: str | None = None
    types: str | None = None

    def sample(self) -> Sample:
        """What the words say.

        Raises
        ------
        InputError
        """
        from etc_engine.particle_files.sample import Sample

        return Sample(
            box=None if self.box is None else parse_faces(self.box),
            periodic=self.periodic,
            crop=() if self.crop is None else parse_crop(self.crop),
            dimension=None if self.dimension is None else int(self.dimension),
            frame=self.frame,
            radius_column=self.radius_column,
        )


def particle_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options, as one argument ``words``."""

    @wraps(command)
    def gathered(**given: Any) -> Any:
        own = {name: given.pop(name) for name in SampleWords.__dataclass_fields__}
        return command(words=SampleWords(**own), **given)

    for option in reversed(OPTIONS):
        gathered = option(gathered)
    return gathered


def parse_faces(word: str) -> tuple[Range, ...]:
    """Faces of a box from ``1,1`` (edge lengths) or ``0:1,-1:1``.

    Examples
    --------
    >>> parse_faces("2,-1:1")
    ((-inf, 2.0), (-1.0, 1.0))
    """
    faces = []
    for part in word.split(","):
        low, mark, high = part.rpartition(":")
        try:
            faces.append((float(low) if mark else -inf, float(high)))
        except ValueError:
            raise InputError(
                f"--box takes edge lengths such as 1,1, or faces such as 0:1,0:2, separated by commas: found {word!r}"
            ) from None
    if len(faces) not in (2, 3):
        raise InputError(f"a box has 2 or 3 edge lengths, found {len(faces)} in --box {word}")
    return tuple(faces)


def parse_crop(word: str) -> tuple[Range, ...]:
    """Ranges of a crop; what is left out is kept.

    Examples
    --------
    >>> parse_crop(",0.5:,:0.024")
    ((-inf, inf), (0.5, inf), (-inf, 0.024))
    """
    ranges = []
    for part in word.split(","):
        low, mark, high = part.partition(":")
        try:
            if bool(part.strip()) != bool(mark):
                raise ValueError(part)
            ranges.append((float(low) if low.strip() else -inf, float(high) if high.strip() else inf))
        except ValueError:
            raise InputError(
                f"--crop takes ranges low:high separated by commas, such as 0:1,0.2:0.8 or ,0:0.024: found {word!r}"
            ) from None
    return tuple(ranges)


def read_sample(path: Path, words: SampleWords, *, unknown_periodic: bool = False) -> ParticleTable:
    """Particles of a file of any format; what the reader decided is printed as notes.

    Raises
    ------
    InputError, GeometryError
    """
    from etc_engine.particle_files.formats import read_table

    table = read_table(path, sample=replace(words.sample(), unknown_periodic=unknown_periodic))
    for note in table.notes:
        click.echo(f"etc-engine: note: {note}", err=True)
    return table if words.types is None else _by_type(table, words.types, path)


def _by_type(table: ParticleTable, word: str, path: Path) -> ParticleTable:
    """The particles with the conductivities of their types."""
    from etc_engine.realization.media import own_conductivities

    if table.conductivity is not None:
        raise InputError(f"{path} has a conductivity column: leave --types out, or take the column out")
    types: dict[str, float | str] = {}
    for part in word.split(","):
        name, mark, value = part.partition("=")
        try:
            if not mark or name.strip() in types:
                raise ValueError(part)
            types[name.strip()] = float(value)
        except ValueError:
            raise InputError(f"--types takes TYPE=CONDUCTIVITY words such as 1=2.4,2=16, found {part!r}") from None
    return replace(table, conductivity=own_conductivities(table, types, {}))


def warn(messages: Iterable[str]) -> None:
    """A line of warning for each message."""
    for message in messages:
        click.echo(f"etc-engine: warning: {message}", err=True)
