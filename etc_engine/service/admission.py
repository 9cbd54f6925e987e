"""Admission: the cost of a study, estimated and limited before anything runs."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from pydantic import BaseModel

from etc_engine.errors import StudyError
from etc_engine.packing import parse_radii
from etc_engine.realization import ENGINES
from etc_engine.service.settings import Limits
from etc_engine.study.sweep import Study, parse_study

SOURCE = "study"
FULL = 1.0
"""A density no packing without a count is expected to exceed."""

BASE_BYTES = 250e6
"""Memory of a rank for its libraries, measured and rounded upwards."""


@dataclass(frozen=True)
class Application:
    """A study that may be run.

    Parameters
    ----------
    study : Study
    text : str
        Its TOML.
    id : str
        Sixteen hexadecimal digits, the same for the same study: order, layout and comments of the text do not matter.
    units, most : int
        Packings planned, and at most (adaptive studies).
    cells : int
        Results at most.
    particles : float
        Expected number in the densest packing.
    """

    study: Study
    text: str
    id: str
    units: int
    most: int
    cells: int
    particles: float


def apply(text: str, limits: Limits) -> Application:
    """Check a study and its size.

    Raises
    ------
    StudyError
        If it is not valid, or asks for more than is allowed; the message begins with the field.

    Examples
    --------
    >>> apply('schema = 2', Limits())
    Traceback (most recent call last):
    etc_engine.errors.StudyError: study: name: missing, expected a name ... (and 3 more problems)
    """
    try:
        found = _measure(parse_study(text, SOURCE), text)
    except (RecursionError, ArithmeticError) as error:  # a thousand brackets; radii of 1e300
        what = "is nested too deeply" if isinstance(error, RecursionError) else "has numbers out of range"
        raise StudyError(f"{SOURCE}: {what}") from None
    _refuse_excess(found, limits)
    return found


def _measure(study: Study, text: str) -> Application:
    densities = len(study.densities)
    most = densities * study.statistics.cap
    return Application(
        study=study,
        text=text,
        id=study_id(study),
        units=densities * study.statistics.realizations,
        most=most,
        cells=most * math.prod(study.shape),
        particles=expected_particles(study),
    )


def study_id(study: Study) -> str:
    """The same for the same study, another for any other."""
    return hashlib.sha256(json.dumps(study.resolved(), sort_keys=True).encode()).hexdigest()[:16]


def expected_particles(study: Study) -> float:
    """Number of particles in the densest packing of a study, from the mean particle."""
    packing = study.packing
    if packing.count is not None:
        return float(packing.count)
    particle = parse_radii(packing.radii).mean_measure(len(packing.box))
    room = math.prod(packing.box) * max(packing.density or (FULL,))
    return room / particle if particle > 0.0 else math.inf


def _refuse_excess(found: Application, limits: Limits) -> None:
    for field, what, value, limit in (
        ("statistics.realizations", "packings", found.most, limits.units),
        ("statistics.realizations", "results", found.cells, limits.cells),
        ("packing.box", "particles in a packing", found.particles, limits.particles),
    ):
        if not value <= limit:
            raise StudyError(f"{SOURCE}: {field}: makes about {value:.6g} {what}, this service allows {limit}")
    memory, allowed = _expected_memory(found) / 1e6, limits.memory_bytes / 1e6
    if not memory <= allowed:
        field = "packing.box" if ENGINES[found.study.conduction.engine].needs_contacts else "conduction"
        raise StudyError(
            f"{SOURCE}: {field}: takes about {memory:.0f} MB of memory per rank, this service allows {allowed:.0f} MB"
        )


def _expected_memory(found: Application) -> float:
    """Bytes of a rank, the most that one of the methods takes."""
    study, engine = found.study, ENGINES[found.study.conduction.engine]
    options = [engine.resolve(one.method, one.options) for one in study.realization_spec(None).conduction]
    return BASE_BYTES + max(engine.memory(study.packing.box, found.particles, one) for one in options)


def field_of(message: str) -> str:
    """The field that the message of a `StudyError` is about, such as ``packing.density``; empty if it names none.

    Examples
    --------
    >>> field_of("study: packing: radii: found 'equal', 'advancing-front' needs a radius")
    'packing.radii'
    >>> field_of("study: packing.density[1]: found -1.0, allowed: a positive number")
    'packing.density'
    >>> field_of("study: is not valid TOML: Expected '=' after a key (at line 1, column 3)")
    ''
    """
    words: list[str] = []
    table: type[BaseModel] | None = Study
    for piece in message.removeprefix(f"{SOURCE}: ").split(": ")[:-1]:
        for word in piece.split("."):
            name = word.partition("[")[0]
            fields = {} if table is None else {f.alias or n: f for n, f in table.model_fields.items()}
            if name not in fields:
                return ".".join([*words, name] if "unknown key" in message else words)
            words.append(name)
            kinds = get_args(fields[name].annotation) or (fields[name].annotation,)
            table = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)
    return ".".join(words)


def toml_of(values: Mapping[str, Any]) -> str:
    """A study given as JSON, as the text of a study file; nulls are left out.

    Raises
    ------
    StudyError
        If a value has no place in TOML.

    Examples
    --------
    >>> print(toml_of({"schema": 2, "packing": {"box": [1.0, 2.0], "count": None}}))
    schema = 2
    packing = { box = [1.0, 2.0] }
    """
    try:
        return "\n".join(f"{_word(str(key))} = {_value(value)}" for key, value in values.items() if value is not None)
    except RecursionError:
        raise StudyError(f"{SOURCE}: is nested too deeply") from None


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_word(str(key))} = {_value(item)}" for key, item in value.items() if item is not None)
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list):
        return f"[{', '.join(_value(item) for item in value)}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)  # Python and TOML write numbers alike, inf and nan included
    if isinstance(value, str):
        return _quoted(value)
    raise StudyError(f"{SOURCE}: found {value!r} in a list, which a study does not take")


def _word(key: str) -> str:
    plain = key.isascii() and key.replace("_", "a").replace("-", "a").isalnum()
    return key if plain else _quoted(key)


def _quoted(text: str) -> str:
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise StudyError(f"{SOURCE}: found half of a surrogate pair in a text, expected whole characters")
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
