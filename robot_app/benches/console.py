"""The console in a real Chromium: from a press of STOP to the cancel at Nav2, and from a lost page to the hold.

A simulated robot with Nav2 in a process of its own, missions and console in this one, a headless Chromium in front of
it; the page shows camera and 2 000 objects that change ten times a second, and a Python thread keeps this process busy.
Fails where a promise is missed: STOP median 50 ms and worst 200 ms, every lost page held within 1 s, no hold while the
page is healthy, repaint of 2 000 objects within 10 ms at the 95th percentile. A tab is hidden in a second Chromium, as
a person starts it: Playwright keeps its own awake. The defaults take 18 minutes; what is done is said on the way. Needs
Debian's chromium and playwright.
"""

from __future__ import annotations

import argparse
import json
import random
import statistics
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.arguments import from_one
from robot_app.benches.chromium import PlainChromium, PlainTab, chromium_path
from robot_app.benches.lost_pages import DRIVEN, EVERY, PLAIN
from robot_app.benches.programs import START_S, THING, Program, until, write_configuration
from robot_app.cli import Failure, print_json
from robot_app.tables import show

if TYPE_CHECKING:
    from robot_app.mission.notices import Notice
    from robot_app.mission.operator import SharedOperator

OBJECTS, SIDE_M = 2000, 12.0
STOP_MEDIAN_MS, STOP_WORST_MS, HOLD_S, REPAINT_MS = 50.0, 200.0, 1.0, 10.0
TRIALS = 2000
LOOK_S = 0.02  # at a healthy page's silence: three times as often as a mission looks


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--presses", type=from_one, default=100, help="of STOP (default 100)")
    parser.add_argument("--minutes", type=float, default=10.0, help="of a healthy page (default 10)")
    parser.add_argument("--losses", type=from_one, default=3, help="of each kind of lost page (default 3)")


def run(options: argparse.Namespace) -> None:
    result: dict[str, Any] = {"hold_s": {}}
    with ExitStack() as opened:
        bench = opened.enter_context(console())
        result["stop_ms"] = _said(options, "STOP", bench.stops(options.presses))
        for loss in EVERY:
            result["hold_s"][loss] = _said(options, loss, bench.holds(loss, options.losses))
        result["repaint_ms"] = _said(options, "repaint", bench.repaint())
        result["trials_ms"] = _said(options, "trials", bench.trials())
        result["healthy"] = _said(options, "healthy", bench.healthy(60.0 * options.minutes))
    print_json(result) if options.json else _show(result)
    if broken := _broken(result):
        raise Failure("; ".join(broken))


def _said(options: argparse.Namespace, what: str, found: Any) -> Any:
    """What was measured, told at once: a bench of a quarter of an hour may be cut short."""
    if not options.json:
        print(f"{what}: {json.dumps(found)[:400]}", file=sys.stderr, flush=True)
    return found


PAINTED = "Boolean(window.openbelief?.painted)"  # a command names what was on the screen
TAKE = "{type: 'take', over: true}"
ASK = f"{{type: 'ask', epoch: openbelief.painted.you.epoch, text: '{THING}'}}"
LIST_TRIALS = """(least) => new Promise((done) => {
  const start = performance.now();
  document.getElementById("to-trials").click();
  const look = () => {
    const rows = document.querySelectorAll("a.trial").length;
    rows >= least ? done(performance.now() - start) : requestAnimationFrame(look);
  };
  look();
})"""


