"""The client: a few functions that speak to the service and return datasets; the standard library is all they need.

::

    from etc_engine.service.client import Server, fetch, submit, wait

    server = Server("http://127.0.0.1:8765")
    study = submit(server, open("study.toml").read())
    wait(server, study["id"])
    print(fetch(server, study["id"]).conductivity_mean)
"""

from __future__ import annotations

import json
import re
import tempfile
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from http.client import HTTPException
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from etc_engine.durable.files import replacing
from etc_engine.errors import InputError, OutputError
from etc_engine.service.addresses import is_address

if TYPE_CHECKING:
    import xarray

IDENTITY = "expected 16 hexadecimal digits, the identity that submit and status print"
ENDED = ("done", "failed", "cancelled")
CHUNK = 1 << 20
PATIENCE = 120.0
"""Seconds that a service may be away, to be started again, say, before nobody waits for it any more."""
Told = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Server:
    """Address and credentials of a service.

    Parameters
    ----------
    url : str
        Such as ``http://127.0.0.1:8765``.
    token : str
        Empty where the service asks for none. It travels in the header Authorization: over http anyone on the way
        can read it, so use https beyond this machine.
    timeout : float [s]

    Notes
    -----
    The proxy of the environment (``https_proxy``) is used for https and a host with a name only. Over http it could
    read the token and the study, and an address names the machine to speak to.
    """

    url: str
    token: str = field(default="", repr=False)
    timeout: float = 60.0

    def __post_init__(self) -> None:
        parts = urllib.parse.urlsplit(self.url)
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.username or parts.query:
            raise InputError(f"server {self.url!r}: expected an address such as http://127.0.0.1:8765")


def submit(server: Server, study: str | Mapping[str, Any]) -> dict[str, Any]:
    """Hand in a study: the text of a study file, or the same as a mapping. Returns its status, with its ``id``.

    Raises
    ------
    InputError
        If the service refuses it, in the service's words.
    OutputError
        If the service cannot be reached or fails.
    """
    if isinstance(study, str):
        return _json(server, "POST", "/api/studies", study.encode(), "application/toml")
    return _json(server, "POST", "/api/studies", json.dumps(study).encode(), "application/json")


def status(server: Server, study: str) -> dict[str, Any]:
    """State, progress and the end of the log of a study."""
    return _json(server, "GET", f"/api/studies/{_identity(study)}")


def studies(server: Server) -> list[dict[str, Any]]:
    """All studies, the newest first."""
    found: list[dict[str, Any]] = _json(server, "GET", "/api/studies?limit=10000")["studies"]
    return found


def wait(
    server: Server, study: str, *, tell: Told | None = None, interval: float = 2.0, patience: float = PATIENCE
) -> dict[str, Any]:
    """Wait until a study is done, failed or cancelled; ``tell`` is called with every status on the way.

    Raises
    ------
    OutputError
        If the service has not answered for ``patience`` seconds.
    """
    answered = time.monotonic()
    while True:
        try:
            found = status(server, study)
        except OutputError as error:
            if time.monotonic() - answered > patience:
                again = f"the study continues; ask again with: etc-engine fetch {study} -o result.nc"
                raise OutputError(f"{error} No answer for {patience:g} s; {again}") from None
        else:
            answered = time.monotonic()
            if tell is not None:
                tell(found)
            if found["state"] in ENDED:
                return found
        time.sleep(interval)


def cancel(server: Server, study: str) -> dict[str, Any]:
    """End a study; what is finished is kept."""
    return _json(server, "POST", f"/api/studies/{_identity(study)}/cancel", b"")


def resume(server: Server, study: str) -> dict[str, Any]:
    """Go on with a cancelled or failed study."""
    return _json(server, "POST", f"/api/studies/{_identity(study)}/resume", b"")


def remove(server: Server, study: str) -> None:
    """Forget a study that does not run, with all its files."""
    _open(server, "DELETE", f"/api/studies/{_identity(study)}").close()


def fetch(server: Server, study: str, output: Path | None = None) -> xarray.Dataset:
    """The result of a study that is done, as a dataset; with ``output`` also as a netCDF file.

    Raises
    ------
    InputError
        If the study is not done.
    OutputError
        If the file cannot be written.
    """
    from etc_engine.sweep.result_file import open_dataset

    if output is not None:
        download(server, study, output)
        return open_dataset(output)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "result.nc"
        download(server, study, path)
        return open_dataset(path)


