"""Contact dumps of LIGGGHTS and LAMMPS (ITEM: ENTRIES): which particles touch, with which force and area."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from etc_engine.arrays import Floats, Ints
from etc_engine.errors import InputError
from etc_engine.particle_files.columns import BATCH, batches
from etc_engine.particle_files.items import Frame, find_frames, table_lines
from etc_engine.particle_files.streams import open_stream
from etc_engine.particle_files.table import ParticleTable

WIDTHS = {
    "pos": 6,
    "vel": 6,
    "id": 3,
    "force": 3,
    "force_normal": 3,
    "force_tangential": 3,
    "torque": 3,
    "history": 3,
    "contactArea": 1,
    "contactPoint": 3,
    "delta": 1,
    "heatFlux": 1,
    "ms_id": 2,
}
"""Columns of each word of ``compute pair/gran/local``."""
USUAL = ("pos", "id", "force", "contactArea", "heatFlux")
"""Words that are meant where a dump has as many columns as they make and does not name them."""
NAMED = {
    "id": (("id1", "id2", "periodic"), ("id1", "id2")),
    "force": (("fx", "fy", "fz"), ("force",)),
    "force_normal": (("fnx", "fny", "fnz"), ("fn",)),
    "contactArea": (("contactarea",), ("area",)),
    "heatFlux": (("heatflux",), ("heat_flux",), ("heat_flow",)),
    "delta": (("delta",), ("overlap",)),
    "pos": (("x1", "y1", "z1", "x2", "y2", "z2"),),
}
"""Column names by which a dump may name them."""
FAR = 1e6
"""Box lengths beyond which no image of a particle is looked for."""
PLACED = 1e-3
"""Centres in the contact dump may differ from those of the particles by this part of a radius."""


@dataclass(frozen=True, eq=False)
class ContactTable:
    """Contacts of particles, as a DEM code found them.

    Parameters
    ----------
    place : str
        The file and the frame, for messages.
    ids : ndarray of int64, shape (m, 2)
        Numbers of the two particles.
    columns : mapping of str to ndarray, shape (m,) or (m, w)
        By the words of ``compute pair/gran/local``: ``pos`` [m], ``force`` and ``force_normal`` [N], ``contactArea``
        [m2], ``heatFlux`` [W], ``delta`` [m], where the dump has them.
    """

    place: str
    ids: Ints
    columns: Mapping[str, Floats]

    @property
    def count(self) -> int:
        """Number of contacts."""
        return len(self.ids)

    def column(self, word: str) -> Floats:
        """One column.

        Raises
        ------
        InputError
            If the dump has none.
        """
        if word not in self.columns:
            raise InputError(
                f"{self.place} has no {word}: it has {', '.join(self.columns)}; name the words of its compute with "
                "--contact-columns, such as 'pos id force contactArea heatFlux'"
            )
        return self.columns[word]


def read_contacts(path: Path | str, frame: int = -1, words: Sequence[str] = ()) -> ContactTable:
    """Contacts of one frame of a contact dump.

    Parameters
    ----------
    path : path
        Plain, gzip or Zstandard.
    frame : int
        Number of the frame from 0; -1 is the last.
    words : sequence of str
        Words of the ``compute pair/gran/local`` in their order, where the columns have no names of their own;
        ``pos id force contactArea heatFlux`` by default. ``history:4`` stands for a history of four values.

    Returns
    -------
    ContactTable

    Raises
    ------
    InputError
        If the file is no contact dump, its columns are not understood, or there is no such frame.

    References
    ----------
    LIGGGHTS documentation, ``compute pair/gran/local``: words and widths.
    """
    path = Path(path)
    frames = find_frames(path, frame if frame >= 0 else None)
    if not -len(frames) <= frame < len(frames):
        raise InputError(f"{path} holds {len(frames)} frames, numbered from 0: there is no frame {frame}")
    chosen = frames[frame]
    place = f"{path}" if chosen.number == 0 else f"{path}, frame {chosen.number}"
    block = chosen.blocks.get("ENTRIES")
    if block is None:
        raise InputError(f"{path} is no dump of contacts: it has no ITEM: ENTRIES")
    try:
        count = chosen.number_of("NUMBER OF ENTRIES")
    except ValueError:
        raise InputError(f"{path}: frame {chosen.number} is cut short or malformed") from None
    spans = _spans(place, block.words, words)
    values = _numbers(path, place, chosen, count, len(block.words))
    ids = values[:, spans["id"]][:, :2]
    odd = ~(np.isfinite(ids) & (np.rint(ids) == ids) & (np.abs(ids) < 2.0**53))
    if odd.any():
        raise InputError(
            f"{place}: ids of particles must be whole numbers, found {ids[odd][0]:g}; see --contact-columns"
        )
    columns = {word: values[:, span] for word, span in spans.items() if word != "id"}
    narrow = {word: column[:, 0] if column.shape[1] == 1 else column for word, column in columns.items()}
    return ContactTable(place, ids.astype(np.int64), narrow)


def contact_rows(table: ParticleTable, contacts: ContactTable) -> Ints:
    """Row numbers of the two particles of each contact whose particles are in the packing; (-1, -1) of the others.

    Parameters
    ----------
    table : ParticleTable
        With ids; a crop may have left out particles.
    contacts : ContactTable

    Returns
    -------
    ndarray of int64, shape (m, 2)

    Raises
    ------
    InputError
        If the particles have no ids or ids that repeat, no contact belongs to them, or the contact dump has them
        elsewhere.
    """
    if table.ids is None:
        raise InputError(f"the particles have no ids, by which {contacts.place} names them")
    order = np.argsort(table.ids, kind="stable")
    ids = table.ids[order]
    if (np.diff(ids) == 0).any():
        raise InputError(f"the id {ids[1:][np.diff(ids) == 0][0]} belongs to several particles")
    found = np.minimum(np.searchsorted(ids, contacts.ids), ids.size - 1)
    known = (ids[found] == contacts.ids).all(axis=1)
    if contacts.count and not known.any():
        raise InputError(f"{contacts.place} names no contact between the particles that were read")
    rows = np.where(known[:, None], order[found], -1)
    if "pos" in contacts.columns:
        _check_places(table, contacts, rows)
    return rows


def _check_places(table: ParticleTable, contacts: ContactTable, rows: Ints) -> None:
    """Refuse contacts of another moment: their centres are elsewhere."""
    packing = table.packing
    d = packing.dimension
    origin = np.array(table.origin or (0.0,) * d)
    for side in range(2):
        known = np.flatnonzero(rows[:, side] >= 0)
        who = rows[known, side]
        places = contacts.columns["pos"][known, 3 * side : 3 * side + d] - origin
        away = places - packing.centers[who]
        away[~(np.abs(away) <= FAR * np.asarray(packing.box.lengths))] = np.inf
        apart = np.full(known.size, np.inf)
        near = np.isfinite(away).all(axis=1)
        apart[near] = np.linalg.norm(packing.box.minimum_image(away[near]), axis=1)
        bad = np.flatnonzero(~(apart <= PLACED * packing.radii[who]))
        if bad.size:
            first = known[bad[0]]
            there = contacts.columns["pos"][first, 3 * side : 3 * side + 3].tolist()
            raise InputError(
                f"{contacts.place} has particle {contacts.ids[first, side]} at {there}, {apart[bad[0]]:.3g} m from "
                "where the particles have it: give the frame of the same time step"
            )


def _spans(place: str, names: Sequence[str], words: Sequence[str]) -> dict[str, list[int]]:
    """Columns of each word."""
    lowered = [name.lower() for name in names]
    if not words and "id1" in lowered:
        found = {}
        for word, spellings in NAMED.items():
            for spelling in spellings:
                if word not in found and all(name in lowered for name in spelling):
                    found[word] = [lowered.index(name) for name in spelling]
        if "id" in found:
            return found
    chosen = list(words or USUAL)
    spans: dict[str, list[int]] = {}
    at = 0
    for word in chosen:
        name, _, width = word.partition(":")
        if name not in WIDTHS or (width and not width.isdigit()):
            raise InputError(f"--contact-columns knows the words {', '.join(WIDTHS)}, found {word!r}")
        wide = int(width or WIDTHS[name])
        spans[name] = list(range(at, at + wide))
        at += wide
    if at != len(names) or "id" not in spans:
        raise InputError(
            f"{place} has {len(names)} columns, '{' '.join(chosen)}' makes {at}: name the words of its "
            "'compute pair/gran/local' (id among them) in their order with --contact-columns"
        )
    return spans


def _numbers(path: Path, place: str, frame: Frame, count: int, width: int) -> Floats:
    block = frame.blocks["ENTRIES"]
    found = [np.zeros((0, width))]
    with open_stream(path) as stream:
        for lines in batches(table_lines(stream, block)):
            try:
                batch = np.loadtxt(lines, ndmin=2, comments=None)
            except ValueError as error:
                raise InputError(f"{place} is not a table of numbers: {error}") from None
            if batch.shape != (len(lines), width):
                raise InputError(f"{place}: expected {width} values per row")
            found.append(batch)
            if len(lines) < BATCH and not lines[-1].endswith("\n"):
                raise InputError(f"{path}: frame {frame.number} is cut short or malformed: its last line has no end")
    values = np.concatenate(found)
    if len(values) != count:
        raise InputError(
            f"{path}: frame {frame.number} is cut short or malformed: {count} entries are announced, "
            f"{len(values)} found"
        )
    return values
