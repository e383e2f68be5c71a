"""Headless Chromium, driven through its DevTools protocol over two pipes."""

import base64
import itertools
import json
import os
import select
import shutil
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

_NAMES = ("chromium", "chromium-browser", "google-chrome")
_FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--no-first-run",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-component-update",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)


def chromium() -> str:
    """Path of the browser; the test is skipped where there is none."""
    for name in _NAMES:
        path = shutil.which(name)
        if path:
            return path
    pytest.skip("no Chromium here (Debian's package `chromium`)")


class Browser:
    """A browser with a single page.

    Attributes:
        requests: Addresses that the page asked for.
        messages: What the page wrote to its console, and its uncaught errors.
    """

    def __init__(self, profile: Path, size: tuple[int, int] = (640, 400)) -> None:
        to_read, self._write = os.pipe()
        self._read, to_write = os.pipe()
        size_flag = f"--window-size={size[0]},{size[1]}"
        # The browser reads from 3 and writes to 4; both ends may have these numbers here.
        start = (
            "import os, sys; r, w = map(int, sys.argv[1:3]); r, w = os.dup(r), os.dup(w); "
            "os.dup2(r, 30); os.dup2(w, 31); os.dup2(30, 3); os.dup2(31, 4); "
            "os.execv(sys.argv[3], sys.argv[3:])"
        )
        pipes = (sys.executable, "-c", start, str(to_read), str(to_write))
        self._process = subprocess.Popen(
            [*pipes, chromium(), *_FLAGS, size_flag, f"--user-data-dir={profile}"],
            pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        self._numbers = itertools.count(1)
        self._rest = b""
        self.requests: list[str] = []
        self.messages: list[str] = []
        target = self._send("Target.createTarget", {"url": "about:blank"})["targetId"]
        attach = {"targetId": target, "flatten": True}
        self._session = self._send("Target.attachToTarget", attach)["sessionId"]
        self._size = size
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.command(f"{domain}.enable")
        metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": False}
        self.command("Emulation.setDeviceMetricsOverride", metrics)

    def command(self, method: str, parameters: dict[str, Any] | None = None) -> dict[str, Any]:
        """Sends a command to the page, and waits for its answer."""
        return self._send(method, parameters or {}, self._session)

    def open(self, url: str) -> None:
        self.value("window.envgen = null")  # The page before must not answer for the next one.
        self.command("Page.navigate", {"url": url})

    def value(self, expression: str) -> Any:
        """Value of a JavaScript expression in the page."""
        parameters = {"expression": expression, "returnByValue": True, "awaitPromise": True}
        answer = self.command("Runtime.evaluate", parameters)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait_for(self, expression: str, seconds: float = 120.0) -> Any:
        """Waits until an expression is true, and returns its value."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            value = self.value(expression)
            if value:
                return value
            time.sleep(0.1)
        pytest.fail(f"{expression} is not true after {seconds} s; {self.messages}")

    def click(self, x: float, y: float) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            event = {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1}
            self.command("Input.dispatchMouseEvent", event)

    def screenshot(self, path: Path) -> Path:
        data = self.command("Page.captureScreenshot", {"format": "png"})["data"]
        path.write_bytes(base64.b64decode(data))
        return path

    def close(self) -> None:
        with suppress(OSError, EOFError):
            self._send("Browser.close", {})
        try:
            self._process.wait(20)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        os.close(self._read)
        os.close(self._write)

    def _send(self, method: str, parameters: dict[str, Any], session: str = "") -> dict[str, Any]:
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        message |= {"sessionId": session} if session else {}
        os.write(self._write, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            self._note(answer)

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._read], [], [], 180)
            block = os.read(self._read, 1 << 20) if ready else b""
            if not block:
                raise EOFError("the browser is gone")
            self._rest += block
        text, _, self._rest = self._rest.partition(b"\0")
        return json.loads(text)

    def _note(self, event: dict[str, Any]) -> None:
        kind, parameters = event.get("method"), event.get("params", {})
        if kind == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        elif kind == "Runtime.consoleAPICalled" and parameters["type"] in {"error", "warning"}:
            self.messages.append(str([each.get("value") for each in parameters["args"]]))
        elif kind == "Runtime.exceptionThrown":
            self.messages.append(str(parameters["exceptionDetails"]))
        elif kind == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.messages.append(parameters["entry"]["text"] + parameters["entry"].get("url", ""))
