"""A solid by its name."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from types import MappingProxyType

from etc_engine.errors import InputError
from etc_engine.materials.solid import Solid
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


def find_solid(name: str) -> Solid:
    """Return the solid of that name; case, spaces, hyphens and underscores do not matter.

    Raises
    ------
    InputError
        If there is none; the message offers names that resemble it.

    Examples
    --------
    >>> find_solid("SS316").name, find_solid("ti-6al-4v").name
    ('stainless steel 316', 'Ti-6Al-4V')
    """
    wanted = _plain(name)
    known = {_plain(key): key for key in CATALOGUE} | {_plain(key): value for key, value in ALIASES.items()}
    if wanted in known:
        return CATALOGUE[known[wanted]]
    close = difflib.get_close_matches(wanted, known, n=3, cutoff=0.6)
    offers = list(dict.fromkeys(known[key] for key in close))
    hint = f"did you mean {' or '.join(offers)}?" if offers else f"there are: {', '.join(CATALOGUE)}"
    raise InputError(
        f"there is no material named {name!r}; {hint} Or give a table: {{ temperature = [..], conductivity = [..] }}"
    )


def _plain(name: str) -> str:
    return "".join(c for c in name.lower() if c.isalnum())
