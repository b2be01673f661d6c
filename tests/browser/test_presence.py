"""A page that is not on a screen: the robot is held, and nothing resumes unasked."""

from __future__ import annotations

import math
from contextlib import ExitStack

import pytest

from robot_app.benches.chromium import PlainChromium
from tests.browser.conftest import finish, until
from tests.browser.steps import ROUTE, robot_at, until_idle, until_it_stands, walk


def crash(tab) -> None:
    with pytest.raises(Exception, match="crash"):
        tab.page.goto("chrome://crash")


HANG = "setTimeout(() => { for (const end = Date.now() + 4000; Date.now() < end;); })"

LOST = {
    "closed": lambda tab: tab.page.close(),
    "killed": crash,
    "script hung": lambda tab: tab.page.evaluate(HANG),
    "offline": lambda tab: tab.page.context.set_offline(True),
    "elsewhere": lambda tab: tab.page.goto("about:blank"),
}


@pytest.mark.parametrize("how", LOST)
def test_a_page_that_is_not_on_a_screen_holds_the_robot_and_nothing_resumes_unasked(open_tab, how):
    watcher, tab = open_tab("viewer"), open_tab()
    tab.may_complain = "ERR_INTERNET_DISCONNECTED"
    tab.take()
    walk(tab)
    LOST[how](tab)
    until_held(watcher)
    held_at = robot_at(watcher)
    other = open_tab()
    other.take()  # the condition is over: somebody is there again
    other.until_asked()
    assert "May I walk on" in other.words("question-words")
    assert math.dist(held_at, robot_at(watcher)) < 0.05, "it did not move unasked"
    if how == "closed":
        other.picture("held")
    finish(other)


BEHIND = {"another tab in front": "cover", "window minimised": "minimise"}


@pytest.mark.parametrize("how", BEHIND)
def test_a_tab_that_is_hidden_holds_the_robot_and_asks_when_it_is_seen_again(open_tab, site, how):
    """In a Chromium without the switches by which Playwright keeps every tab awake."""
    watcher = open_tab("viewer")
    with ExitStack() as opened:
        tab = PlainChromium(opened).tab(site.program.link())
        until(lambda: tab.evaluate("Boolean(window.openbelief?.painted)"), "the first painted snapshot")
        tab.evaluate("openbelief.link.command({type: 'take', over: true})")
        until(lambda: tab.evaluate("openbelief.painted.you.epoch"), "the command")
        tab.evaluate(f"openbelief.link.command({{type: 'ask', epoch: openbelief.state.you.epoch, text: '{ROUTE}'}})")
        until(lambda: tab.evaluate("openbelief.question.asked !== null && openbelief.question.endsAt"), "the question")
        start = robot_at(watcher)
        tab.click("answer-yes")
        until(lambda: math.dist(start, robot_at(watcher)) > 0.1, "the robot walks")
        show_again = getattr(tab, BEHIND[how])()
        until_held(watcher)
        held_at = robot_at(watcher)
        assert tab.evaluate("document.visibilityState") == "hidden"
        show_again()
        until(lambda: "May I walk on" in tab.evaluate("document.getElementById('question').innerText"), "it asks")
        assert math.dist(held_at, robot_at(watcher)) < 0.05, "it did not move unasked"
        tab.click("stop")
        until_idle(watcher)


def until_held(watcher) -> None:
    until(lambda: "The robot was stopped: The page of operator" in watcher.said(), "the robot is held")
    until_it_stands(watcher)
