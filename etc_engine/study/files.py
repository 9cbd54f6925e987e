"""Study files of every kind: one schema number, one reader, one identity."""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError

from etc_engine.errors import StudyError
from etc_engine.study.schema import StudyTable, Word, first_problem, table_in

SCHEMA = 2
LONGEST_NAME = 80

MOVED = {
    "composite": "[pores] conductivity, [particles] conductivity and [conduction] resolution or particles",
    "composite.matrix_conductivity": "pores.conductivity",
    "composite.contrast": "a list particles.conductivity",
    "composite.resolution": "conduction.resolution",
    "composite.nodes": "conduction.particles",
    "models.pore_conductivity": "pores.conductivity",
    "conduction.conductivity": "particles.conductivity",
    "conduction.mixture": "particles.mixture",
    "conduction.contact_resistance": "contacts.contact_resistance",
    "conduction.pipe_resistance": "engine = 'pipe' with method = 'chord' or 'uniform'",
    "material": "[particles] heat_capacity and initial",
    "particles": "packing.files",
    "frame": "packing.frames",
    "box": "packing.box",
    "periodic": "packing.periodic",
}
"""Keys of schema 1, and where what they said stands now."""

OLD_WORDS = {"dirichlet": "fixed", "neumann": "flux"}
"""Words of schema 1 for a wall or an edge, and those of today."""


