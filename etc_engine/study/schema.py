"""What all tables of study files share: strict keys, bounded numbers, and the first mistake in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from itertools import pairwise
from typing import Annotated, Any, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError
from pydantic_core import ErrorDetails

LARGEST, SMALLEST = 1e100, 1e-100
"""No quantity in SI units lies beyond these; products of three of them are still finite."""
MOST_STEPS = 10**9
"""A run of more steps than this has a mistake in its study: each takes a microsecond or more."""

LONGEST_KEY = 80
"""Characters of a key that an error shows."""

NUMBER = "a number of at most 1e100 in size"
POSITIVE = "a positive number from 1e-100 to 1e100"
NOT_NEGATIVE = "a number from 0 to 1e100"

Word = Annotated[str, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, ge=SMALLEST, le=LARGEST, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST, allow_inf_nan=False)]
Steps = Annotated[int, Field(strict=True, ge=1, le=10**100)]


class StudyTable(BaseModel):
    """A table of a study file. The description of a field says what is allowed, for the error line."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def without_repeats(values: tuple[Any, ...]) -> tuple[Any, ...]:
    """The values, refused if one stands twice."""
    repeated = [value for value, count in Counter(values).items() if count > 1]
    if repeated:
        raise ValueError(f"{repeated[0]!r} is listed twice: list each value once")
    return values


def _increasing(times: list[float]) -> list[float]:
    """Times that can be told apart, and from 0."""
    if any(later - earlier < SMALLEST for earlier, later in pairwise(times)):
        raise ValueError("they must increase, by 1e-100 s at least")
    return times


Times = Annotated[list[Number], AfterValidator(_increasing)]

AS_NUMBER, AS_LIST, AS_TABLE = "a number", "a list", "a table"
"""How a value is written, the tags of a field that takes several ways (see `WRITTEN`)."""


def _written(value: object) -> str:
    if isinstance(value, Mapping | BaseModel):
        return AS_TABLE
    return AS_LIST if isinstance(value, list | tuple) else AS_NUMBER


WRITTEN = Discriminator(_written)
"""Chooses what a value may be by how it is written, so that a mistake inside a table is reported as one."""


def first_problem(error: ValidationError, root: type[BaseModel], hints: Mapping[str, str] | None = None) -> str:
    """The first problem of a study in words; unknown keys first, since they often explain a missing one.

    Parameters
    ----------
    error : ValidationError
    root : type of BaseModel
        Of the whole study.
    hints : mapping of str to str, optional
        What to write instead of a key that has moved, by its place.

    Examples
    --------
    >>> class Disk(StudyTable):
    ...     radius: Positive = Field(description=POSITIVE)
    >>> try:
    ...     Disk.model_validate({"radios": 1.0})
    ... except ValidationError as error:
    ...     print(first_problem(error, Disk))
    radios: unknown key, did you mean 'radius'? allowed: radius (and 1 more problem)
    """
    details = sorted(error.errors(), key=lambda detail: detail["type"] != "extra_forbidden")
    places = {_field(root, detail["loc"])[0] for detail in details}
    more = f" (and {len(places) - 1} more problem{'s' * (len(places) > 2)})" if len(places) > 1 else ""
    return _describe(details[0], root, hints or {}) + more


def _describe(detail: ErrorDetails, root: type[BaseModel], hints: Mapping[str, str]) -> str:
    key, table, allowed = _field(root, detail["loc"])
    if detail["type"] == "extra_forbidden":
        if key in hints:
            return f"{key}: unknown key, write {hints[key]}"
        names = [field.alias or name for name, field in table.model_fields.items()]
        near = get_close_matches(str(detail["loc"][-1]), names, 1)
        hint = f", did you mean {near[0]!r}?" if near else ","
        return f"{key}: unknown key{hint} allowed: {', '.join(names)}"
    if detail["type"] == "missing":
        return f"{key}: missing, expected {allowed}"
    if detail["type"] == "value_error":  # our own checks, which say it all
        reason = str(detail["ctx"]["error"])
        return f"{key}: {reason}" if key else reason
    return f"{key}: found {_short(detail['input'])}, allowed: {allowed}"


def _short(value: object) -> str:
    """A value as it was found; of a long one its beginning."""
    try:
        text = repr(value)
    except ValueError:  # a whole number of thousands of digits
        return "a number beyond all bounds"
    return text if len(text) <= 80 else f"{text[:77]}..."


def _field(root: type[BaseModel], location: Sequence[int | str]) -> tuple[str, type[BaseModel], str]:
    """Name of the key at an error's location, the table it is in, and what the key allows."""
    table: type[BaseModel] = root
    inside: Any = root
    place, allowed = "", "a table"
    for step in location:
        if isinstance(step, int):
            place += f"[{step}]"
            continue
        arm = _tagged(inside, step)
        if arm is not None:  # which of the ways to write a value, no key
            inside = arm
            continue
        inner = table_in(inside)
        if inner is None:
            continue
        table = inner
        name = step if len(step) <= LONGEST_KEY else f"{step[:LONGEST_KEY]}..."
        place += f".{name}" if place else name
        field = next((f for n, f in table.model_fields.items() if step in (n, f.alias)), None)
        if field is None:  # an unknown key
            break
        allowed = field.description or "a table"
        inside = field.annotation
    return place, table, allowed


def _tagged(annotation: Any, tag: str) -> Any:
    """The way to write a value that has a tag, or None."""
    for way in get_args(annotation):
        if any(isinstance(mark, Tag) and mark.tag == tag for mark in get_args(way)):
            return way
        if (inner := _tagged(way, tag)) is not None:
            return inner
    return None


def table_in(annotation: Any) -> type[BaseModel] | None:
    """The table that a field holds, or may hold, or holds a list of."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((table for kind in get_args(annotation) if (table := table_in(kind)) is not None), None)
