"""Particle files: tables of text with a header, CSV in and out."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import TextIO, TypeAlias

from etc_engine.box import AXES, Box
from etc_engine.errors import InputError
from etc_engine.particle_files.columns import ColumnReader, Layout, find_layout
from etc_engine.particle_files.digits import PrintedColumn, PrintedColumns
from etc_engine.particle_files.sample import Rows, Sample, make_table
from etc_engine.particle_files.streams import BOM, LONGEST, line_blocks, open_stream
from etc_engine.particle_files.table import ParticleTable

SEPARATORS = {",": "commas", ";": "semicolons", "\t": "tabs"}
Numbered: TypeAlias = tuple[Sequence[int], list[str]]
"""Numbers of some lines in their file, and their texts."""


def read_csv(path: Path | str, box: Box | None = None, sample: Sample | None = None) -> ParticleTable:
    """Particles from a table of text with the header ``x,y[,z],radius[,conductivity]``, in any order and among other
    columns.

    Parameters
    ----------
    path : path
        Separated by commas, semicolons, tabs or blanks; plain, gzip or Zstandard.
    box : Box, optional
        Its dimension decides whether a ``z`` column is wanted.
    sample : Sample, optional
        Box, crop, dimension and column of radii in the place of ``box``.

    Returns
    -------
    ParticleTable

    Raises
    ------
    InputError, GeometryError
        If the file is missing, its header or a value is not understood, or a particle is not valid.

    Notes
    -----
    Names of columns may be written large or small; ``diameter`` may stand for ``radius``. Lines that are blank or
    begin with ``#`` are left out, but the header itself may begin with ``#``.
    """
    chosen = sample or Sample()
    if box is not None:
        chosen = Sample(
            box=tuple((0.0, length) for length in box.lengths),
            periodic=box.periodic_axes,
            crop=chosen.crop,
            radius_column=chosen.radius_column,
        )
    return make_table(csv_rows(path, chosen.radius_column), chosen)


def csv_rows(path: Path | str, radius_column: str | None = None) -> Rows:
    """Rows of a table of text, in the coordinates of the file.

    Raises
    ------
    InputError
    """
    path = Path(path)
    with open_stream(path) as stream:
        names, separator, lines = table_opening(path, line_blocks(stream))
        return table_rows(path, names, separator, lines, radius_column)


def table_opening(path: Path, blocks: Iterable[bytes]) -> tuple[list[str], str | None, Iterator[Numbered]]:
    """Names of the columns of a table, what separates them, and the lines after the header.

    Parameters
    ----------
    path : Path
    blocks : iterable of bytes
        The file from its first byte, in blocks of whole lines. None after the one with the header is read.

    Raises
    ------
    InputError
        If there is no header.
    """
    lines = numbered_lines(path, blocks)
    for numbers, texts in lines:
        row = next((row for row, text in enumerate(texts) if _is_header(text)), None)
        if row is not None:
            names, separator = _header(path, numbers[row], texts[row].strip().lstrip("# \t"))
            return names, separator, chain([(numbers[row + 1 :], texts[row + 1 :])], lines)
    raise InputError(f"{path} is empty: expected a header such as 'x,y,radius'")


def table_rows(
    path: Path, names: Sequence[str], separator: str | None, lines: Iterable[Numbered], radius_column: str | None
) -> Rows:
    """Rows of a table whose columns are known.

    Parameters
    ----------
    path : Path
    names : sequence of str
    separator : str or None
        Between words; None is white space.
    lines : iterable of (sequence of int, list of str)
        Numbers and texts of lines, in batches. Blank lines and comments are left out.
    radius_column : str, optional

    Raises
    ------
    InputError
    """
    rows = part_of_table(path, table_layout(path, names, radius_column), separator, lines)
    if not rows.radii.size:
        raise InputError(f"{path} holds no particles, only a header")
    return rows


def table_layout(path: Path, names: Sequence[str], radius_column: str | None) -> Layout:
    """Where the wanted columns of a table stand.

    Raises
    ------
    InputError
        If one is missing, or positions are parts of a box that the file does not hold.
    """
    layout = find_layout(str(path), names, radius_column)
    if any(layout.scaled):
        raise InputError(f"{path} has positions scaled by a box that it does not hold; found {','.join(names)}")
    return layout


def part_of_table(path: Path, layout: Layout, separator: str | None, lines: Iterable[Numbered]) -> Rows:
    """Rows of some lines of a table, possibly of none; parameters as of `table_rows`.

    Raises
    ------
    InputError
    """
    reader = ColumnReader(str(path), layout, separator)
    for numbers, texts in map(_content, lines):
        reader.feed(_unquoted(texts, separator), numbers)
    radii, digits = reader.column("radius"), reader.digits()
    assert radii is not None
    half = 0.5 if layout.halved else 1.0
    printed = None
    if digits is not None:
        positions = tuple(PrintedColumn(digits[axis]) for axis in AXES[: len(layout.positions)])
        printed = PrintedColumns(positions, PrintedColumn(digits["radius"], half))
    return Rows(
        place=str(path),
        positions=reader.positions(),
        radii=half * radii,
        conductivity=reader.column("conductivity"),
        ids=reader.ids(),
        types=reader.types(),
        temperature=reader.column("temperature"),
        printed=printed,
    )


def write_csv(target: Path | str | TextIO, table: ParticleTable) -> None:
    """Write particles as CSV to a file or an open stream, with as many digits as read back the same numbers."""
    if isinstance(target, (str, Path)):
        with Path(target).open("w", newline="", encoding="utf-8") as file:
            write_csv(file, table)
        return
    packing = table.packing
    names = [*AXES[: packing.dimension], "radius"]
    columns = [*packing.centers.T, packing.radii]
    if table.conductivity is not None:
        names.append("conductivity")
        columns.append(table.conductivity)
    writer = csv.writer(target, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(zip(*(column.tolist() for column in columns), strict=True))


def numbered_lines(path: Path, blocks: Iterable[bytes]) -> Iterator[Numbered]:
    """Lines of blocks of text in batches, with their numbers from 1.

    Old line ends (a carriage return alone) count.

    Raises
    ------
    InputError
        If it is no text in UTF-8.
    """
    read = 0
    for block in blocks:
        lines = _decoded(path, block if read else block.removeprefix(BOM)).splitlines()
        longest = max(map(len, lines), default=0)
        if longest >= LONGEST:
            raise InputError(f"{path} is not a table of text: it has a line of {longest} characters or more")
        yield range(read + 1, read + 1 + len(lines)), lines
        read += len(lines)


def _decoded(path: Path, block: bytes) -> str:
    try:
        text = block.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path} is not in a known format: it is binary, or text in another encoding than UTF-8 ({error.reason})"
        ) from None
    if "\x00" in text:
        raise InputError(f"{path} is not a table of text: it holds zero bytes")
    return text


def _content(batch: Numbered) -> Numbered:
    """A batch without blanks at the ends of lines, blank lines and comments."""
    numbers, lines = batch[0], [text.strip() for text in batch[1]]
    if all(text and text[0] != "#" for text in lines):
        return numbers, lines
    kept = [row for row, text in enumerate(lines) if text and text[0] != "#"]
    return [numbers[row] for row in kept], [lines[row] for row in kept]


def _is_header(text: str) -> bool:
    """Whether a line is the first one of content; names of positions behind ``#`` are no comment."""
    text = text.strip()
    return bool(text) and (not text.startswith("#") or _names_positions(text.lstrip("# \t")))


