"""The ways in which an operator's page is lost while the robot walks; each returns what undoes it."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable
from typing import Any

Undo = Callable[[], None]

HANG = "setTimeout(() => { for (const end = Date.now() + 5000; Date.now() < end;); })"


def _nothing() -> None:
    pass


def _hang(page: Any) -> Undo:
    page.evaluate(HANG)
    return _nothing


def _offline(page: Any) -> Undo:
    page.context.set_offline(True)
    return lambda: page.context.set_offline(False)


def _elsewhere(page: Any) -> Undo:
    page.goto("about:blank")
    return _nothing


def _close(page: Any) -> Undo:
    page.close()
    return _nothing


def _stop_renderer(page: Any) -> Undo:
    stopped = _renderers(page)
    for pid in stopped:
        os.kill(pid, signal.SIGSTOP)

    def go_on() -> None:
        for pid in stopped:
            os.kill(pid, signal.SIGCONT)

    return go_on


def _kill_renderer(page: Any) -> Undo:
    for pid in _renderers(page):
        os.kill(pid, signal.SIGKILL)
    return _nothing


def _renderers(page: Any) -> list[int]:
    session = page.context.browser.new_browser_cdp_session()
    found = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return [int(process["id"]) for process in found if process["type"] == "renderer"]


# What happens to a page of Playwright's.
DRIVEN: dict[str, Callable[[Any], Undo]] = {
    "renderer stopped": _stop_renderer,
    "script hung": _hang,
    "renderer killed": _kill_renderer,
    "offline": _offline,
    "went elsewhere": _elsewhere,
    "closed": _close,
}
# And to a tab of a Chromium without Playwright, whose pages no other tab and no minimised window hides.
PLAIN: dict[str, Callable[[Any], Undo]] = {
    "tab behind another": lambda tab: tab.cover(),
    "window minimised": lambda tab: tab.minimise(),
}
EVERY = (*DRIVEN, *PLAIN)
