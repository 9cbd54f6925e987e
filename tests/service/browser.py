"""A real browser, headless: Chromium driven through chromedriver's own protocol (W3C WebDriver), nothing to install."""

from __future__ import annotations

import base64
import json
import re
import shutil
import socket
import subprocess
import time
import urllib.parse
import urllib.request
from pathlib import Path
from typing import Any

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
MISSING = "" if CHROMIUM and DRIVER else "needs chromium and chromedriver (Debian: chromium, chromium-driver)"
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--hide-scrollbars",
)


class Browser:
    """One window; use as a context manager."""

    def __init__(self, folder: Path, width: int = 1280, height: int = 900) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        self._driver = subprocess.Popen(
            [DRIVER, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._base = f"http://127.0.0.1:{port}"
        self._host = ""
        self._wait_for_driver()
        flags = [*FLAGS, f"--window-size={width},{height}", f"--user-data-dir={folder / 'profile'}"]
        options = {"binary": CHROMIUM, "args": flags, "prefs": {"download.default_directory": str(folder)}}
        always = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        answer = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": always}})
        self._base += f"/session/{answer['sessionId']}"

    def _wait_for_driver(self) -> None:
        deadline = time.monotonic() + 30.0
        while True:
            try:
                self._ask("GET", "/status")
                return
            except OSError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.05)

    def _ask(self, method: str, path: str, values: dict[str, Any] | None = None) -> Any:
        body = json.dumps(values or {}).encode() if method == "POST" else None
        request = urllib.request.Request(self._base + path, body, {"Content-Type": "application/json"}, method=method)
        with urllib.request.urlopen(request, timeout=60) as answer:
            return json.load(answer)["value"]

    def open(self, url: str) -> None:
        """Go to a page; what the console has of the page before is no longer of interest."""
        self._ask("POST", "/se/log", {"type": "browser"})
        self._host = urllib.parse.urlsplit(url).netloc
        self._ask("POST", "/url", {"url": url})

    def run(self, script: str, *arguments: Any) -> Any:
        """What a script returns."""
        return self._ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def find(self, selector: str) -> str:
        """The element of a selector, waited for."""
        deadline = time.monotonic() + 20.0
        while not (found := self._ask("POST", "/elements", {"using": "css selector", "value": selector})):
            assert time.monotonic() < deadline, f"no {selector} on the page: {self.text('body')[:800]}"
            time.sleep(0.05)
        return found[0][ELEMENT]

    def text(self, selector: str) -> str:
        return self.run("const e = document.querySelector(arguments[0]); return e ? e.innerText : ''", selector)

    def click(self, selector: str) -> None:
        self._ask("POST", f"/element/{self.find(selector)}/click")

    def write(self, selector: str, text: str) -> None:
        """Type into a field, in place of what is there."""
        element = self.find(selector)
        self._ask("POST", f"/element/{element}/clear")
        self._ask("POST", f"/element/{element}/value", {"text": text})

    def until(self, script: str, *arguments: Any, seconds: float = 60.0) -> Any:
        """What a script returns once that is true."""
        deadline = time.monotonic() + seconds
        while not (found := self.run(script, *arguments)):
            assert time.monotonic() < deadline, f"never true: {script}; the page: {self.text('body')[:800]}"
            time.sleep(0.1)
        return found

    def complaints(self) -> list[str]:
        """Errors and warnings in the console.

        Refused requests of the tests' own are left out, and those of the page before to a service that has ended.
        """
        entries = self._ask("POST", "/se/log", {"type": "browser"})
        found = [entry["message"] for entry in entries if entry["level"] in ("SEVERE", "WARNING")]
        ended = re.compile(rf"http://(?!{re.escape(self._host)}/)\S+ - .*net::ERR_CONNECTION_REFUSED")
        own = [line for line in found if not ended.match(line)]
        return [line for line in own if "status of 422" not in line and "status of 401" not in line]

    def picture(self, path: Path) -> None:
        path.write_bytes(base64.b64decode(self._ask("GET", "/screenshot")))

    def prefer(self, scheme: str) -> None:
        """Whether the reader likes pages ``light`` or ``dark``."""
        media = {"features": [{"name": "prefers-color-scheme", "value": scheme}]}
        self._ask("POST", "/goog/cdp/execute", {"cmd": "Emulation.setEmulatedMedia", "params": media})

    def choose_file(self, selector: str, path: Path) -> None:
        self._ask("POST", f"/element/{self.find(selector)}/value", {"text": str(path)})

    def resize(self, width: int, height: int) -> None:
        self._ask("POST", "/window/rect", {"width": width, "height": height})

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        try:
            self._ask("DELETE", "")
        finally:
            self._driver.terminate()
            self._driver.wait(timeout=20)
