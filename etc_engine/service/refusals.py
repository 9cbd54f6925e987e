"""Bodies and refusals of the HTTP interface: accepted bodies, and every error as one line of JSON."""

from __future__ import annotations

import difflib
import errno
import json
import logging
import sqlite3
from collections import Counter
from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect

from etc_engine.errors import EtcError, InputError, StudyError
from etc_engine.particle_files.formats import FORMATS
from etc_engine.service.admission import field_of, toml_of
from etc_engine.service.client import IDENTITY
from etc_engine.service.held import EngineError
from etc_engine.service.messages import Problem
from etc_engine.service.running import BusyError
from etc_engine.study.sweep import EXAMPLE

log = logging.getLogger("etc_engine.service")

STUDY_BODY = {
    "requestBody": {
        "required": True,
        "description": "a study, as TOML or as JSON of the same structure",
        "content": {
            "application/toml": {"schema": {"type": "string"}, "example": toml_of(EXAMPLE)},
            "application/json": {"schema": {"type": "object"}, "example": EXAMPLE},
        },
    }
}
PARTICLES_EXAMPLE = "x,y,radius\n0.25,0.5,0.26\n0.75,0.5,0.26\n"
PARTICLES_BODY = {
    "requestBody": {
        "required": True,
        "description": f"{', '.join(kind.name for kind in FORMATS)}; text may be compressed by gzip or Zstandard",
        "content": {
            "text/csv": {"schema": {"type": "string"}, "example": PARTICLES_EXAMPLE},
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
        },
    }
}
EXPECTED = 'expected an object such as {"k1": 1.0, "k2": 10.0, "fraction": 0.3} as application/json'
REFUSALS: dict[int | str, dict[str, Any]] = {
    400: {"model": Problem, "description": "the body cannot be read"},
    401: {"model": Problem, "description": "a token is needed"},
    403: {"model": Problem, "description": "from a page of another site"},
    404: {"model": Problem, "description": "there is no such study, model or file"},
    409: {"model": Problem, "description": "not in this state"},
    408: {"model": Problem, "description": "too slow"},
    413: {"model": Problem, "description": "too long"},
    422: {"model": Problem, "description": "refused, in the words of the command line"},
    429: {"model": Problem, "description": "too many requests of this kind are waiting"},
    503: {"model": Problem, "description": "another program holds the queue, or out of file descriptors"},
}


def add_refusals(app: FastAPI) -> None:
    """Answer every exception of an application in JSON."""
    app.add_exception_handler(RequestValidationError, _refuse_parameter)
    app.add_exception_handler(HTTPException, _refuse_request)
    app.add_exception_handler(ClientDisconnect, _say_nothing)
    app.add_exception_handler(EtcError, _refuse_input)
    app.add_exception_handler(OSError, _report_failure)
    app.add_exception_handler(sqlite3.Error, _report_failure)
    app.add_exception_handler(Exception, _report_failure)


def refuse_unknown_query(request: Request) -> None:
    """Refuse options in the query that the route does not know, or that are given twice: nothing is ignored.

    Raises
    ------
    InputError
    """
    known = [parameter.alias for parameter in request.scope["route"].dependant.query_params]
    given = [name for name, _ in request.query_params.multi_items()]
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean {near[0]!r}?" if near else f"allowed: {', '.join(known) or 'none here'}"
            raise InputError(f"unknown option {name[:80]!r} in the query, {hint}")
        if given.count(name) > 1:
            raise InputError(f"the option {name!r} is given twice in the query, expected once")


def distinct_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object whose keys are all different, for ``json.loads``.

    Examples
    --------
    >>> json.loads('{"k1": 1, "k1": 2}', object_pairs_hook=distinct_keys)
    Traceback (most recent call last):
    etc_engine.errors.InputError: the key 'k1' is given twice in a JSON object, expected once
    """
    found = dict(pairs)
    if len(found) < len(pairs):
        twice = next(name for name, count in Counter(name for name, _ in pairs).items() if count > 1)
        raise InputError(f"the key {twice[:80]!r} is given twice in a JSON object, expected once")
    return found


async def refuse_repeated_keys(request: Request) -> None:
    """Refuse a JSON body in which one key hides another.

    Raises
    ------
    InputError
    """
    try:
        json.loads(await request.body(), object_pairs_hook=distinct_keys)
    except InputError:
        raise
    except (ValueError, RecursionError):  # no JSON at all: refused where the body is read
        return


def _problem(status: int, error: str, field: str = "", headers: Mapping[str, str] | None = None) -> JSONResponse:
    return JSONResponse({"error": " ".join(error.split()), "field": field}, status, headers)


def _refuse_input(request: Request, error: Exception) -> Response:
    if _disk_is_full(error):
        return _report_failure(request, error)
    if isinstance(error, EngineError):
        log.error("%s", error)
        return _problem(500, str(error))
    if isinstance(error, BusyError):
        return _problem(429, str(error))
    return _problem(422, str(error), field_of(str(error)) if isinstance(error, StudyError) else "")


def _say_nothing(_request: Request, _error: Exception) -> Response:
    """The client has gone in the middle of its upload: nobody reads the answer."""
    return Response(status_code=400)


def _refuse_request(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    reason = str(error.detail)
    if reason == "Not Found":
        reason = f"there is nothing at {request.url.path[:200]}"
    if error.status_code == 400:
        reason = f"the body cannot be read as JSON; {EXPECTED}"
    return _problem(error.status_code, reason, headers=error.headers)


def _refuse_parameter(_request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    field = ".".join(str(step) for step in first["loc"][1:])
    if first["type"] == "json_invalid":
        return _problem(422, f"the body is not valid JSON: {first['ctx']['error']} at character {field}; {EXPECTED}")
    if first["loc"] == ("body",):
        return _problem(422, f"the body is not a JSON object, or not said to be one by its Content-Type; {EXPECTED}")
    if first["loc"] == ("path", "study"):
        return _problem(422, f"study {str(first['input'])[:80]!r}: {IDENTITY}")
    return _problem(422, f"{field or 'body'}: {first['msg']}", field)


def _disk_is_full(error: Exception) -> bool:
    return isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT)


def _report_failure(_request: Request, error: Exception) -> Response:
    if _disk_is_full(error) or (isinstance(error, sqlite3.Error) and "full" in str(error)):
        return _problem(507, "the disk of the service is full: nothing was changed, try again when there is room")
    if isinstance(error, sqlite3.OperationalError) and "locked" in str(error):
        return _problem(503, "another program holds the queue of the service: nothing was changed, try again later")
    if isinstance(error, OSError) and error.errno in (errno.EMFILE, errno.ENFILE):
        log.error("%s: requests are refused until some are closed; see ulimit -n", error.strerror)
        return _problem(503, "the service is out of file descriptors: nothing was changed, try again later")
    log.error("unexpected %s: %s", type(error).__name__, error, exc_info=error)
    return _problem(500, f"unexpected {type(error).__name__} in the service, see its log")
