"""Names and addresses of hosts."""

from __future__ import annotations

import ipaddress

LOOPBACK = ("127.0.0.1", "::1", "localhost")


def is_address(name: str) -> bool:
    """Whether a host is given by its address.

    Examples
    --------
    >>> is_address("192.0.2.1"), is_address("::1"), is_address("localhost")
    (True, True, False)
    """
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_loopback(host: str) -> bool:
    """Whether a host is this machine and no other can reach it."""
    return ipaddress.ip_address(host).is_loopback if is_address(host) else host in LOOPBACK
