"""A real Chromium in front of a real console over a simulated robot in wall time. `make test-browser` runs these.

OPENBELIEF_SCREENSHOTS=DIR keeps the screenshots of docs/operator.md there, of the flat instead of the small room.
OPENBELIEF_LATE_MS=150 makes every page get its snapshots and paint that late: a test that fails by it asks too early.
"""

from __future__ import annotations

import json
import os
import queue
import re
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, BrowserContext, ConsoleMessage, Page, Playwright, sync_playwright

from drivers.processes import end_or_kill
from robot_app.benches.chromium import chromium_path
from robot_app.config import load_config

HERE = Path(__file__).parent
SMALL = HERE.parent / "robot_app" / "small_scene.json"
RECORDED = HERE.parent / "replay" / "small_room.mcap"
ASKED_FOR = "OPENBELIEF_BROWSER"
SCREENSHOTS = os.environ.get("OPENBELIEF_SCREENSHOTS", "")
LATE_MS = os.environ.get("OPENBELIEF_LATE_MS", "")
LATE = (HERE / "late.js").read_text()
ANSWER_S = 20.0  # to each question: what is tried while it is open takes a while on a busy machine
PATIENCE_S = 60.0  # for one step, on a machine that does other work too
MANY = 2000
CARD = {
    "id": 105,
    "label": "seven of clubs",
    "shape": "box",
    "position": [2.6, 3.7],
    "size": [0.35, 0.25, 0.4],
    "colour": "white",
}
SEED = 1  # in whose map the wrong candidate is the first
STALE_SPEECH = "404.*/api/speech/"  # what was to be said aloud is over when a page comes for its sound
FOREIGN_HOST = "evil.example"  # which the browser believes to be this machine
DESKTOP, PHONE = {"width": 1440, "height": 900}, {"width": 390, "height": 844}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    if os.environ.get(ASKED_FOR) or SCREENSHOTS:
        return
    why = pytest.mark.skip(reason="a browser and a robot in wall time: make test-browser runs these")
    for item in items:
        if HERE in item.path.parents:
            item.add_marker(why)


def until(happens: Callable[[], Any], what: str) -> Any:
    """Ask again until it is true; a strict content policy does not let a browser wait for an expression itself."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        if found := happens():
            return found
        time.sleep(0.05)
    raise AssertionError(f"not within {PATIENCE_S:g} s: {what}")


class Program:
    """`openbelief ... --console`, its terminal, and the pairing links that it prints."""

    def __init__(self, *arguments: str) -> None:
        command = [sys.executable, "-m", "robot_app.cli", *arguments]
        self._lines: queue.Queue[str] = queue.Queue()
        self.said: list[str] = []
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        threading.Thread(target=self._read, daemon=True).start()
        self._first = self._link()
        self.url = self._first.split("/#")[0]

    def link(self, role: str = "operator") -> str:
        """A fresh pairing link."""
        if role == "operator" and self._first:
            first, self._first = self._first, ""
            return first
        self.type("pair" if role == "operator" else "pair viewer")
        return self._link()

    def type(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()

    def end(self) -> None:
        self._process.terminate()
        end_or_kill(self._process, 30.0)

    def _link(self) -> str:
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s:
            try:
                line = self._lines.get(timeout=0.5)
            except queue.Empty:
                assert self._process.poll() is None, "".join(self.said[-20:])
                continue
            if found := re.search(r"http\S+#pair=\S+", line):
                return found[0]
        raise AssertionError("".join(self.said[-20:]))

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(line)
            self._lines.put(line)


@dataclass
class Site:
    """A folder with a memory and trials, and the program that runs missions over it."""

    folder: Path
    program: Program

    @property
    def config(self) -> Path:
        return self.folder / "robot.toml"


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A mapped site, as `openbelief demo --console` leaves it, with trials of before."""
    from robot_app.demo.demo import demo_configuration
    from robot_app.progress import progress

    folder = tmp_path_factory.mktemp("site") / "demo-out"
    scene = "flat" if SCREENSHOTS else str(with_a_card(folder.parent))
    with progress() as shown:
        demo_configuration(folder, scene, SEED, shown, print)
    if not SCREENSHOTS:
        many_trials(folder)
        shutil.copy(RECORDED, folder / RECORDED.name)  # of another site and memory: what it shows is in its file
    config = (folder / "robot.toml").read_text()
    config = config.replace('readout = "grounded"', 'readout = "consensus"')  # its first candidate is wrong: the story
    config = config.replace("confirm_timeout_s = 10.0", f"confirm_timeout_s = {ANSWER_S}")
    config = config.replace('serve = "off"', 'serve = "here"').replace("127.0.0.1:7450", f"127.0.0.1:{free_port()}")
    (folder / "robot.toml").write_text(config)
    return folder


@pytest.fixture(scope="session")
def site(folder: Path) -> Iterator[Site]:
    scene = load_config(folder / "robot.toml").sim.scene
    program = Program("demo", "--console", "0", "--scene", scene, "--seed", str(SEED), "--out", str(folder))
    yield Site(folder, program)
    program.end()


