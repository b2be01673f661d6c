"""A Chromium as a person starts it: without the switches by which test tools keep every tab awake.

Playwright's pages stay visible whatever lies in front of them. Here a tab behind another one is hidden and paints
nothing, as on a person's screen. Speaks as much of the DevTools protocol as the console's bench and tests need.
"""

from __future__ import annotations

import itertools
import json
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from drivers.processes import end_or_kill
from robot_app.benches.programs import START_S, until
from robot_app.cli import Failure

NAMES = ("chromium", "chromium-browser", "google-chrome")
ANSWER_S = 20.0
END_S = 5.0
ARGUMENTS = ("--headless", "--no-sandbox", "--no-first-run", "--remote-debugging-port=0", "about:blank")


def chromium_path() -> str:
    """Raises Failure where there is none."""
    for name in NAMES:
        if path := shutil.which(name):
            return path
    raise Failure("there is no chromium here: apt-get install chromium")


class PlainChromium:
    """One browser with one window; ends with `opened`."""

    def __init__(self, opened: ExitStack) -> None:
        from websockets.sync.client import connect

        folder = Path(opened.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True)))
        command = [chromium_path(), f"--user-data-dir={folder}", *ARGUMENTS]
        self._process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        opened.callback(self._end)
        port = folder / "DevToolsActivePort"
        until("the browser's DevTools", lambda: port.is_file() and port.read_text().count("\n") > 0, START_S)
        number, path = port.read_text().splitlines()
        address = f"ws://127.0.0.1:{number}{path}"
        self._socket = opened.enter_context(connect(address, max_size=None, ping_interval=None))
        self._numbers = itertools.count(1)

    def tab(self, url: str) -> PlainTab:
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        self.call("Page.navigate", session, url=url)
        return PlainTab(self, target, session)

    def call(self, method: str, session: str = "", **parameters: Any) -> dict[str, Any]:
        """Raises Failure where the browser refuses."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        self._socket.send(json.dumps(message | ({"sessionId": session} if session else {})))
        end_s = time.monotonic() + ANSWER_S
        while time.monotonic() < end_s:
            heard = json.loads(self._socket.recv(ANSWER_S))
            if heard.get("id") == number:
                if "error" in heard:
                    raise Failure(f"Chromium refuses {method}: {heard['error']['message']}")
                return dict(heard["result"])
        raise Failure(f"Chromium did not answer {method}")

    def _end(self) -> None:
        self._process.terminate()
        end_or_kill(self._process, END_S)


class PlainTab:
    """One tab, in front when it is opened."""

    def __init__(self, browser: PlainChromium, target: str, session: str) -> None:
        self._browser, self._target, self._session = browser, target, session

    def evaluate(self, expression: str) -> Any:
        """Its value, awaited."""
        found = self._browser.call(
            "Runtime.evaluate", self._session, expression=expression, returnByValue=True, awaitPromise=True
        )
        if "exceptionDetails" in found:
            raise Failure(f"{expression}: {found['exceptionDetails']['text']}")
        return found["result"].get("value")

    def click(self, element: str) -> None:
        """Where it lies, by the mouse."""
        where = f"(({{x, y, width, height}}) => [x + width / 2, y + height / 2])({_box(element)})"
        x, y = self.evaluate(where)
        for kind in ("mousePressed", "mouseReleased"):
            mouse = {"type": kind, "x": x, "y": y, "button": "left", "clickCount": 1}
            self._browser.call("Input.dispatchMouseEvent", self._session, **mouse)

    def cover(self) -> Callable[[], None]:
        """Another tab in front of it; returns what brings this one back."""
        self._browser.call("Target.createTarget", url="about:blank")
        return lambda: self._show()

    def minimise(self) -> Callable[[], None]:
        """Its window; returns what brings it back."""
        window = self._browser.call("Browser.getWindowForTarget", targetId=self._target)["windowId"]

        def set_to(state: str) -> None:
            self._browser.call("Browser.setWindowBounds", windowId=window, bounds={"windowState": state})

        set_to("minimized")
        return lambda: set_to("normal")

    def close(self) -> None:
        self._browser.call("Target.closeTarget", targetId=self._target)

    def _show(self) -> None:
        self._browser.call("Target.activateTarget", targetId=self._target)


def _box(element: str) -> str:
    return f"document.getElementById({json.dumps(element)}).getBoundingClientRect()"
