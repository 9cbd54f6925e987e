"""The keys of study files as rows, read from the schema that checks them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from etc_engine.errors import InputError
from etc_engine.study.file_packings import FileStudy
from etc_engine.study.files import StudyFile
from etc_engine.study.meshless import MeshlessStudy
from etc_engine.study.sweep import Study
from etc_engine.study.transient import NetworkStudy

KINDS: Mapping[str, type[StudyFile]] = {kind.KIND: kind for kind in (Study, FileStudy, NetworkStudy, MeshlessStudy)}
"""Kinds of study files, by the word that asks for one."""


@dataclass(frozen=True)
class KeyRow:
    """A key of a study file.

    Parameters
    ----------
    key : str
        With its table, such as ``contacts.contact_angle``.
    allowed : str
        What it may be, with the unit in brackets.
    default : str
        As a study writes it; ``needed`` where there is none, ``-`` where the key may be left out.
    meaning : str
        The quantity in words; empty where the key is no quantity.
    """

    key: str
    allowed: str
    default: str
    meaning: str


def key_rows(kind: str, section: str = "") -> tuple[KeyRow, ...]:
    """The keys of a kind of study file, or of one of its sections.

    Parameters
    ----------
    kind : str
        One of `KINDS`.
    section : str, optional
        A table such as ``contacts``, or a key outside of tables.

    Raises
    ------
    InputError
        If there is no such kind or section.

    Examples
    --------
    >>> [row.key for row in key_rows("sweep", "radiation")][:2]
    ['radiation', 'radiation.emissivity']
    """
    if kind not in KINDS:
        raise InputError(f"there are no study files of the kind {kind!r}; there are: {', '.join(KINDS)}")
    fields = {field.alias or name: field for name, field in KINDS[kind].model_fields.items()}
    if section and section not in fields:
        near = get_close_matches(section, fields, 1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise InputError(f"study files ({kind}) have no section {section!r}: {hint}There are: {', '.join(fields)}")
    return tuple(row for name, field in fields.items() if section in ("", name) for row in _rows(name, field))


def _rows(place: str, field: FieldInfo) -> Iterator[KeyRow]:
    tables = tuple(_tables(field.annotation))
    if field.description or not tables:
        yield KeyRow(place, field.description or "a table", _default(field), field.title or "")
    seen: set[str] = set()
    for table in tables:
        for name, inner in table.model_fields.items():
            key = inner.alias or name
            if key not in seen:
                seen.add(key)
                yield from _rows(f"{place}.{key}", inner)


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:
    """The tables that a field may hold."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
        return
    for part in get_args(annotation):
        yield from _tables(part)


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "needed"
    value = field.get_default(call_default_factory=True, validated_data={})
    if value is None or isinstance(value, BaseModel | dict) or value == ():
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else str(value)
