"""STOP while the robot looks, and looks again."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from logs.trial.reader import TrialReader
from logs.trial.records import Transition
from tests.browser.conftest import Program, Site
from tests.browser.steps import ROUTE, STOPS, newest_trial, until_idle

# Resolves when the page shows a mission in that state, or that it has ended; a robot that was held may walk on.
IN_STATE = """(state) => new Promise((done) => {
  const look = () => {
    const {mission, operator} = openbelief.painted;
    if (operator.question?.sentence.includes("May I walk on")) document.getElementById("answer-yes").click();
    mission.state === state || mission.outcome ? done() : requestAnimationFrame(look);
  };
  look();
})"""
TRIES = 12  # a look takes half a second: it may be over when the page shows it


@pytest.fixture(scope="module")
def site(folder: Path) -> Iterator[Site]:
    """Where no look shows enough, so that the robot always looks again."""
    config = folder / "careful.toml"
    careful = (folder / "robot.toml").read_text().replace("[parameters]", "[parameters]\ntau_nu = 0.999")
    config.write_text(careful.replace('serve = "here"', 'serve = "off"'))  # another program serves there
    program = Program("run", "--config", str(config), "--console", "0")
    yield Site(folder, program)
    program.end()


@pytest.mark.parametrize("how", ["tap", "Esc while typing"])
@pytest.mark.parametrize("state", ["verify", "re_observe"])
def test_stop_is_heard_in_each_state_of_an_arrival(tab, state, how):
    assert stopped_in(state, tab, lambda: tab.stopped(STOPS[how]))


def test_a_viewer_stops_a_robot_that_looks_again(tab, open_tab):
    viewer = open_tab("viewer")
    assert stopped_in("re_observe", tab, lambda: viewer.stopped(STOPS["hotkey"]))


def stopped_in(state, tab, stop) -> bool:
    """Whether a mission was stopped in that state; every STOP was heard."""
    for _ in range(TRIES):
        tab.ask(ROUTE)
        tab.until_asked()
        tab.page.locator("#answer-yes").click()
        tab.page.evaluate(IN_STATE, state)
        stop()
        until_idle(tab)
        tab.until_state("Stopped")
        steps = [entry.record for entry in TrialReader(newest_trial(tab.site)).entries]
        last = [step for step in steps if isinstance(step, Transition)][-1]
        if (last.source, last.target) == (state, "cancelled"):
            return True
    return False
