"""No one where they don't belong: hosts, origins, tokens, sizes, names."""

from __future__ import annotations

import http.client
import json
import logging
import socket
import statistics
import threading
import time
from pathlib import Path

import pytest
from serving import STUDY, Service, ask, until

from etc_engine.errors import InputError
from etc_engine.service import client
from etc_engine.service.guard import OPEN, Guard
from etc_engine.service.settings import Settings

TOKEN = "correct-horse-battery-staple"


@pytest.fixture(scope="module")
def closed(tmp_path_factory):
    """A service that asks for a token, open to all addresses of this machine."""
    options = {"token": TOKEN, "host": "0.0.0.0", "hosts": ["etc.example.org"], "limits": {"upload_bytes": 200_000}}
    with Service(tmp_path_factory.mktemp("closed") / "data", options, slow=True) as running:
        running.url = running.url.replace("0.0.0.0", "127.0.0.1")
        yield running


def raw(service: Service, request: bytes) -> bytes:
    """The beginning of the answer to bytes that no client library would send."""
    with socket.create_connection(("127.0.0.1", int(service.url.rsplit(":", 1)[1])), timeout=20) as connection:
        connection.sendall(request)
        return connection.recv(65536)


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8765", 200),
        ("localhost", 200),
        ("LOCALHOST:1", 200),
        ("[::1]:8765", 200),
        ("rebound.example.org", 421),
        ("127.0.0.1.example.org", 421),
        ("localhost.example.org:8765", 421),
        ("192.168.1.7", 421),
        ("", 421),
    ],
)
def test_only_names_of_this_machine_are_answered(service, host, status):
    """DNS rebinding: the browser believes to talk to another site, and says so in the header."""
    assert ask(f"{service.url}/api/studies", Host=host)[0] == status


@pytest.mark.parametrize(
    ("host", "status"), [("etc.example.org", 200), ("127.0.0.1", 200), ("10.1.2.3:80", 200), ("other.example.org", 421)]
)
def test_a_proxy_brings_its_name(closed, host, status):
    assert ask(f"{closed.url}/api/studies", Host=host, Authorization=f"Bearer {TOKEN}")[0] == status


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 422),  # no page at all: reaches the study, which is empty
        ({"Origin": "{url}"}, 422),
        ({"Origin": "{url}", "Sec_Fetch_Site": "same-origin"}, 422),
        ({"Origin": "https://evil.example.org"}, 403),
        ({"Origin": "null"}, 403),
        ({"Origin": "http://localhost:1"}, 403),
        ({"Sec_Fetch_Site": "cross-site"}, 403),
        ({"Sec_Fetch_Site": "same-site"}, 403),
    ],
)
def test_pages_of_other_sites_change_nothing(service, headers, status):
    filled = {name: value.format(url=service.url) for name, value in headers.items()}
    assert ask(f"{service.url}/api/studies", "POST", b"", **filled)[0] == status


@pytest.mark.parametrize(
    "header",
    [None, "", "Bearer", "Bearer ", f"Bearer {TOKEN}x", f"Bearer {TOKEN[:-1]}", f"Basic {TOKEN}", TOKEN, "Bearer \xff"],
)
def test_without_the_token_there_is_only_the_page(closed, header):
    headers = {} if header is None else {"Authorization": header}
    for path in (
        "/api/studies",
        "/api/service",
        "/openapi.json",
        "/api/models",
        "/api/nothing",
        f"/api/studies?token={TOKEN}",
    ):
        status, answered, body = ask(closed.url + path, **headers)
        assert (status, answered["www-authenticate"]) == (401, "Bearer")
        wrong = header is not None and header.startswith("Bearer ") and len(header) > len("Bearer ")
        assert json.loads(body)["error"].startswith("the token is wrong" if wrong else "a token is needed")
    assert ask(f"{closed.url}/api/solve", "POST", b"x", **headers)[0] == 401
    for path in OPEN:
        assert ask(closed.url + path)[0] == 200
    assert ask(f"{closed.url}/api/studies", Authorization=f"Bearer {TOKEN}")[0] == 200


def test_the_token_is_compared_in_constant_time():
    """Every byte right but the last takes as long as every byte wrong: medians of interleaved blocks."""
    guard = Guard(None, Settings(Path("data"), token="k" * 4096))
    wrong, near = "Bearer " + "x" * 4096, "Bearer " + "k" * 4095 + "x"
    times = {wrong: [], near: []}
    for _ in range(60):
        for header, taken in times.items():
            began = time.perf_counter()
            for _ in range(50):
                assert not guard._authorized(header)
            taken.append(time.perf_counter() - began)
    assert statistics.median(times[near]) == pytest.approx(statistics.median(times[wrong]), rel=0.5)