def _names_positions(text: str) -> bool:
    words = {word.strip().strip('"').lower() for word in text.replace(";", ",").replace(",", " ").split()}
    return {"x", "y"} <= words or {"points:0", "points:1"} <= words


def _header(path: Path, number: int, header: str) -> tuple[list[str], str | None]:
    """Names of the columns, and what separates them."""
    separator = next((mark for mark in SEPARATORS if mark in header), None)
    names = [name.strip().strip('"') for name in (header.split(separator) if separator else header.split())]
    if all(_is_number(name) for name in names):
        raise InputError(
            f"{path}, line {number}: a header such as 'x,y,radius' must come first, found the numbers {header[:60]!r}"
        )
    if not _names_positions(" ".join(names)):
        raise InputError(
            f"{path} is not in a known format: its first line {header[:60]!r} is no header such as 'x,y,radius', "
            "and no other format begins like that"
        )
    doubled = {name for name in names if [other.lower() for other in names].count(name.lower()) > 1}
    if doubled:
        raise InputError(f"{path} has the header {header[:80]!r}: the column {sorted(doubled)[0]!r} appears twice")
    return names, separator


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _unquoted(lines: list[str], separator: str | None) -> list[str]:
    """Lines without quotes; a separator inside quotes becomes a blank."""
    if separator is None or not any('"' in line for line in lines):
        return lines
    try:
        rows = list(chain.from_iterable(csv.reader([line], delimiter=separator) for line in lines))
    except csv.Error:
        return lines  # refused by the number of its columns
    return [separator.join(word.replace(separator, " ") for word in row) for row in rows]
