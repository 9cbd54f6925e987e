"""Text files of YADE (``export.text``): a line ``#format x_y_z_r...``, then a row for each sphere."""

from __future__ import annotations

from itertools import chain
from pathlib import Path

from etc_engine.errors import InputError
from etc_engine.particle_files.csv_files import numbered_lines, table_rows
from etc_engine.particle_files.sample import Rows, Sample
from etc_engine.particle_files.streams import line_blocks, open_stream

OPENING = b"#format "


def is_yade(opening: bytes) -> bool:
    """Whether a file begins like YADE's."""
    return opening.startswith(OPENING)


def yade_rows(path: Path, sample: Sample) -> Rows:
    """Rows of a text file of YADE: spheres, without a box.

    Raises
    ------
    InputError

    References
    ----------
    YADE, ``py/export.py``, function ``textExt``: six digits (``%g``), separated by tabs.
    """
    with open_stream(path) as stream:
        lines = numbered_lines(path, line_blocks(stream))
        numbers, texts = next(lines)
        header = texts[0]
        names = header.removeprefix(OPENING.decode()).split()[:1]
        if not names:
            raise InputError(f"{path}: the first line names no columns, found {header[:60]!r}")
        rest = chain([(numbers[1:], texts[1:])], lines)
        return table_rows(path, names[0].split("_"), None, rest, sample.radius_column)
