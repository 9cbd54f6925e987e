"""Columns of particle files: which name means what, and the numbers of the wanted ones from lines of text."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from etc_engine.arrays import Floats, Ints
from etc_engine.box import AXES
from etc_engine.errors import InputError
from etc_engine.particle_files.digits import Digits, printed_digits

RADIUS = ("radius", "r", "rad")
DIAMETER = ("diameter", "diam")
TYPES = ("type", "element", "species", "material", "matid")
TEMPERATURES = ("temperature", "f_temp", "f_temp[0]", "c_temp", "temp")
SHAPES = ("shapex", "shapey", "shapez", "blockiness1", "blockiness2", "n1", "n2", "c_shape[1]", "c_shape[2]")
POSITIONS = ("", "u", "s", "su")
"""Endings of a position: as it is, unwrapped, scaled by the box, both."""
Line = TypeVar("Line")
BATCH = 1 << 14
SAMPLED = 2000
"""Rows from which the printed digits are found."""


@dataclass(frozen=True)
class Layout:
    """Where the wanted columns stand among all of a file.

    Parameters
    ----------
    width : int
        Number of columns.
    positions : tuple of int
        Columns of x, y and, where there is one, z.
    scaled : tuple of bool
        Whether each position is a fraction of the box.
    radius : int
    halved : bool
        Whether the radius column holds diameters.
    others : dict of str to int
        Columns of ``ids``, ``types``, ``conductivity`` and ``temperature``, where there are.
    """

    width: int
    positions: tuple[int, ...]
    scaled: tuple[bool, ...]
    radius: int
    halved: bool
    others: dict[str, int] = field(default_factory=dict)


def find_layout(place: str, names: Sequence[str], radius_column: str | None = None) -> Layout:
    """Wanted columns by their names; case does not matter.

    Parameters
    ----------
    place : str
        For messages.
    names : sequence of str
    radius_column : str, optional
        Name of the column of radii (of diameters, if it says ``diam``); ``radius`` or ``diameter`` by default.

    Raises
    ------
    InputError
        If a position or the radius is missing, or particles are no spheres.

    Examples
    --------
    >>> layout = find_layout("a.dump", ["id", "xs", "ys", "Diameter"])
    >>> layout.positions, layout.scaled, layout.radius, layout.halved, layout.others
    ((1, 2), (True, True), 3, True, {'ids': 0})
    """
    lowered = _lowered(names)
    shapes = [name for name in SHAPES if name in lowered]
    if len(shapes) > 1:
        raise InputError(
            f"{place} holds superquadrics or ellipsoids (columns {', '.join(shapes)}): only spheres are understood"
        )
    positions, scaled = [], []
    for axis in AXES:
        ending = next((ending for ending in POSITIONS if axis + ending in lowered), None)
        if ending is None:
            if axis == "z":
                continue
            raise InputError(
                f"{place} has no column of {axis} positions ({axis}, {axis}u, {axis}s); found {', '.join(names)}"
            )
        positions.append(lowered.index(axis + ending))
        scaled.append("s" in ending)
    radius, halved = _radius(place, names, lowered, radius_column)
    others = {}
    wanted = {"ids": ("id",), "types": TYPES, "conductivity": ("conductivity",), "temperature": TEMPERATURES}
    for key, spellings in wanted.items():
        found = next((name for name in spellings if name in lowered), None)
        if found is not None:
            others[key] = lowered.index(found)
    return Layout(len(names), tuple(positions), tuple(scaled), radius, halved, others)


def _lowered(names: Sequence[str]) -> list[str]:
    """Names in small letters; the points of ParaView's tables under their usual names."""
    lowered = [name.strip().strip('"').lower() for name in names]
    points = {f"points{mark}{axis}": AXES[axis] for mark in ":_" for axis in range(3)}
    return [points.get(name, name) for name in lowered]


def _radius(place: str, names: Sequence[str], lowered: list[str], wanted: str | None) -> tuple[int, bool]:
    if wanted is not None:
        if wanted.strip().lower() not in lowered:
            raise InputError(f"{place} has no column {wanted!r}; found {', '.join(names)}")
        return lowered.index(wanted.strip().lower()), "diam" in wanted.lower()
    for name in (*RADIUS, *DIAMETER):
        if name in lowered:
            return lowered.index(name), name in DIAMETER
    raise InputError(
        f"{place} has neither a radius nor a diameter column; found {', '.join(names)}: "
        "name the column of radii with --radius-column"
    )


