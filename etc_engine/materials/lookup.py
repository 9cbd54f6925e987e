"""A solid by its name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from etc_engine.errors import InputError
from etc_engine.materials.solid import Solid, solid_from_table
from etc_engine.materials.solids import SOLIDS

CATALOGUE: Mapping[str, Solid] = MappingProxyType({solid.name: solid for solid in SOLIDS})

ALIASES: Mapping[str, str] = MappingProxyType(
    {
        "al2o3": "alumina",
        "sio2": "fused silica",
        "glass": "soda-lime glass",
        "ss304": "stainless steel 304",
        "ss316": "stainless steel 316",
        "steel": "carbon steel",
        "cu": "copper",
        "al": "aluminium",
        "aluminum": "aluminium",
        "sic": "silicon carbide",
        "lithium titanate": "Li2TiO3",
        "ti64": "Ti-6Al-4V",
    }
)


def find_solid(name: str | Mapping[str, Any]) -> Solid:
    """Return the solid of that name, or of the user's own table (see `etc_engine.materials.solid_from_table`).

    In names case, spaces, hyphens and underscores do not matter.

    Raises
    ------
    InputError
        If there is none; the message offers names that resemble it.

    Examples
    --------
    >>> find_solid("SS316").name, find_solid("ti-6al-4v").name
    ('stainless steel 316', 'Ti-6Al-4V')
    >>> float(find_solid({"temperature": [300, 500], "conductivity": [2.0, 1.0]}).conductivity.at(400.0))
    1.5
    """
    if isinstance(name, Mapping):
        return solid_from_table("the material", name)
    wanted = _plain(name)
    known = {_plain(key): key for key in CATALOGUE} | {_plain(key): value for key, value in ALIASES.items()}
    if wanted in known:
        return CATALOGUE[known[wanted]]
    close = difflib.get_close_matches(wanted, known, n=3, cutoff=0.6)
    offers = list(dict.fromkeys(known[key] for key in close))
    hint = f"did you mean {' or '.join(offers)}?" if offers else f"there are: {', '.join(CATALOGUE)}."
    raise InputError(
        f"there is no material named {name!r}; {hint} Or give a table: {{ temperature = [..], conductivity = [..] }}"
    )


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())