class ConsoleBench:
    """A robot, missions, the console's server, and a browser whose pages log in by pairing links."""

    def __init__(self, robot: Program, operator: SharedOperator, link: Callable[[], str], browser: Any) -> None:
        self._robot, self._operator, self._link, self._browser = robot, operator, link, browser
        self._page: Any = None
        self._heard_ns = 0
        operator.listen(self._hear)

    def page(self) -> Any:
        """A page that commands and paints 2 000 objects."""
        if self._page is None or self._page.is_closed():
            context = self._browser.new_context(viewport={"width": 1440, "height": 900})
            self._page = context.new_page()
            self._page.goto(self._link())
            self._until("painted snapshot", PAINTED)
            self._page.evaluate("(site) => openbelief.plan.setSite(site, null, null)", _site())
            _command(self._page, TAKE)
            self._until("lease", "openbelief.painted.you.epoch")
        return self._page

    def stops(self, presses: int) -> dict[str, Any]:
        """Milliseconds: until the operator heard it, and until Nav2 was asked to cancel."""
        found = [self._press() for _ in range(presses)]
        worst_heard, _ = max(found, key=lambda each: each[1])
        heard, cancelled = [each[0] for each in found], [each[1] for each in found]
        return {
            "presses": presses,
            **_spread(cancelled),
            "heard_of_worst": worst_heard,
            "heard": _spread(heard),
            "all": cancelled,
        }

    def holds(self, loss: str, runs: int) -> list[float]:
        return [self._lose(loss) for _ in range(runs)]

    def healthy(self, seconds: float) -> dict[str, Any]:
        """Signs of life of a page that nothing is wrong with: how often a walking robot would have been held."""
        page, ended = self.page(), threading.Event()
        silences: list[float] = []
        holds: list[str] = []

        def watch() -> None:
            was: str | None = None
            while not ended.wait(LOOK_S):
                silences.append(self._operator.silent_s())
                now = self._operator.silence()
                if now is not None and was is None:
                    holds.append(now)
                was = now

        watching = threading.Thread(target=watch)
        watching.start()
        page.wait_for_timeout(1000.0 * seconds)
        ended.set()
        watching.join()
        return {"seconds": seconds, "false_holds": len(holds), "longest_silence_s": round(max(silences), 3)}

    def repaint(self) -> dict[str, Any]:
        """Milliseconds of the plan, and of everything that a snapshot changes on the page, the plan with it."""
        page = self.page()
        page.evaluate("performance.clearMeasures()")
        page.wait_for_timeout(10_000)
        took = "performance.getEntriesByName('{}').map((each) => each.duration)"
        plan, whole = (page.evaluate(took.format(name)) for name in ("plan-paint", "page-paint"))
        return {"paints": len(plan), **_spread(plan), "page": _spread(whole)}

    def trials(self) -> float:
        """Milliseconds from the click to 2 000 trials in the list, painted."""
        page = self.page()
        took = page.evaluate(LIST_TRIALS, TRIALS)
        page.locator("#to-live").click()
        return round(float(took), 1)

    def _press(self) -> tuple[float, float]:
        """Milliseconds from the press, by the page's clock, until it was heard and until Nav2 was asked to cancel."""
        page = self._drive()
        page.wait_for_timeout(random.uniform(200, 400))
        page.evaluate("performance.clearMarks()")
        self._robot.forget()
        self._heard_ns = 0
        page.locator("#stop").click()
        cancel = self._robot.expect("cancel_ns", 5.0)
        pressed = "performance.timeOrigin + performance.getEntriesByName('stop-pressed')[0].startTime"
        pressed_ns = page.evaluate(pressed) * 1e6
        times = (self._heard_ns, cancel["cancel_ns"])
        heard_ms, cancelled_ms = (round((_epoch_ns(each) - pressed_ns) / 1e6, 1) for each in times)
        return heard_ms, cancelled_ms

    def _lose(self, loss: str) -> float:
        """Seconds from what happened to the page to the cancel request at Nav2."""
        with ExitStack() as opened:
            page: Any = self._plain(opened) if loss in PLAIN else self.page()
            self._drive(page)
            time.sleep(random.uniform(0.3, 0.5))
            self._robot.forget()
            lost_ns = time.monotonic_ns()
            undo = (DRIVEN | PLAIN)[loss](page)
            cancel = self._robot.expect("cancel_ns", 5.0)
            undo()
            self._operator.stop(because="the bench goes on")
            until("end of the mission", lambda: self._operator.mission is None)
        if loss in DRIVEN:
            if not page.is_closed():
                page.context.close()
            self._page = None
        return round((cancel["cancel_ns"] - lost_ns) / 1e9, 3)

    def _plain(self, opened: ExitStack) -> PlainTab:
        """A tab that commands, in a Chromium of its own."""
        tab = PlainChromium(opened).tab(self._link())
        until("painted snapshot", lambda: tab.evaluate(PAINTED))
        _command(tab, TAKE)
        until("lease", lambda: tab.evaluate("openbelief.painted.you.epoch"))
        return tab

    def _drive(self, page: Any = None) -> Any:
        """A page whose mission's robot is under way, from the same place each time: it must not get there."""
        until("end of the mission before", lambda: self._operator.mission is None)
        self._robot.type("home")
        self._robot.expect("home_ns")
        page = page or self.page()
        self._robot.forget()
        _command(page, ASK)
        until("question", lambda: self._operator.question is not None)
        asked = self._operator.question
        shown = f"openbelief.question.asked?.id === {asked.id if asked else 0}"
        until("button", lambda: page.evaluate(f"{shown} && !document.getElementById('answer-yes').disabled"))
        page.evaluate("document.getElementById('answer-yes').click()")
        self._robot.expect("goal_ns")
        return page

    def _hear(self, notice: Notice) -> None:
        from robot_app.mission.notices import Change

        if notice.change is Change.STOPPED:
            self._heard_ns = time.monotonic_ns()

    def _until(self, what: str, expression: str) -> None:
        until(what, lambda: self._page.evaluate(expression))