def test_no_log_and_no_error_has_the_token(closed, caplog):
    with caplog.at_level(logging.DEBUG):
        server = client.Server(closed.url, TOKEN)
        client.submit(server, STUDY)
        with pytest.raises(InputError) as caught:
            client.submit(server, "x")
    found = [closed.said(), str(caught.value), repr(server), caplog.text]
    found += [path.read_text(errors="replace") for path in closed.data.rglob("*") if path.is_file()]
    assert not any(TOKEN in text for text in found)


def test_the_client_takes_the_token_nowhere_else(closed):
    """A redirect is not followed, so that the header goes to no other place."""
    with pytest.raises(InputError, match="a token is needed"):
        client.studies(client.Server(closed.url))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(20)
        port = listener.getsockname()[1]

        def redirect() -> None:
            connection, _ = listener.accept()
            with connection:
                connection.recv(65536)
                connection.sendall(
                    f"HTTP/1.1 302 Found\r\nLocation: {closed.url}/api/studies\r\nContent-Length: 0\r\n\r\n".encode()
                )

        thread = threading.Thread(target=redirect)
        thread.start()
        with pytest.raises(Exception, match="302"):
            client.studies(client.Server(f"http://127.0.0.1:{port}", TOKEN))
        thread.join()


def test_long_bodies_are_refused_early(closed):
    authorized = {"Authorization": f"Bearer {TOKEN}"}
    assert ask(f"{closed.url}/api/studies", "POST", b"#" * 70_000, **authorized)[0] == 413
    assert ask(f"{closed.url}/api/solve?box=1,1", "POST", b"#" * 100_000, **authorized)[0] == 422
    assert ask(f"{closed.url}/api/models/maxwell", "POST", b" " * 70_000, **authorized)[0] == 413
    head = f"POST /api/studies HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {TOKEN}\r\n"
    announced = raw(closed, f"{head}Content-Length: 99999999999\r\n\r\nx".encode())
    assert announced.startswith(b"HTTP/1.1 413")
    chunk = b"8000\r\n" + b"#" * 0x8000 + b"\r\n"
    unannounced = raw(closed, f"{head}Transfer-Encoding: chunked\r\n\r\n".encode() + 4 * chunk + b"0\r\n\r\n")
    assert unannounced.startswith(b"HTTP/1.1 413")


@pytest.mark.parametrize("path", ["/api/solve?box=1,1", "/api/studies", "/api/models/maxwell"])
def test_an_upload_that_breaks_off_is_no_news(service, path):
    before = service.said()
    with socket.create_connection(("127.0.0.1", int(service.url.rsplit(":", 1)[1])), timeout=20) as connection:
        connection.sendall(f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9000\r\n\r\nx,y".encode())
        time.sleep(0.2)  # until the service waits for the rest
    time.sleep(0.3)
    assert ask(f"{service.url}/api/studies")[0] == 200
    assert service.said() == before


def test_answers_forbid_what_a_page_does_not_need(service):
    for path in ("/", "/api/studies", "/api/nothing", "/page/app.js"):
        headers = {name.lower(): value for name, value in ask(service.url + path)[1].items()}
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert "script-src 'self'" in headers["content-security-policy"]
        assert "access-control-allow-origin" not in headers
        assert "server" not in headers


def test_names_from_users_are_no_paths(service):
    before = {path for path in service.data.parent.rglob("*") if path.is_file()}
    text = STUDY.replace('name = "served"', 'name = "../../../escaped <script>"')
    study = client.wait(service.server, client.submit(service.server, text)["id"], interval=0.05)
    assert study["state"] == "done"
    particles = b"x,y,radius\n0.5,0.5,0.5\n"
    headers = {"Content_Disposition": 'attachment; filename="../../evil.csv"'}
    assert ask(f"{service.url}/api/solve?box=1,1", "POST", particles, **headers)[0] == 200
    after = {path for path in service.data.parent.rglob("*") if path.is_file()}
    folders = {path.parent for path in after - before}
    assert folders <= {service.data, service.data / "studies" / study["id"]}
    assert not any("escaped" in path.name or "evil" in path.name for path in after)


def test_garbage_on_the_line_leaves_the_service_well(service):
    for bytes_ in (
        b"\x16\x03\x01\x02\x00",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET /" + b"a" * 100_000 + b" HTTP/1.1\r\n\r\n",
    ):
        assert b" 500 " not in raw(service, bytes_)[:64]
    connection = http.client.HTTPConnection(service.url.removeprefix("http://"), timeout=20)
    connection.request("PATCH", "/api/studies")
    assert connection.getresponse().status == 405
    connection.close()
    assert until(lambda: ask(f"{service.url}/api/studies")[0] == 200)
    assert "Traceback" not in service.said()
