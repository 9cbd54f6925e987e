"""The options with which every command reads particles, and what it reports of the sample that they make."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from etc_engine.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from etc_engine.particle_files.sample import Range, Sample
    from etc_engine.particle_files.table import ParticleTable

OPTIONS = (
    click.option(
        "--box", help="Edge lengths (1,1) or faces (0:1,0:2), in the file's coordinates; replaces the file's."
    ),
    click.option("--periodic", help="Periodic axes: x, y, xy, ..., walls elsewhere; replaces the file's."),
    click.option(
        "--crop", help="Part to keep, low:high per axis, such as 0:1,0.2:0.8 or ,0:0.024; its faces are walls."
    ),
    click.option("--frame", type=int, help="Frame of a file with several, from 0; the last one by default."),
    click.option("--dimension", type=click.Choice(("2", "3")), help="2: disks, 3: spheres; where the file cannot say."),
    click.option("--radius-column", help="Name of the column of radii, where it is not radius or diameter."),
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
    from etc_engine.particle_files.formats import read_particles

    table = read_particles(path, sample=replace(words.sample(), unknown_periodic=unknown_periodic))
    for note in table.notes:
        click.echo(f"etc-engine: note: {note}", err=True)
    return table


def warn(message: str) -> None:
    """One line of warning."""
    click.echo(f"etc-engine: warning: {message}", err=True)


def warn_of_digits(table: ParticleTable, gap: float, *, bonded: bool) -> None:
    """Contacts that the printed digits of the file do not decide."""
    from etc_engine.particle_files.precision import doubtful_contacts

    doubt = doubtful_contacts(table, gap)
    if doubt is not None:
        warn(doubt.sentence(gap, bonded=bonded))


def warn_of_sample(table: ParticleTable, driven: Sequence[int], gap: float = 0.0) -> None:
    """Walls that the particles do not reach, and walls that go through them.

    Parameters
    ----------
    table : ParticleTable
    driven : sequence of int
        Axes along which walls drive the heat.
    gap : float
        Largest gap of a contact with a wall, in radii.
    """
    import numpy as np

    from etc_engine.box import AXES
    from etc_engine.structure.filling import find_filling, free_walls

    packing = table.packing
    filling = find_filling(packing)
    origin = table.origin or (0.0,) * packing.dimension
    low, high = packing.radii.min(), packing.radii.max()
    free = set(free_walls(packing, filling).tolist())
    for wall in range(2 * packing.dimension):
        axis, end = divmod(wall, 2)
        place = f"{AXES[axis]} = {origin[axis] + end * packing.box.lengths[axis]:g}"
        distance = filling.free[wall]
        if axis in driven and distance > gap * low and not np.isnan(distance):
            warn(
                f"nothing touches the driven wall {place}: the nearest surface is {distance:.3g} m away "
                f"({distance / high:.2g} of the largest radius), so the wall drives no heat; see --crop and --box"
            )
        elif wall in free:
            warn(
                f"the box is larger than the sample: between the wall {place} and the nearest particle "
                f"{distance:.3g} m are free, which count as sample; see --crop and --box"
            )
    deep = filling.deep_cuts
    made = np.array(table.cropped or (False,) * deep.size)
    if deep[~made].any():
        where = ", ".join(
            f"{AXES[k // 2]} = {origin[k // 2] + (k % 2) * packing.box.lengths[k // 2]:g} ({deep[k]})"
            for k in np.flatnonzero((deep > 0) & ~made)
        )
        warn(
            f"walls go through {deep[~made].sum()} particles by more than half a radius: {where}; the box may be "
            "wrapped around the centres (flag s): give the faces of the container with --box low:high,..."
        )
    if deep[made].any():
        warn(f"the crop cuts {deep[made].sum()} particles by more than half a radius: its walls touch their middle")


def warn_of_excess(tensor: ArrayLike, conductivity: ArrayLike) -> None:
    """A sample conducts no better than the best of its parts; where it does, the box or the contacts are wrong."""
    import numpy as np

    best, most = float(np.max(conductivity)), float(np.nanmax(np.diag(np.atleast_2d(tensor))))
    if most > best * (1.0 + 1e-9):
        warn(
            f"the conductivity {most:.6g} W/(m K) exceeds that of the best particle, {best:.6g}: walls or contacts go "
            "through particles, see --box and the contact rule"
        )
