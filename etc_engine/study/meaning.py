"""Which keys of a study mean something with which choice: for the checks, the identity and the form of the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from etc_engine.medium.rules import RULES
from etc_engine.realization import ENGINES
from etc_engine.study.quantities import QUANTITIES
from etc_engine.study.schema import StudyTable

Needs = Mapping[str, tuple[str, ...]]
"""The place of a choice, and the words of it with which a key has a meaning."""

NOT_SWEPT = ("dipoles", "threads")
"""Options of engines that a sweep has no use for: those of a transient, and of the machine."""

NONE = ""
"""The word of a choice that is left out."""

TRUE, FALSE = "true", "false"
"""The words of a switch."""

OPTIONS = {
    name: option for engine in ENGINES.values() for name, option in engine.options.items() if name not in NOT_SWEPT
}
"""Options of all engines, the keys of ``[conduction]``."""


def _meanings() -> Iterator[tuple[str, Needs]]:
    networks = {"conduction.engine": tuple(word for word, engine in ENGINES.items() if engine.needs_contacts)}
    yield "contacts.rule", networks
    of_rules = {key for rule in RULES.values() for key in rule.keys}
    for key in (row.key for row in QUANTITIES.values() if row.table == "contacts"):
        rules = {"contacts.rule": tuple(word for word, rule in RULES.items() if key in rule.keys)}
        yield f"contacts.{key}", {**networks, **(rules if key in of_rules else {})}
    yield (
        "contacts.roughness",
        {**networks, "contacts.rule": tuple(word for word, rule in RULES.items() if rule.roughness)},
    )
    yield "particles.conductivity", {"particles.material": (NONE,)}
    yield "pores.conductivity", {"pores.gas": (NONE,)}
    for name in OPTIONS:
        methods = [(e, m) for e, engine in ENGINES.items() for m, row in engine.methods.items() if name in row.options]
        engines, words = (tuple(dict.fromkeys(column)) for column in zip(*methods, strict=True))
        yield f"conduction.{name}", {"conduction.engine": engines, "conduction.method": words}
    local = [(e, m) for e, engine in ENGINES.items() for m, row in engine.methods.items() if row.local]
    engines, words = (tuple(dict.fromkeys(column)) for column in zip(*local, strict=True))
    yield "conduction.nonlinear", {"conduction.engine": engines, "conduction.method": words}
    yield "conduction.temperature_difference", {"conduction.nonlinear": (TRUE,)}
    yield "packing.count", {"packing.method": ("lubachevsky-stillinger", "random-sequential")}
    yield "packing.growth_rate", {"packing.method": ("lubachevsky-stillinger",)}


MEANING: Mapping[str, Needs] = dict(_meanings())
"""The keys that do not always have a meaning, by place."""


def chosen(study: StudyTable, place: str) -> tuple[str, ...]:
    """The words of a choice, one or several."""
    found: Any = study
    if place == "conduction.method":
        return tuple(found.methods)
    for key in place.split("."):
        found = getattr(found, key)
    if isinstance(found, bool):
        return (TRUE if found else FALSE,)
    return (NONE,) if found is None else (found if isinstance(found, str) else "a table",)


def meaningless(study: StudyTable, table: str = "") -> Iterator[tuple[str, str]]:
    """Places of the keys without a meaning in this study, and the choice that takes it from them, in words.

    With ``table`` those of one table alone.
    """
    for place, needs in MEANING.items():
        if table and place.partition(".")[0] != table:
            continue
        for choice, words in needs.items():
            if not set(chosen(study, choice)) & set(words):
                yield place, f"{choice.rpartition('.')[2]} = {', '.join(map(repr, chosen(study, choice)))}"
                break


def refuse_meaningless(study: StudyTable, table: str = "") -> None:
    """Refuse a key that is given and has no meaning, of one table or of all; its default may stand.

    Raises
    ------
    ValueError
    """
    for place, choice in meaningless(study, table):
        name, key = place.split(".")
        holder = getattr(study, name)
        if key in holder.model_fields_set and getattr(holder, key) != type(holder).model_fields[key].default:
            raise ValueError(f"{place}: has no effect with {choice}: remove it")


def drop_meaningless(study: StudyTable, values: dict[str, Any]) -> dict[str, Any]:
    """The plain values of a study less the keys without a meaning."""
    for place, _ in meaningless(study):
        table, key = place.split(".")
        values[table].pop(key, None)
    return values
