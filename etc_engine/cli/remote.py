"""What the commands that speak to a service share."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from etc_engine.service.client import Server

F = TypeVar("F", bound=Callable[..., Any])


def server_options(command: F) -> F:
    """The options ``--server`` and ``--token-file``."""
    token = click.option(
        "--token-file",
        type=click.Path(path_type=Path),
        help="File with the token. By default ETC_ENGINE_TOKEN holds it.",
    )
    default = "http://127.0.0.1:8765"
    server = click.option(
        "--server", default=default, show_default=True, envvar="ETC_ENGINE_SERVER", help="The service."
    )
    return server(token(command))


def connect(server: str, token_file: Path | None) -> Server:
    """The server that the options name."""
    from etc_engine.service.client import Server
    from etc_engine.service.token import read_token

    return Server(server, read_token(token_file, os.environ))


NAME_LENGTH = 60


def progress_of(study: dict[str, Any]) -> str:
    """A study's state as one line.

    Examples
    --------
    >>> progress_of({"id": "7f", "name": "a", "state": "running", "done": 3, "planned": 8, "reason": ""})
    '7f  running    3/8  a'
    >>> progress_of({"id": "7f", "name": "a", "state": "done", "done": 8, "planned": 8, "failed_cells": 4})
    '7f  done       8/8  a  (4 cells failed)'
    """
    state = "cancelling" if study.get("cancelling") else study["state"]
    failed, reason = study.get("failed_cells", 0), study.get("reason", "")
    remarks = [f"{failed} cell{'s' * (failed != 1)} failed"] if failed else []
    if reason and reason != study["state"]:
        remarks.append(shown(reason))
    remark = f"  ({'; '.join(remarks)})" if remarks else ""
    return f"{study['id']}  {state:9s}  {study['done']}/{study['planned']}  {shown(study['name'], NAME_LENGTH)}{remark}"


def shown(text: str, length: int = 0) -> str:
    """Text of other people, fit for a terminal: control characters are escaped, long texts are cut.

    Examples
    --------
    >>> print(shown("a" + chr(27) + "[2J"), shown("abcdef", 4))
    a\\x1b[2J abc…
    """
    plain = "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in text)
    return f"{plain[: length - 1]}…" if 0 < length < len(plain) else plain
