"""Which keys of a study mean something with which choice: for the checks, the identity and the form of the page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from etc_engine.realization import ENGINES
from etc_engine.study.schema import StudyTable

Needs = Mapping[str, tuple[str, ...]]
"""The place of a choice, and the words of it with which a key has a meaning."""

NETWORKS = tuple(word for word, engine in ENGINES.items() if not engine.composite)

MEANING: Mapping[str, Needs] = {
    "contacts.rule": {"conduction.engine": NETWORKS},
    "contacts.contact_angle": {"conduction.engine": NETWORKS, "contacts.rule": ("bonded", "coordination")},
    "contacts.bond_gap": {"conduction.engine": NETWORKS, "contacts.rule": ("bonded",)},
    "contacts.coordination": {"conduction.engine": NETWORKS, "contacts.rule": ("coordination",)},
    "contacts.contact_resistance": {"conduction.engine": NETWORKS},
    "conduction.angle_curve": {"conduction.engine": ("dtem",)},
    "conduction.resolution": {"conduction.engine": ("voxel",)},
    "conduction.particles": {"conduction.engine": ("lattice",)},
    "packing.count": {"packing.method": ("lubachevsky-stillinger", "random-sequential")},
    "packing.growth_rate": {"packing.method": ("lubachevsky-stillinger",)},
}
"""The keys that do not always have a meaning."""


def _get(study: StudyTable, place: str) -> Any:
    found: Any = study
    for key in place.split("."):
        found = getattr(found, key)
    return found


def meaningless(study: StudyTable) -> Iterator[tuple[str, str]]:
    """Places of the keys without a meaning in this study, and the choice that takes it from them, in words."""
    for place, needs in MEANING.items():
        for choice, words in needs.items():
            if _get(study, choice) not in words:
                yield place, f"{choice.rpartition('.')[2]} = {_get(study, choice)!r}"
                break


def refuse_meaningless(study: StudyTable) -> None:
    """Refuse a key that is given and has no meaning; its default may stand.

    Raises
    ------
    ValueError
    """
    for place, choice in meaningless(study):
        table, key = place.split(".")
        holder = getattr(study, table)
        if key in holder.model_fields_set and getattr(holder, key) != type(holder).model_fields[key].default:
            raise ValueError(f"{place}: has no meaning with {choice}, take it out")


def drop_meaningless(study: StudyTable, values: dict[str, Any]) -> dict[str, Any]:
    """The plain values of a study less the keys without a meaning."""
    for place, _ in meaningless(study):
        table, key = place.split(".")
        values[table].pop(key, None)
    return values