def with_a_card(folder: Path) -> Path:
    """The small room with one thing more on the floor: what a person asks for in Debian's recordings of voices.

    Nothing in sight is left out: which looks the simulated segmenter leaves a thing out of is drawn by their stamps, in
    wall time others each run.
    """
    scene = json.loads(SMALL.read_text())
    scene["objects"].append(CARD)
    scene["missed"] = 0.0
    path = folder / "scene.json"
    path.write_text(json.dumps(scene))
    return path


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def many_trials(folder: Path) -> None:
    """Two thousand rows, as if the list had been read before."""
    entries = {}
    for number in range(MANY):
        path = folder / f"old_{number:04d}.mcap"
        path.write_bytes(b"")
        os.utime(path, (1_700_000_000 + number, 1_700_000_000 + number))
        row = {
            "started_ms": 1_700_000_000_000 + 1000 * number,
            "sentence": f"find thing number {number}",
            "who": "ada",
            "outcome": "CONFIRMED" if number % 2 else "FAILED",
            "reason": "as long ago",
            "visits": 1,
            "candidates": [],
        }
        entries[path.name] = {"stamp": [path.stat().st_mtime_ns, 0], "row": row}
    (folder / ".trials-index.json").write_text(json.dumps({"format": 1, "trials": entries}))


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as made:
        yield made


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    arguments = ["--no-sandbox", "--no-proxy-server", f"--host-resolver-rules=MAP {FOREIGN_HOST} 127.0.0.1"]
    made = playwright.chromium.launch(executable_path=chromium_path(), args=arguments)
    yield made
    made.close()


@dataclass
class Tab:
    """A page that is logged in, with what went wrong in it and where it asked."""

    page: Page
    site: Site
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)
    may_complain: str = ""  # what a test provokes

    def trouble(self) -> list[str]:
        """What it complained of, policy errors too, and what it asked of others than the console."""
        own = self.site.program.url
        allowed = (own, own.replace("http", "ws", 1), f"blob:{own}", "about:", "chrome:", "data:")
        foreign = [url for url in self.requests if not url.startswith(allowed)]
        expected = "|".join(filter(None, [STALE_SPEECH, self.may_complain]))
        unasked = [each for each in self.complaints if not re.search(expected, each)]
        return foreign + unasked

    def listen(self) -> None:
        self.page.on("console", self._hear)
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))

    def _hear(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.complaints.append(f"{message.text} {message.location.get('url', '')}")

    def words(self, element: str) -> str:
        return self.page.locator(f"#{element}").inner_text(timeout=PATIENCE_S * 1000)

    def state(self) -> dict[str, Any]:
        """The newest snapshot that the page has painted."""
        return self.page.evaluate("window.openbelief?.painted || {}")

    def until_state(self, *words: str) -> str:
        return until(lambda: (now := self.words("state")) in words and now, f"{words}: {self.words('state')}")

    def until_asked(self) -> None:
        yes = self.page.locator("#answer-yes")
        until(lambda: yes.is_visible() and yes.is_enabled(), "a question that may be answered")

    def take(self) -> None:
        self.page.locator("#take").click()
        until(lambda: self.state().get("you", {}).get("epoch"), "the command")

    def ask(self, words: str) -> None:
        self.page.locator("#ask-words").fill(words)
        self.page.keyboard.press("Enter")

    def said(self) -> str:
        return " | ".join(each["text"] for each in self.state()["said"])

    def refused(self) -> str:
        """The refusal that the page shows."""
        answer = self.page.locator("#ask-answer.refused")
        until(answer.is_visible, "a refusal on the page")
        return answer.inner_text()

    def stopped(self, how: Callable[[Tab], Any]) -> None:
        """STOP in that way, until it was heard. The snapshot that tells of it comes after its acknowledgement."""
        how(self)
        until(lambda: self.page.locator("#stop").get_attribute("data-state") == "heard", "STOP was heard")

    def until_stopped_by(self, who: str) -> None:
        until(lambda: (self.state()["operator"]["stop"] or {}).get("who") == who, f"the latch names {who}")

    def picture(self, name: str) -> None:
        """For docs/operator.md, where it is asked for."""
        if SCREENSHOTS:
            Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
            self.page.wait_for_timeout(400)
            self.page.screenshot(path=str(Path(SCREENSHOTS) / f"{name}.png"))


@pytest.fixture
def open_tab(browser: Browser, site: Site) -> Iterator[Callable[..., Tab]]:
    with tabs(browser, site) as opened:
        yield opened


@contextmanager
def tabs(browser: Browser, site: Site) -> Iterator[Callable[..., Tab]]:
    """open_tab(role="operator", size=DESKTOP): a page of its own browser context, logged in by a pairing link.

    Afterwards none of them complained of anything, or asked anything of anybody but the console.
    """
    contexts: list[BrowserContext] = []
    made: list[Tab] = []

    def opened(role: str = "operator", size: dict[str, int] = DESKTOP, theme: str = "dark", script: str = "") -> Tab:
        context = browser.new_context(viewport=size, has_touch=size is PHONE, device_scale_factor=1)
        contexts.append(context)
        chosen = f"if (location.protocol !== 'about:') localStorage.setItem('theme', '{theme}')"
        context.add_init_script(f"{chosen}; {script}" + (f"; ({LATE})({int(LATE_MS)})" if LATE_MS else ""))
        tab = Tab(context.new_page(), site)
        made.append(tab)
        tab.listen()
        tab.page.goto(site.program.link(role))
        until(lambda: tab.state().get("n"), "the first painted snapshot")
        return tab

    yield opened
    for context in contexts:
        context.close()
    assert [tab.trouble() for tab in made if tab.trouble()] == []


@pytest.fixture
def tab(open_tab: Callable[..., Tab]) -> Iterator[Tab]:
    """An operator's page that commands; afterwards nothing is under way."""
    made = open_tab()
    made.take()
    yield made
    if not made.page.is_closed():
        finish(made)


def finish(tab: Tab) -> None:
    """Whatever a test left behind is stopped."""
    if tab.state().get("operator", {}).get("mission"):
        tab.page.keyboard.press("Escape")
        until(lambda: tab.state()["operator"]["mission"] is None, "the end of the mission")
