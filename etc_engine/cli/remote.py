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
        "--token-file", type=click.Path(path_type=Path), help="File with the token; or ETC_ENGINE_TOKEN."
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


def progress_of(study: dict[str, Any]) -> str:
    """A study's state as one line.

    Examples
    --------
    >>> progress_of({"id": "7f", "name": "a", "state": "running", "done": 3, "planned": 8, "reason": ""})
    '7f  running    3/8  a'
    """
    reason = f"  ({study['reason']})" if study["reason"] else ""
    return f"{study['id']}  {study['state']:9s}  {study['done']}/{study['planned']}  {study['name']}{reason}"
