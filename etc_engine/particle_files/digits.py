"""Printed digits: how far a number read from a text file may be from the number that was meant."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from etc_engine.arrays import Floats, Ints

EXACT = 15
"""From this many significant digits on, the rounding of a number is that of the arithmetic itself."""
ROUNDED = 5
"""From this many significant digits on, a number is taken to be rounded."""
SINGLE = 2.0**-23
"""Relative spacing of numbers in single precision."""
_NUMBER = re.compile(r"[+-]?(\d*)\.?(\d*)(?:[eEdD]([+-]?\d+))?$")


@dataclass(frozen=True)
class Digits:
    """The finest digits of a column of printed numbers.

    The step between neighbouring printable numbers at v is ``max(10^(floor(log10 |v|) + 1 - s), 10^-d)``: the first
    term is that of ``%.sg``, the second that of ``%.df``, and for either format the other term is not larger.

    Parameters
    ----------
    significant : int
        Most significant digits s of a number.
    decimals : int
        Most digits d after the decimal point.
    relative : float
        Relative step of numbers in binary; 0 for decimal ones.
    """

    significant: int
    decimals: int
    relative: float = 0.0

    def step(self, values: Floats) -> Floats:
        """Step at each value, in the units that are printed; zero where all digits of a double are printed."""
        size = np.abs(values)
        if self.relative:
            return self.relative * size
        if self.significant >= EXACT:
            return np.zeros_like(size)
        exponent = np.floor(np.log10(np.where(size > 0.0, size, 1.0)))
        relative = np.where(size > 0.0, 10.0 ** (exponent + 1.0 - self.significant), 0.0)
        return np.asarray(np.maximum(relative, 10.0 ** -float(self.decimals)))


@dataclass(frozen=True)
class PrintedColumn:
    """Digits of one column, and how its printed numbers become metres: ``x = offset + factor * printed``."""

    digits: Digits
    factor: float = 1.0
    offset: float = 0.0

    def step(self, values: Floats) -> Floats:
        """Step [m] at coordinates of the file [m]."""
        return abs(self.factor) * self.digits.step((values - self.offset) / self.factor)


@dataclass(frozen=True)
class PrintedColumns:
    """How finely the columns of a text file are printed: one column for each axis, and the radii.

    Parameters
    ----------
    positions : tuple of PrintedColumn
    radius : PrintedColumn
    remedy : str
        What the user can do about too few digits.
    """

    positions: tuple[PrintedColumn, ...]
    radius: PrintedColumn
    remedy: str = "write more digits"


def printed_digits(columns: Mapping[str, Sequence[str]]) -> dict[str, Digits] | None:
    """Digits of some columns of one file, from the words as they are printed.

    A file is taken to be rounded when its longest number has five significant digits or more, or when most of its
    numbers have as many digits as the longest one: numbers such as 0.25 and 0.5 are meant as they stand. A column of
    few round numbers, such as the radii of two sizes, has the digits of the other columns.

    Parameters
    ----------
    columns : mapping of str to sequence of str
        A sample of the words of each column.

    Returns
    -------
    dict of str to Digits, or None
        None if the numbers are meant as they stand.

    Examples
    --------
    >>> printed_digits({"x": ["0.123456", "12.3457"], "radius": ["0.5", "0.5"]})["radius"]
    Digits(significant=6, decimals=6, relative=0.0)
    >>> printed_digits({"x": ["0.25", "0.75"], "radius": ["0.25", "0.25"]}) is None
    True
    """
    counts = {name: _counts(words) for name, words in columns.items()}
    pool = np.concatenate([np.zeros((0, 2), dtype=np.int64), *counts.values()])
    if not len(pool):
        return None
    shared = Digits(*pool.max(axis=0).tolist())
    if shared.significant < ROUNDED and not _looks_rounded(pool):
        return None
    own = {}
    for name, found in counts.items():
        if len(found) and found[:, 0].max() < shared.significant and _looks_rounded(found):
            own[name] = Digits(*found.max(axis=0).tolist())
    return {name: own.get(name, shared) for name in columns}


def _counts(words: Sequence[str]) -> Ints:
    """Significant digits and decimals of each different number that is not zero, shape (k, 2)."""
    found = []
    for word in dict.fromkeys(words):
        match = _NUMBER.match(word)
        if match is None:
            continue
        whole, part, exponent = match.groups()
        significant = (whole + part).lstrip("0")
        if not part:
            significant = significant.rstrip("0")
        if significant:
            found.append((len(significant), max(len(part) - int(exponent or 0), 0)))
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _looks_rounded(counts: Ints) -> bool:
    """Whether most of a dozen or more different numbers use nearly all digits or decimals of the longest one."""
    longest = counts.max(axis=0)
    if len(counts) < 12 or longest[0] < 3:
        return False
    return bool(max((counts[:, k] >= longest[k] - 1).mean() for k in range(2)) >= 0.8)
