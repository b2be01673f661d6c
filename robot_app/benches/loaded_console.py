"""A console with much to do: a robot in a process of its own, missions, 2 000 objects and trials, a busy process."""

from __future__ import annotations

import json
import random
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.benches.chromium import chromium_path
from robot_app.benches.programs import START_S, Program, write_configuration
from robot_app.cli import Failure

if TYPE_CHECKING:
    from robot_app.mission.operator import SharedOperator

OBJECTS, SIDE_M = 2000, 12.0
TRIALS = 2000


@dataclass(frozen=True)
class LoadedConsole:
    """link: a new pairing link for a page that may command. browser: Playwright's, headless."""

    robot: Program
    operator: SharedOperator
    link: Callable[[], str]
    browser: Any


@contextmanager
def loaded_console() -> Iterator[LoadedConsole]:
    """Ready to be asked: the robot stands, missions run, nobody has logged in."""
    from robot_app.config import load_config
    from robot_app.console.console import open_console
    from robot_app.console.listening import Listening
    from robot_app.mission.live import run_missions
    from robot_app.mission.missions import open_missions
    from robot_app.mission.operator import SharedOperator

    with ExitStack() as opened:
        robot = Program(opened, "sim_fakes.wire.nav2_process", "--whole")
        endpoint = robot.expect("endpoint", START_S)["endpoint"]
        folder = Path(opened.enter_context(tempfile.TemporaryDirectory()))
        wide = "camera_max_age_s = 2.0\npose_max_age_s = 2.0\ncloud_max_age_s = 4.0\n"
        limits = f"[mission]\n{wide}[safety]\nwatchdog = 'off'\ndisk_min_bytes = 1000000\n{wide}"
        config, operator = load_config(write_configuration(folder, endpoint, limits)), SharedOperator()
        _many_trials(config.trials)
        missions = opened.enter_context(open_missions(config, operator))
        served = open_console(Listening("127.0.0.1", 0), config, operator, missions, extra=_changing)
        shown = opened.enter_context(served)
        watching = {"watching": (shown.live,)}
        running = threading.Thread(target=run_missions, args=(missions, operator, []), kwargs=watching)
        running.start()
        opened.callback(running.join)
        opened.callback(operator.end)
        opened.enter_context(_busy())
        browser = opened.enter_context(_chromium())
        yield LoadedConsole(robot, operator, lambda: shown.server.pairing_url("bench", "operator"), browser)


@contextmanager
def _chromium() -> Iterator[Any]:
    path = chromium_path()
    try:
        from playwright.sync_api import sync_playwright
    except ImportError as error:
        raise Failure("playwright is not installed: pip install -r requirements/dev.txt") from error
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        try:
            yield browser
        finally:
            browser.close()


@contextmanager
def _busy() -> Iterator[None]:
    """A thread of Python that never waits, as perception's glue does for moments."""
    ended = threading.Event()

    def spin() -> None:
        while not ended.is_set():
            sum(range(1000))

    thread = threading.Thread(target=spin, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def _changing() -> dict[str, Any]:
    return {"objects": {str(number): round(random.random(), 2) for number in range(OBJECTS)}}


def site() -> dict[str, Any]:
    """What a page draws: the objects as a square, without rooms."""
    side = int(OBJECTS**0.5) + 1
    step = SIDE_M / side
    spots = [(number % side * step, number // side * step) for number in range(OBJECTS)]
    objects = [
        {"id": n, "label": f"thing {n}", "low": [x, y, 0], "high": [x + 0.2, y + 0.2, 1], "centroid": [x, y, 0]}
        for n, (x, y) in enumerate(spots)
    ]
    return {"objects": objects, "rooms": [], "keep_out": [], "allowed": []}


def _many_trials(folder: Path) -> None:
    """Rows of the list, as if each had been read before."""
    from robot_app.mission.trial_shelf import FORMAT, INDEX

    folder.mkdir(parents=True, exist_ok=True)
    row = {"sentence": "find the lamp", "who": "ada", "outcome": "CONFIRMED", "reason": "it is", "visits": 1}
    entries = {}
    for number in range(TRIALS):
        path = folder / f"old_{number:04d}.mcap"
        path.touch()
        at = {"started_ms": 1_700_000_000_000 + 1000 * number, "candidates": []}
        entries[path.name] = {"stamp": [path.stat().st_mtime_ns, 0], "row": row | at}
    (folder / INDEX).write_text(json.dumps({"format": FORMAT, "trials": entries}), encoding="utf-8")
