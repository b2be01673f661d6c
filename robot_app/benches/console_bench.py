"""What is measured of the console in a real Chromium: STOP, a lost page, a healthy one, the repaint, a long list."""

from __future__ import annotations

import random
import statistics
import threading
import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

from robot_app.benches.chromium import PlainChromium, PlainTab
from robot_app.benches.loaded_console import TRIALS, LoadedConsole, site
from robot_app.benches.lost_pages import DRIVEN, PLAIN
from robot_app.benches.programs import THING, until
from robot_app.cli import Failure

if TYPE_CHECKING:
    from robot_app.mission.notices import Notice

LOOK_S = 0.02  # at a healthy page's silence: three times as often as a mission looks
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
    """What is measured of a console and its pages, which log in by pairing links."""

    def __init__(self, console: LoadedConsole) -> None:
        self._robot, self._operator = console.robot, console.operator
        self._link, self._browser = console.link, console.browser
        self._page: Any = None
        self._heard_ns = 0
        self._operator.listen(self._hear)

    def page(self) -> Any:
        """A page that commands and paints 2 000 objects."""
        if self._page is None or self._page.is_closed():
            context = self._browser.new_context(viewport={"width": 1440, "height": 900})
            self._page = context.new_page()
            self._page.goto(self._link())
            self._until("painted snapshot", PAINTED)
            self._page.evaluate("(site) => openbelief.plan.setSite(site, null, null)", site())
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


def _command(page: Any, message: str) -> None:
    """Sent by the page, and done. Raises Failure with what the console said."""
    answer = page.evaluate(f"openbelief.link.command({message})")
    if not answer["ok"]:
        raise Failure(f"the console did not do {message}: {answer['text']}")


def _epoch_ns(monotonic_ns: int) -> int:
    return monotonic_ns + time.time_ns() - time.monotonic_ns()


def _spread(values: list[float]) -> dict[str, float]:
    ordered = sorted(values)
    p95 = ordered[min(len(ordered) - 1, int(0.95 * len(ordered)))]
    return {
        name: round(value, 1)
        for name, value in {"median": statistics.median(ordered), "p95": p95, "worst": ordered[-1]}.items()
    }
