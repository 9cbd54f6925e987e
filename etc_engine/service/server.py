"""The server: one process with its HTTP interface and its supervisor, from the first line to the last."""

from __future__ import annotations

import errno
import logging
import signal
import socket
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import FrameType

import uvicorn

from etc_engine.errors import InputError, OutputError
from etc_engine.service.addresses import is_loopback
from etc_engine.service.app import Service, make_app
from etc_engine.service.connections import Connection, Seldom, Server, most_connections
from etc_engine.service.launchers import check_launcher, make_launcher
from etc_engine.service.live import LiveResults
from etc_engine.service.queue import Queue
from etc_engine.service.running import Runner
from etc_engine.service.settings import Settings
from etc_engine.service.store import open_store
from etc_engine.service.supervisor import Supervisor

BACKLOG = 256


def serve(settings: Settings, ready: Callable[[str], None]) -> None:
    """Serve until SIGTERM or SIGINT.

    Parameters
    ----------
    settings : Settings
    ready : callable
        Called with the address once requests are answered.

    Raises
    ------
    InputError
        If another host than this machine's own is to be served without a token, or nothing can be started here.
    OutputError
        If the address is in use, or the data directory is, or that cannot be written.
    """
    check_access(settings)
    check_launcher(settings)
    import xarray  # noqa: F401 - loaded now, so that the first figure does not wait for it

    logging.basicConfig(format="etc-engine: %(message)s", level=logging.WARNING)
    for handler in logging.getLogger().handlers:
        handler.addFilter(Seldom())
    limits = replace(settings.limits, connections=most_connections(settings.limits))
    listener = _listen(settings)
    with listener, open_store(settings.data) as store:
        queue = Queue(store.database, settings.limits.waiting)
        live = LiveResults(store, settings.limits)
        supervisor = Supervisor(store, queue, make_launcher(store, settings), live, settings)
        service = Service(settings, store, queue, live, Runner(store, settings), supervisor.wake)
        config = uvicorn.Config(
            make_app(service),
            log_config=None,
            access_log=False,
            server_header=False,
            lifespan="off",
            timeout_graceful_shutdown=5,
            http=partial(Connection, limits),  # type: ignore[arg-type]
            forwarded_allow_ips="",
        )
        # the server gives signals on to the handlers it found: these let the batches end in order
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, _let_go)
        supervisor.start()
        try:
            ready(address(listener))
            Server(config).run(sockets=[listener])
        finally:
            supervisor.stop()
            queue.close()


def check_access(settings: Settings) -> None:
    """Refuse to open this machine's service to others without a token.

    Examples
    --------
    >>> from pathlib import Path
    >>> check_access(Settings(Path("data"), host="0.0.0.0"))
    Traceback (most recent call last):
    etc_engine.errors.InputError: host 0.0.0.0 can be reached from other machines: give a token ...
    """
    if settings.token:
        return
    keep = "give a token by --token-file or ETC_ENGINE_TOKEN"
    if not is_loopback(settings.host):
        raise InputError(f"host {settings.host} can be reached from other machines: {keep}, or keep to 127.0.0.1")
    if settings.hosts:
        raise InputError(f"the name {settings.hosts[0]} brings requests of other machines here: {keep}")


def _listen(settings: Settings) -> socket.socket:
    """A listening socket; nothing else is touched before there is one."""
    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    # the protocol is named, or asyncio would not switch Nagle's algorithm off: 40 ms an answer
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    try:
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind((settings.host, settings.port))
        listener.listen(BACKLOG)
    except (OSError, OverflowError) as error:
        listener.close()
        where = f"{settings.host} port {settings.port}"
        if getattr(error, "errno", None) == errno.EADDRINUSE:
            raise OutputError(f"{where} is in use by another program: choose another --port") from None
        raise OutputError(f"cannot listen on {where}: {getattr(error, 'strerror', None) or error}") from None
    return listener


def address(listener: socket.socket) -> str:
    """The URL of a listening socket."""
    host, port = listener.getsockname()[:2]
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def _let_go(_number: int, _frame: FrameType | None) -> None:
    """The server has stopped: go on to the end of `serve`."""
