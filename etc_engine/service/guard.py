"""The guard: every request passes it before anything else sees it.

* The Host header has to be one of this service (a page that rebinds its own name to this machine has another).
* A request that changes something has to come from this service's own page, or from no page at all (no forgery).
* Where there is a token, everything but the page itself needs it, in the header Authorization and nowhere else.
* A body may not be longer than its limit, whatever its header says, and has to come in time.
"""

from __future__ import annotations

import asyncio
import hmac
import json
import time
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

from starlette.exceptions import HTTPException

from etc_engine.service.addresses import LOOPBACK, is_address
from etc_engine.service.settings import Limits, Settings

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[Message, Receive, Send], Awaitable[None]]

CHANGING = ("POST", "PUT", "PATCH", "DELETE")
OPEN = ("/", "/page/app.js", "/page/figure.js", "/page/style.css", "/page/icon.svg")
"""The page without any data."""
CLOSING = {"connection": "close"}
"""Header of a refusal that leaves a body unread."""
UPLOADS = ("/api/solve",)
HEADERS = {
    b"x-content-type-options": b"nosniff",
    b"x-frame-options": b"DENY",
    b"referrer-policy": b"no-referrer",
    b"cache-control": b"no-cache",
    b"content-security-policy": (
        b"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
        b"frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
    ),
}


class Guard:
    """ASGI middleware.

    Parameters
    ----------
    app : App
        The application behind it.
    settings : Settings
    """

    def __init__(self, app: App, settings: Settings) -> None:
        self._app, self._settings = app, settings
        self._token = settings.token.encode()

    async def __call__(self, scope: Message, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        headers = {name.decode("latin-1").lower(): value.decode("latin-1") for name, value in scope["headers"]}
        refusal = self._refusal(scope["method"], scope["path"], headers)
        limit = self._settings.limits.upload_bytes if scope["path"] in UPLOADS else self._settings.limits.study_bytes
        length = headers.get("content-length", "0")
        if refusal is None and (not length.isdigit() or int(length) > limit):
            refusal = (413, _too_long(limit))
        if refusal is not None:
            await _answer(send, *refusal)
            return

        async def guarded_send(message: Message) -> None:
            if message["type"] == "http.response.start":
                present = {name.lower() for name, _ in message["headers"]}
                message["headers"] = [*message["headers"], *(h for h in HEADERS.items() if h[0] not in present)]
            await send(message)

        await self._app(scope, _limited(receive, limit, self._settings.limits), guarded_send)

    def _refusal(self, method: str, path: str, headers: dict[str, str]) -> tuple[int, str] | None:
        host = headers.get("host", "")
        if not self.knows_host(host):
            return 421, f"this service does not accept the name {host[:80]!r}: see the option --allow-host"
        origin = headers.get("origin")
        if method in CHANGING and (
            headers.get("sec-fetch-site", "none") not in ("none", "same-origin")
            or (origin is not None and origin.partition("://")[2] != host)
        ):
            return 403, "requests from pages of other sites are refused"
        if self._token and path not in OPEN and not self._authorized(headers.get("authorization", "")):
            return 401, _unknown(headers.get("authorization", ""))
        return None

    def _authorized(self, header: str) -> bool:
        kind, _, shown = header.partition(" ")
        right = hmac.compare_digest(shown.strip().encode(), self._token)
        return right and kind.lower() == "bearer"

    def knows_host(self, header: str) -> bool:
        """Whether a Host header names this service.

        Examples
        --------
        >>> from pathlib import Path
        >>> guard = Guard(None, Settings(Path("data")))
        >>> guard.knows_host("localhost:8765"), guard.knows_host("rebound.example.org:8765")
        (True, False)
        """
        name = host_name(header)
        if name in {*LOOPBACK, self._settings.host, *self._settings.hosts}:
            return True
        return bool(self._token) and is_address(name)  # an address cannot be rebound


def _unknown(header: str) -> str:
    kind, _, shown = header.partition(" ")
    if kind.lower() == "bearer" and shown.strip():
        return "the token is wrong: this service was started with another one"
    return "a token is needed: header 'Authorization: Bearer TOKEN', option --token-file of the commands"


def host_name(header: str) -> str:
    """A Host header without its port.

    Examples
    --------
    >>> host_name("[::1]:8765"), host_name("Node.example.org:80")
    ('::1', 'node.example.org')
    """
    if header.startswith("["):
        return header[1:].partition("]")[0].lower()
    return header.partition(":")[0].lower()


def _limited(receive: Receive, longest: int, limits: Limits) -> Receive:
    """Bytes of a body up to its limit, and in time."""
    began, seen, complete = time.monotonic(), 0, False

    async def guarded() -> Message:
        nonlocal seen, complete
        if complete:  # whoever asks now waits for the client to go away
            return await receive()
        left = began + limits.body_seconds + seen / limits.body_rate - time.monotonic()
        try:
            message = await asyncio.wait_for(receive(), max(left, 0.0))
        except TimeoutError:
            reason = f"the body comes too slowly: {limits.body_rate:g} bytes/s are expected here"
            raise HTTPException(408, reason, CLOSING) from None
        seen += len(message.get("body", b""))
        complete = not message.get("more_body", False)
        if seen > longest:
            raise HTTPException(413, _too_long(longest), CLOSING)
        return message

    return guarded


def _too_long(limit: int) -> str:
    return f"the body is too long: {limit} bytes are allowed here"


async def _answer(send: Send, status: int, reason: str) -> None:
    body = json.dumps({"error": reason, "field": ""}).encode()
    headers = [(b"content-type", b"application/json"), (b"content-length", b"%d" % len(body)), *HEADERS.items()]
    if status == 401:
        headers.append((b"www-authenticate", b"Bearer"))
    if status == 413:
        headers.append((b"connection", b"close"))
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
