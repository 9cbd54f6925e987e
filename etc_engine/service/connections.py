"""Connections, bounded in number and in time, so that no client keeps others out.

* A connection that waits for a request (idle, or in the middle of its head) is closed after `Limits.idle_seconds`.
* A client that does not read what it asked for is cut off after `STALLED_SECONDS`.
* A client may have `Limits.client_connections`, all together `Limits.connections`; a new one takes the place of the one
  that has waited longest, and is closed itself only if all the others are being served.
"""

from __future__ import annotations

import asyncio
import errno
import logging
import resource
import time
from typing import Any

import uvicorn
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from etc_engine.service.settings import Limits

log = logging.getLogger("etc_engine.service")

LOOK_SECONDS = 2.0
"""How often a connection is looked at, at most."""
STALLED_SECONDS = 120.0
"""Seconds in which a client has to take what is buffered for it."""
HEAD_BYTES = 64 * 1024
"""Largest head of a request."""
OWN_FILES, FILES_PER_CONNECTION = 32, 2
"""File descriptors of the service itself, and of a connection that is being served."""
DESCRIPTORS = 4096
"""File descriptors that the service asks for, where the system lets it."""
OUT_OF = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)
REPEATED_SECONDS = 60.0
"""The same line is logged once in this time."""


class Connection(HttpToolsProtocol):
    """A connection of a client.

    Parameters
    ----------
    limits : Limits
    **uvicorn : Any
        What the server gives to its protocol.
    """

    def __init__(self, limits: Limits, **uvicorn: Any) -> None:
        super().__init__(**uvicorn)
        self._limits = limits
        self._since = self.loop.time()
        self._answered: object = None
        self._paused = 0.0
        self._in_head, self._head_bytes = True, 0
        self._leaving = False
        self._timer: asyncio.TimerHandle | None = None

    @property
    def waits(self) -> bool:
        """Whether no request is being served."""
        return self.cycle is None or self.cycle.response_complete

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take the connection in, or make room for it."""
        super().connection_made(transport)
        host = self.client[0] if self.client else ""
        there: list[Connection] = [one for one in self.connections if not one._leaving]  # type: ignore[union-attr,misc]
        same = [one for one in there if one.client and one.client[0] == host]
        if len(same) > self._limits.client_connections:
            self._make_room(same)
        elif len(there) > self._limits.connections:
            self._make_room(there)
        self._look()

    def _make_room(self, others: list[Connection]) -> None:
        waiting = [one for one in others if one is not self and one.waits]
        leaves = min(waiting, key=lambda one: one._since, default=self)
        leaves._leaving = True
        leaves.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget the connection."""
        if self._timer is not None:
            self._timer.cancel()
        self._leaving = True
        super().connection_lost(exc)

    def _look(self) -> None:
        """Close the connection if it has waited, or kept the service waiting, for too long."""
        now = self.loop.time()
        if not self.waits or self.cycle is not self._answered:
            self._since, self._answered = now, self.cycle
        elif now - self._since > self._limits.idle_seconds:
            self.transport.close()  # what is buffered is still sent
        unread = self.transport.get_write_buffer_size() > 0
        if (self._paused and now - self._paused > STALLED_SECONDS) or (
            self.transport.is_closing() and unread and now - self._since > STALLED_SECONDS
        ):
            self.transport.abort()
        self._timer = self.loop.call_later(min(LOOK_SECONDS, 0.25 * self._limits.idle_seconds), self._look)

    def pause_writing(self) -> None:
        """More is buffered than the client takes."""
        self._paused = self.loop.time()
        super().pause_writing()

    def resume_writing(self) -> None:
        """The client has taken it."""
        self._paused = 0.0
        super().resume_writing()

    def on_message_begin(self) -> None:
        """A request begins."""
        self._in_head, self._head_bytes = True, 0
        super().on_message_begin()

    def on_headers_complete(self) -> None:
        """The head of a request is complete."""
        self._in_head = False
        super().on_headers_complete()

    def data_received(self, data: bytes) -> None:
        """Take in bytes; a head without an end is cut off."""
        super().data_received(data)
        if self._in_head:
            self._head_bytes += len(data)
            if self._head_bytes > HEAD_BYTES and not self.transport.is_closing():
                self.send_400_response("The head of the request is too long.")


class Server(uvicorn.Server):
    """A server that says in one line what its event loop would say in a traceback for every connection."""

    async def serve(self, sockets: Any = None) -> None:
        """Serve until a signal."""
        asyncio.get_running_loop().set_exception_handler(_report)
        await super().serve(sockets)


def _report(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    error = context.get("exception")
    if isinstance(error, OSError) and error.errno in OUT_OF:
        log.error("%s: new connections wait until some are closed; see ulimit -n", error.strerror)
    else:
        loop.default_exception_handler(context)


class Seldom(logging.Filter):
    """Lets a line pass once in `REPEATED_SECONDS`."""

    def __init__(self) -> None:
        super().__init__()
        self._said: dict[str, float] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether the line is new."""
        now, line = time.monotonic(), record.getMessage()
        self._said = {text: moment for text, moment in self._said.items() if now - moment < REPEATED_SECONDS}
        new = line not in self._said
        self._said.setdefault(line, now)
        return new


def most_connections(limits: Limits) -> int:
    """Connections that the file descriptors of this process allow; asks the system for more of them first."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = DESCRIPTORS if hard == resource.RLIM_INFINITY else min(DESCRIPTORS, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))
        soft = wanted
    room = limits.connections if soft == resource.RLIM_INFINITY else (soft - OWN_FILES) // FILES_PER_CONNECTION
    return max(1, min(limits.connections, room))
