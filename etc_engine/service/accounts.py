"""Who else could reach a service: accounts of this machine, and the rights it is served with."""

from __future__ import annotations

import os
import pwd
from pathlib import Path

from etc_engine.service.settings import Settings

FIRST_PERSON, NOBODY = 1000, 65534
"""User numbers of people begin here (Debian, Red Hat); the account that owns nothing."""
NO_LOGIN = ("nologin", "false", "sync")


def exposures(settings: Settings) -> list[str]:
    """What may be unwise about how a service is started, a line each."""
    found = []
    if os.geteuid() == 0:
        found.append("serving as root: studies run with all rights; start the service as an ordinary user")
    others = other_accounts()
    if not settings.token and others:
        who = others[0] if len(others) == 1 else f"{others[0]} and {len(others) - 1} more"
        found.append(f"no token: other accounts of this machine ({who}) can use the service; see --token-file")
    return found


def other_accounts() -> list[str]:
    """Names of other people who can log in on this machine, as far as its table of accounts shows them."""
    return sorted(
        entry.pw_name
        for entry in pwd.getpwall()
        if entry.pw_uid not in (os.geteuid(), NOBODY)
        and entry.pw_uid >= FIRST_PERSON
        and Path(entry.pw_shell).name not in NO_LOGIN
    )