@contextmanager
def console() -> Iterator[ConsoleBench]:
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
        yield ConsoleBench(robot, operator, lambda: shown.server.pairing_url("bench", "operator"), browser)


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


def _command(page: Any, message: str) -> None:
    """Sent by the page, and done. Raises Failure with what the console said."""
    answer = page.evaluate(f"openbelief.link.command({message})")
    if not answer["ok"]:
        raise Failure(f"the console did not do {message}: {answer['text']}")


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


def _site() -> dict[str, Any]:
    side = int(OBJECTS**0.5) + 1
    step = SIDE_M / side
    spots = [(number % side * step, number // side * step) for number in range(OBJECTS)]
    objects = [
        {"id": n, "label": f"thing {n}", "low": [x, y, 0], "high": [x + 0.2, y + 0.2, 1], "centroid": [x, y, 0]}
        for n, (x, y) in enumerate(spots)
    ]
    return {"objects": objects, "rooms": [], "keep_out": [], "allowed": []}


def _epoch_ns(monotonic_ns: int) -> int:
    return monotonic_ns + time.time_ns() - time.monotonic_ns()


def _spread(values: list[float]) -> dict[str, float]:
    ordered = sorted(values)
    p95 = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    return {
        name: round(value, 1)
        for name, value in {"median": statistics.median(ordered), "p95": p95, "worst": ordered[-1]}.items()
    }


def _rows(result: dict[str, Any]) -> list[tuple[str, str, str, bool]]:
    """What, measured, promised, kept."""
    stop, healthy, paint = result["stop_ms"], result["healthy"], result["repaint_ms"]
    late = stop["heard_of_worst"]
    spread = (
        f"median {stop['median']:.0f}, p95 {stop['p95']:.0f}, worst {stop['worst']:.0f} ms ({late:.0f} until heard)"
    )
    return [
        (
            f"STOP to the cancel request at Nav2, {stop['presses']} presses",
            spread,
            f"median {STOP_MEDIAN_MS:.0f}, worst {STOP_WORST_MS:.0f} ms",
            stop["median"] <= STOP_MEDIAN_MS and stop["worst"] <= STOP_WORST_MS,
        ),
        *(
            (
                f"hold: {loss}",
                f"{', '.join(f'{each:.2f}' for each in times)} s",
                "1.0 s each",
                max(times) <= HOLD_S,
            )
            for loss, times in result["hold_s"].items()
        ),
        (
            f"repaint of {OBJECTS} objects, {paint['paints']} times",
            f"median {paint['median']:.1f}, p95 {paint['p95']:.1f} ms (the whole page {paint['page']['p95']:.1f})",
            f"p95 {REPAINT_MS:.0f} ms",
            paint["p95"] <= REPAINT_MS,
        ),
        (f"{TRIALS} trials, from the click to the list", f"{result['trials_ms']:.0f} ms", "", True),
        (
            f"holds of a healthy page in {healthy['seconds']:.0f} s",
            f"{healthy['false_holds']} (longest silence {healthy['longest_silence_s']:.2f} s)",
            "0",
            not healthy["false_holds"],
        ),
    ]


def _show(result: dict[str, Any]) -> None:
    from rich.table import Table

    shown = Table("what", "measured", "promised", "kept")
    for what, measured, promised, kept in _rows(result):
        shown.add_row(what, measured, promised, "yes" if kept else "NO")
    show(shown)


def _broken(result: dict[str, Any]) -> list[str]:
    return [f"{what}: {measured}, promised {promised}" for what, measured, promised, kept in _rows(result) if not kept]
