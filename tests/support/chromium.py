"""A headless Chromium for tests of pages, driven through its DevTools pipe without a library.

The protocol is https://chromedevtools.github.io/devtools-protocol/; messages are JSON that ends
with a zero byte.
"""

from __future__ import annotations

import base64
import contextlib
import fcntl
import json
import os
import select
import shutil
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser") or ""
_FLAGS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--hide-scrollbars",
    "--remote-debugging-pipe",
)
_PATIENCE_S = 60.0


class Browser:
    """One browser with one page; ``problems`` are errors and warnings of its console."""

    def __init__(self, to: int, back: int) -> None:
        self._to, self._back = to, back
        self._number, self._rest = 0, b""
        self._session = ""
        self.problems: list[str] = []
        self._loaded = False
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        attached = self._call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable")

    def open(self, page: Path, *, width: int = 1280, dark: bool = False) -> None:
        """Open a file in a window of a width, and wait until it is loaded and drawn."""
        self._call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=900,
            deviceScaleFactor=1,
            mobile=width < 600,
        )
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._call("Emulation.setEmulatedMedia", features=[scheme])
        self._loaded = False
        self._call("Page.navigate", url=page.absolute().as_uri())
        until = time.monotonic() + _PATIENCE_S
        while not self._loaded and time.monotonic() < until:
            self._read(0.2)
        self.wait_for("document.readyState === 'complete'")
        self.evaluate("new Promise(done => requestAnimationFrame(() => setTimeout(done, 100)))")

    def evaluate(self, script: str) -> Any:
        """Return the value of an expression; raise AssertionError if it throws."""
        done = self._call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def wait_for(self, script: str, patience_s: float = 20.0) -> None:
        """Wait until an expression is true."""
        until = time.monotonic() + patience_s
        while not self.evaluate(script):
            assert time.monotonic() < until, f"never true: {script}"
            self._read(0.1)

    def screenshot(self, path: Path, *, whole: bool = True) -> None:
        """Save a picture of the page, or of what a window of its size shows."""
        done = self._call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(done["data"]))

    def _call(self, method: str, **parameters: Any) -> dict[str, Any]:
        self._number += 1
        number = self._number
        message: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + _PATIENCE_S
        while time.monotonic() < until:
            for answer in self._read(1.0):
                if answer.get("id") == number:
                    assert "error" not in answer, (method, answer)
                    result: dict[str, Any] = answer["result"]
                    return result
        raise AssertionError(f"Chromium did not answer {method}")

    def _read(self, wait_s: float) -> list[dict[str, Any]]:
        """Return the answers that have come; events are noted."""
        if not select.select([self._back], [], [], wait_s)[0]:
            return []
        content = os.read(self._back, 1 << 20)
        assert content, "Chromium has ended"
        *whole, self._rest = (self._rest + content).split(b"\0")
        messages = [json.loads(each) for each in whole]
        for each in messages:
            self._note(each)
        return messages

    def _note(self, message: dict[str, Any]) -> None:
        method, parameters = message.get("method", ""), message.get("params", {})
        if method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.problems.append(json.dumps(parameters["exceptionDetails"])[:500])
        elif method == "Runtime.consoleAPICalled" and parameters["type"] in ("error", "warning"):
            self.problems.append(json.dumps(parameters["args"])[:500])
        elif method == "Log.entryAdded" and parameters["entry"]["level"] in ("error", "warning"):
            self.problems.append(parameters["entry"]["text"])
        elif method == "Page.javascriptDialogOpening":
            self.problems.append(f"a dialog: {parameters['message']}")
        elif method == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith(("file:", "data:", "about:")):
                self.problems.append(f"a request to {url[:200]}")


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    """Start Chromium with a profile of its own, and end it."""
    ours, its_end = _pipe()
    its_begin, to = _pipe()
    with tempfile.TemporaryDirectory(prefix="garl-chromium-") as profile:
        # Chromium reads from descriptor 3 and writes to descriptor 4.
        shell = f'exec "$0" "$@" 3<&{its_begin} 4>&{its_end}'
        process = subprocess.Popen(
            ["bash", "-c", shell, PROGRAM, *_FLAGS, f"--user-data-dir={profile}"],
            pass_fds=(its_begin, its_end),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(its_begin)
        os.close(its_end)
        try:
            yield Browser(to, ours)
        finally:
            process.kill()
            process.wait()
            os.close(to)
            os.close(ours)
            # Its helpers write into the profile for a moment longer.
            time.sleep(0.3)


def _pipe() -> tuple[int, int]:
    """Return a pipe whose descriptors are none of those that Chromium is given."""
    ends = os.pipe()
    high = tuple(fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in ends)
    for end in ends:
        os.close(end)
    return high[0], high[1]