def download(server: Server, study: str, output: Path, part: str = "result.nc") -> None:
    """Write the result (or ``report.html``) of a study to a file, whole and undamaged or not at all."""
    with (
        replacing(output) as draft,
        _open(server, "GET", f"/api/studies/{_identity(study)}/{part}") as reply,
        draft.open("wb") as file,
    ):
        expected = int(reply.headers.get("content-length", -1))  # type: ignore[attr-defined]
        while block := reply.read(CHUNK):
            file.write(block)
        if expected not in (-1, file.tell()):
            raise OutputError(f"{server.url} broke off after {file.tell()} of {expected} bytes: try again")
        file.flush()
        if part == "result.nc":
            _verify(draft, output)


def _verify(draft: Path, output: Path) -> None:
    """Refuse a result that was damaged on its way, or before."""
    from etc_engine.sweep.result_file import open_dataset

    try:
        open_dataset(draft)
    except OutputError as error:
        raise OutputError(str(error).replace(str(draft), f"{output} as it came")) from None


def solve(server: Server, particles: bytes, **options: Any) -> dict[str, Any]:
    """Conductivity of the particles in a file of any format that is read, given as its bytes.

    The options are those of ``etc-engine solve``, with underscores: ``box="1,1"``, ``contact_angle=5.0``, ...
    """
    query = urllib.parse.urlencode({key: value for key, value in options.items() if value is not None})
    return _json(server, "POST", f"/api/solve?{query}", particles, "application/octet-stream", timeout=600.0)


def models(server: Server) -> list[dict[str, Any]]:
    """The catalogue of conductivity models."""
    found: list[dict[str, Any]] = _json(server, "GET", "/api/models")["models"]
    return found


def evaluate(server: Server, model: str, **inputs: Any) -> dict[str, Any]:
    """The conductivity by a model: ``k1``, ``k2``, ``fraction``, ``dimension`` and its further inputs by name."""
    common = {key: inputs.pop(key) for key in ("k1", "k2", "fraction", "dimension") if key in inputs}
    values = {key: str(value) if value in (float("inf"),) else value for key, value in common.items()}
    body = json.dumps({**values, "parameters": inputs}).encode()
    return _json(server, "POST", f"/api/models/{_safe(model)}", body, "application/json")


def _identity(study: str) -> str:
    if not re.fullmatch("[0-9a-f]{16}", study):
        raise InputError(f"study {study[:80]!r}: {IDENTITY}")
    return study


def _safe(word: str) -> str:
    return urllib.parse.quote(word, safe="")


def _json(
    server: Server, method: str, path: str, body: bytes | None = None, kind: str = "", timeout: float | None = None
) -> dict[str, Any]:
    with _open(server, method, path, body, kind, timeout) as answer:
        try:
            values = json.load(answer)
        except (ValueError, OSError, HTTPException):
            values = None
    if not isinstance(values, dict):
        raise OutputError(f"{server.url} is not an etc-engine service: is the address right?")
    return values


def _open(
    server: Server, method: str, path: str, body: bytes | None = None, kind: str = "", timeout: float | None = None
) -> IO[bytes]:
    """An answer, to be closed; refusals and failures are raised."""
    headers = {"Accept": "application/json, */*"}
    if kind:
        headers["Content-Type"] = kind
    if server.token:
        headers["Authorization"] = f"Bearer {server.token}"
    request = urllib.request.Request(server.url.rstrip("/") + path, body, headers, method=method)
    proxies: dict[str, str] | None = {} if _is_direct(server.url) else None  # None: those of the environment
    opener = urllib.request.build_opener(urllib.request.ProxyHandler(proxies), _NoRedirect)
    try:
        answer: IO[bytes] = opener.open(request, timeout=timeout or server.timeout)
    except urllib.error.HTTPError as error:
        with error:
            reason = _reason(error)
        if 400 <= error.code < 500:
            raise InputError(reason) from None
        raise OutputError(reason) from None
    except (OSError, HTTPException, ValueError) as error:
        why = getattr(error, "reason", None) or error
        why = getattr(why, "strerror", None) or why
        raise OutputError(f"{server.url} does not answer ({why}): is the service running there?") from None
    return answer


def _is_direct(url: str) -> bool:
    """Whether a service is asked without a proxy.

    Examples
    --------
    >>> _is_direct("http://node7:8765"), _is_direct("https://[::1]:8765"), _is_direct("https://etc.example.org")
    (True, True, False)
    """
    parts = urllib.parse.urlsplit(url)
    return parts.scheme == "http" or is_address(parts.hostname or "") or parts.hostname == "localhost"


def _reason(error: urllib.error.HTTPError) -> str:
    try:
        values = json.load(error)
        return str(values["error"])
    except (ValueError, KeyError, TypeError, OSError):
        return f"the server returned {error.code} {error.reason}: is the address right?"


class _NoRedirect(urllib.request.HTTPRedirectHandler):
    """A redirect would carry the token to another place."""

    def redirect_request(self, *_: Any) -> None:
        """Follow none: the answer counts as an error."""