MOST_PARTS = 8
LONG_KEY = re.compile(rf"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++){{{MOST_PARTS}}}")
OPAQUE = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"""|\Z)' r"|'''.*?(?:'''|\Z)" r'|"(?:\\.|[^"\\\n])*(?:"|$)' r"|'[^'\n]*(?:'|$)|#[^\n]*",
    re.DOTALL | re.MULTILINE,
)
"""Strings and comments of TOML, unfinished ones to their end: the time of the search is linear in the text."""


def _number_of_schema(value: object) -> object:
    """``true`` equals 1 in Python, and is no number of a schema."""
    if isinstance(value, bool) or not isinstance(value, int) or value != SCHEMA:
        shown = str(value).lower() if isinstance(value, bool) else repr(value)
        raise ValueError(f"found {shown}, allowed: {SCHEMA}")
    return value


def _printable(name: str) -> str:
    """Names stand in tables and on terminals."""
    if not (1 <= len(name) <= LONGEST_NAME and name.isprintable()):
        shown = name if len(name) <= LONGEST_NAME else f"{name[:20]}... ({len(name)} characters)"
        raise ValueError(f"found {shown!r}, allowed: 1 to {LONGEST_NAME} printable characters")
    return name


Schema = Annotated[Literal[2], BeforeValidator(_number_of_schema)]
Name = Annotated[Word, AfterValidator(_printable)]
Seed = Annotated[int, Field(strict=True, ge=0, lt=2**63)]
A_SEED = "a whole number from 0 to 2**63 - 1"


class StudyFile(StudyTable):
    """What every study file has."""

    KIND: ClassVar[str] = "sweep"
    """Word of ``etc-engine keys --study`` for this kind of file."""
    WITHOUT_EFFECT: ClassVar[tuple[str, ...]] = ("name",)
    """Keys that change no number of the result."""

    schema_: Schema = Field(alias="schema", description=f"{SCHEMA}")
    name: Name = Field(description="a name of 1 to 80 printable characters")

    def resolved(self) -> dict[str, Any]:
        """The study with all defaults written out, as plain JSON values. It is a study again, the same one."""
        return self.model_dump(mode="json", by_alias=True)

    def identity(self) -> dict[str, Any]:
        """What decides the numbers of the result."""
        return {key: value for key, value in self.resolved().items() if key not in self.WITHOUT_EFFECT}

    def digest(self) -> str:
        """SHA-256 of the identity: two studies with the same digest give the same bits."""
        return hashlib.sha256(json.dumps(self.identity(), sort_keys=True).encode()).hexdigest()


S = TypeVar("S", bound=StudyFile)


def read_text(path: Path) -> str:
    """The text of a study file.

    Raises
    ------
    StudyError
        If the file is missing or is not text.
    """
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise StudyError(f"study {path}: cannot be read ({error.strerror}), expected a TOML file") from None
    except UnicodeDecodeError:
        raise StudyError(f"study {path}: is not text in UTF-8, expected a TOML file") from None


def parse_toml(text: str, source: str = "study") -> dict[str, Any]:
    """The content of a study file; ``source`` names it in errors.

    Raises
    ------
    StudyError
        If it is not TOML, or of an older schema: the message says what to write instead of what.

    Examples
    --------
    >>> parse_toml("[packing", "s.toml")
    Traceback (most recent call last):
    etc_engine.errors.StudyError: s.toml: is not valid TOML: ...
    """
    _refuse_long_keys(text, source)
    try:
        content = tomllib.loads(text)
    except RecursionError:
        raise StudyError(f"{source}: is not valid TOML: it is nested too deeply") from None
    except ValueError as error:  # beside its own errors: numbers of 5000 digits
        raise StudyError(f"{source}: is not valid TOML: {error}") from None
    schema = content.get("schema")
    if schema == 1 and not isinstance(schema, bool):
        raise StudyError(f"{source}: schema: found 1, allowed: {SCHEMA}; write {_translation(content)}")
    return content


def _refuse_long_keys(text: str, source: str) -> None:
    """Refuse keys of many dotted parts before the parser sees them: its time and memory grow with their square.

    Examples
    --------
    >>> _refuse_long_keys("a = '1.2.3.4.5.6.7.8.9.10' # 1.2.3.4.5.6.7.8.9.10", "s.toml")
    >>> _refuse_long_keys("a.'b'.c.d.e.f.g.h.i = 1", "s.toml")
    Traceback (most recent call last):
    etc_engine.errors.StudyError: s.toml: is not valid: line 1 has a key of more than 8 parts, keys of a study have ...
    """
    bare = OPAQUE.sub(lambda found: "" if found[0].startswith("#") else "s" + "\n" * found[0].count("\n"), text)
    found = LONG_KEY.search(bare)
    if found:
        line = bare.count("\n", 0, found.start()) + 1
        raise StudyError(
            f"{source}: is not valid: line {line} has a key of more than {MOST_PARTS} parts, "
            "keys of a study have at most 3"
        )


def validated(content: Mapping[str, Any], kind: type[S], source: str = "study") -> S:
    """The study of a file's content.

    Raises
    ------
    StudyError
        If it does not follow the schema of its kind: one line that names the source, the key, what was found and
        what is allowed.
    """
    try:
        return kind.model_validate(dict(content))
    except ValidationError as error:
        problem = first_problem(error, kind, MOVED)
        raise StudyError(f"{source}: {problem}{_where_keys_stand(problem, kind)}") from None


def _where_keys_stand(problem: str, kind: type[StudyFile]) -> str:
    """The command that prints the keys of the section that a problem begins with; nothing of a key at the top."""
    tables = {name for name, field in kind.model_fields.items() if table_in(field.annotation) is not None}
    section = re.split(r"\W", problem, maxsplit=1)[0]
    if section not in tables:
        return ""
    return f"; see: etc-engine keys {section}" + (f" --study {kind.KIND}" if kind.KIND != "sweep" else "")


def _translation(content: Mapping[str, Any]) -> str:
    """What to write instead of the keys of schema 1 that a study has.

    Examples
    --------
    >>> _translation({"schema": 1, "conduction": {"method": "chord", "conductivity": 2.0}})
    'schema = 2, and particles.conductivity for conduction.conductivity'
    """
    inner = [(f"{key}.{name}", key) for key, table in content.items() if isinstance(table, Mapping) for name in table]
    flat = [(key, key) for key, value in content.items() if not isinstance(value, Mapping)]
    found = [f"{MOVED[place]} for {place}" for place, _ in (*flat, *inner) if place in MOVED]
    conduction = content.get("conduction")
    if isinstance(conduction, Mapping) and conduction.get("method") == "pipe":
        found.append("engine = 'pipe' for method = 'pipe'")
    if "material" in content:
        found.append(f"{MOVED['material']} for [material]")
    edges = [edge.get("type") for edge in content.get("boundary", []) if isinstance(edge, Mapping)]
    found += [f"type = {OLD_WORDS[word]!r} for {word!r}" for word in dict.fromkeys(edges) if word in OLD_WORDS]
    return " and ".join([f"schema = {SCHEMA},", ", ".join(found)]) if found else f"schema = {SCHEMA}"
