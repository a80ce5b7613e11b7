"""A real browser without a window: one process of Chromium, spoken to over a pipe by its DevTools protocol."""

from __future__ import annotations

import base64
import itertools
import json
import os
import select
import shlex
import shutil
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
FLAGS = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"),
    *("--no-first-run", "--disable-extensions", "--disable-background-networking", "--remote-debugging-pipe"),
)
PATIENCE = 30.0
"""How long the browser may take for an answer [s]."""


def program() -> str | None:
    """Finds the browser; None where there is none."""
    return next((found for name in PROGRAMS if (found := shutil.which(name))), None)


class Browser:
    """One page of a browser that has no network; as a context manager it ends the process."""

    def __init__(self) -> None:
        found = program()
        if found is None:
            raise FileNotFoundError("no Chromium is installed")
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        their_input, self._out = os.pipe()
        self._in, their_output = os.pipe()
        # The protocol has fixed numbers: the browser reads from 3 and writes to 4. Other shells know numbers to 9 only.
        words = shlex.join([found, *FLAGS, f"--user-data-dir={self._profile.name}", "about:blank"])
        self._process = subprocess.Popen(
            ["bash", "-c", f"exec {words} 3<&{their_input} 4>&{their_output}"],
            pass_fds=(their_input, their_output),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(their_input)
        os.close(their_output)
        self._rest, self._numbers, self._session = b"", itertools.count(1), ""
        self.events: list[dict[str, Any]] = []
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        attached = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        self.call("Network.emulateNetworkConditions", offline=True, latency=0, downloadThroughput=0, uploadThroughput=0)

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.terminate()
        self._process.wait()
        os.close(self._in)
        os.close(self._out)
        self._profile.cleanup()

    def call(self, method: str, **parameters: Any) -> Any:
        """Sends a command and waits for its answer.

        Raises:
            RuntimeError: the browser refuses the command.
        """
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        message |= {"sessionId": self._session} if self._session else {}
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != number:
            self.events.append(answer)
        if "error" in answer:
            raise RuntimeError(f"{method}: {answer['error']}")
        return answer["result"]

    def open(self, path: Path, *, width: int, dark: bool = False, scripts: bool = True) -> None:
        """Loads a file in a window of a width [px]."""
        self.scripts(allowed=scripts)
        self.resize(width)
        self.theme(dark=dark)
        self.events.clear()
        self.call("Page.navigate", url=path.as_uri())
        while not any(event["method"] == "Page.loadEventFired" for event in self.events):
            self.events.append(self._next())

    def resize(self, width: int, *, height: int = 900) -> None:
        """Sets the size of the window [px]."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def scripts(self, *, allowed: bool) -> None:
        """Sets whether scripts run."""
        self.call("Emulation.setScriptExecutionDisabled", value=not allowed)

    def theme(self, *, dark: bool) -> None:
        """Sets what the reader prefers."""
        value = "dark" if dark else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])

    def run(self, script: str) -> Any:
        """Runs an expression in the page, waits for a promise, and gives its value.

        Raises:
            RuntimeError: the script fails.
        """
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in found:
            raise RuntimeError(str(found["exceptionDetails"]))
        return found["result"].get("value")

    def press(self, key: str, code: int) -> None:
        """Presses a key and lets it go."""
        text = {"text": "\r"} if key == "Enter" else {}
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, **text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    def picture(self, path: Path, *, height: int) -> None:
        """Writes the upper part of the page as PNG."""
        width = self.run("innerWidth")
        clip = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
        found = self.call("Page.captureScreenshot", clip=clip, captureBeyondViewport=True)
        path.write_bytes(base64.b64decode(found["data"]))

    @property
    def problems(self) -> list[str]:
        """Script errors, console errors and requests to a network since the page was opened."""
        self.run("0")
        found = []
        for event in self.events:
            method, words = event.get("method"), event.get("params", {})
            if method == "Runtime.exceptionThrown":
                found.append(str(words["exceptionDetails"].get("exception", {}).get("description")))
            elif method == "Log.entryAdded" and words["entry"]["level"] == "error":
                found.append(words["entry"]["text"])
            elif method == "Runtime.consoleAPICalled" and words["type"] in ("error", "warning"):
                found.append(str(words["args"]))
            elif method == "Network.requestWillBeSent" and not words["request"]["url"].startswith(
                ("file:", "data:", "blob:")
            ):
                found.append(words["request"]["url"])
        return found

    def _next(self) -> dict[str, Any]:
        """Reads the next message."""
        end = time.monotonic() + PATIENCE
        while b"\0" not in self._rest:
            ready, _, _ = select.select([self._in], [], [], max(end - time.monotonic(), 0.0))
            part = os.read(self._in, 1 << 16) if ready else b""
            if not part:
                raise TimeoutError(f"the browser gave no answer within {PATIENCE:g} s")
            self._rest += part
        first, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(first)
        return message
