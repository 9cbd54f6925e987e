"""The token of a service: a word in a file, or in the environment."""

from __future__ import annotations

import os
import stat
from collections.abc import Mapping
from pathlib import Path

from etc_engine.errors import InputError

VARIABLE = "ETC_ENGINE_TOKEN"
LENGTH = 16


def read_token(path: Path | None, environment: Mapping[str, str] = os.environ) -> str:
    """The token in a file, or else in the environment (ETC_ENGINE_TOKEN); empty if there is none.

    Raises
    ------
    InputError
        If the file cannot be read, or the token is not one word of at least sixteen printable ASCII characters.

    Examples
    --------
    >>> read_token(None, {"ETC_ENGINE_TOKEN": "short"})
    Traceback (most recent call last):
    etc_engine.errors.InputError: the token in ETC_ENGINE_TOKEN: expected one word of at least 16 ASCII characters
    """
    if path is None:
        place, token = VARIABLE, environment.get(VARIABLE, "").strip()
        if not token:
            return ""
    else:
        place = f"file {path}"
        try:
            token = path.read_text(encoding="utf-8").strip()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"token file {path}: cannot be read ({error})") from None
    if len(token) < LENGTH or not token.isascii() or not token.isprintable() or " " in token:
        raise InputError(f"the token in {place}: expected one word of at least {LENGTH} ASCII characters")
    return token


def readable_by_others(path: Path) -> bool:
    """Whether a token file can be read by the group or by everybody on this machine."""
    return bool(path.stat().st_mode & (stat.S_IRGRP | stat.S_IROTH))