class ColumnReader:
    """Collects the wanted columns of a table of words, line by line, and nothing else.

    Parameters
    ----------
    place : str
        For messages.
    layout : Layout
    separator : str, optional
        Between words; white space by default.
    """

    def __init__(self, place: str, layout: Layout, separator: str | None = None) -> None:
        self.place, self.layout, self.separator = place, layout, separator
        numeric = {"ids": layout.others.get("ids"), "radius": layout.radius}
        numeric |= {axis: layout.positions[k] for k, axis in enumerate(AXES[: len(layout.positions)])}
        numeric |= {name: layout.others.get(name) for name in ("conductivity", "temperature")}
        self.numeric = {name: column for name, column in numeric.items() if column is not None}
        self.rows = 0
        self._batches: list[Floats] = []
        self._types: list[NDArray[np.str_]] = []
        self._sample: dict[str, list[str]] = {name: [] for name in ("radius", *AXES) if name in self.numeric}

    def feed(self, lines: Sequence[str], numbers: Sequence[int] = ()) -> None:
        """Take some lines, whose numbers in the file may be given for messages.

        Raises
        ------
        InputError
            If a line has another number of words than there are columns, or a wanted word is not a number.
        """
        if not lines:
            return
        columns = list(self.numeric.values())
        whole = sorted(columns) == list(range(self.layout.width))  # numpy itself compares the widths of lines
        wanted = None if whole else columns
        try:
            batch = np.loadtxt(
                lines, usecols=wanted, ndmin=2, comments=None, delimiter=self.separator, dtype=np.float64
            )
        except ValueError:
            batch = None
        if batch is not None and whole:
            batch = batch[:, columns] if batch.shape[1] == self.layout.width else None
        if batch is None or len(batch) != len(lines) or not (whole or self._even(lines)):
            raise InputError(self._first_bad(lines, numbers))
        self._batches.append(batch)
        if "types" in self.layout.others:
            column = self.layout.others["types"]
            self._types.append(np.array([line.split(self.separator)[column].strip() for line in lines]))
        if self.rows < SAMPLED:
            self._take_words(lines[: SAMPLED - self.rows])
        self.rows += len(lines)

    def _even(self, lines: Sequence[str]) -> bool:
        """Whether every line has as many words as there are columns."""
        if self.separator is not None:
            return all(line.count(self.separator) == self.layout.width - 1 for line in lines)
        return all(len(line.split()) == self.layout.width for line in lines)

    def _take_words(self, lines: Sequence[str]) -> None:
        for line in lines:
            words = line.split(self.separator)
            for name, kept in self._sample.items():
                kept.append(words[self.numeric[name]].strip())

    def _first_bad(self, lines: Sequence[str], numbers: Sequence[int]) -> str:
        names = {column: name for name, column in self.numeric.items()}
        for row, line in enumerate(lines):
            where = f"{self.place}, line {numbers[row]}" if numbers else self.place
            words = line.split(self.separator)
            if len(words) != self.layout.width:
                found = "an empty line" if not line.strip() else f"{len(words)} in {line.strip()[:60]!r}"
                comma = "; write decimals with a point" if self.separator == ";" and "," in line else ""
                return f"{where}: expected {self.layout.width} values, found {found}{comma}"
            for column, name in names.items():
                try:
                    float(words[column])
                except ValueError:
                    word = words[column].strip()[:40]
                    comma = ": write decimals with a point" if "," in word else ""
                    return f"{where}: {name} is not a number: {word!r}{comma}"
        return f"{self.place} is not a table of numbers"

    def column(self, name: str) -> Floats | None:
        """The numbers of one column so far; None if the file has no such column."""
        if name not in self.numeric:
            return None
        place = list(self.numeric).index(name)
        return np.concatenate([np.zeros(0), *(batch[:, place] for batch in self._batches)])

    def positions(self) -> Floats:
        """Positions as they are printed, shape (n, 2) or (n, 3)."""
        found = [self.column(axis) for axis in AXES[: len(self.layout.positions)]]
        return np.stack([values for values in found if values is not None], axis=1)

    def types(self) -> NDArray[np.str_] | None:
        """Types of the particles so far, as they are written."""
        return np.concatenate(self._types) if self._types else None

    def ids(self) -> Ints | None:
        """Numbers of the particles so far.

        Raises
        ------
        InputError
            If one is not a whole number.
        """
        values = self.column("ids")
        if values is None:
            return None
        odd = ~(np.isfinite(values) & (np.rint(values) == values) & (np.abs(values) < 2.0**53))
        if odd.any():
            raise InputError(f"{self.place}: the id of a particle must be a whole number, found {values[odd][0]:g}")
        return values.astype(np.int64)

    def digits(self) -> dict[str, Digits] | None:
        """Printed digits of the positions and the radius."""
        return printed_digits(self._sample)


def batches(lines: Iterable[Line], size: int = BATCH) -> Iterator[list[Line]]:
    """Lines in lists of a limited length."""
    held: list[Line] = []
    for line in lines:
        held.append(line)
        if len(held) == size:
            yield held
            held = []
    if held:
        yield held
