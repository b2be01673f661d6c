"""STOP, by whom and how ever: while the robot walks, while a question waits, between missions.

test_stop_while_it_looks.py has the states of an arrival.
"""

from __future__ import annotations

import pytest

from tests.browser.conftest import until
from tests.browser.steps import ROUTE, STOPS, until_idle, until_it_stands, walk


@pytest.mark.parametrize("how", STOPS)
def test_stop_while_the_robot_walks_cancels_and_says_heard_only_when_it_was(tab, how):
    walk(tab)
    tab.stopped(STOPS[how])
    until_it_stands(tab)
    tab.until_state("Stopped")
    assert tab.state()["mission"]["outcome"]["end"] == "CANCELLED"
    if how == "tap":
        tab.picture("stopped")


@pytest.mark.parametrize("how", STOPS)
def test_stop_ends_a_question_and_counts_between_missions(tab, how):
    tab.ask(ROUTE)
    tab.until_asked()
    tab.stopped(STOPS[how])
    tab.until_state("Stopped")
    until_idle(tab)
    assert tab.page.locator("#question").is_hidden()
    before = last_stop_ms(tab)
    tab.stopped(STOPS[how])
    until(lambda: last_stop_ms(tab) > before, "the page tells of the second STOP")
    tab.until_stopped_by("operator")


def last_stop_ms(tab) -> int:
    """When the last STOP was that the page tells of."""
    return max(each["at_ms"] for each in tab.state()["said"] if each["text"].startswith("STOP: "))


def test_a_viewer_stops_and_can_do_nothing_else(tab, open_tab):
    viewer = open_tab("viewer")
    assert viewer.page.locator("#ask-words").is_disabled() and viewer.page.locator("#take").is_hidden()
    walk(tab)
    assert viewer.page.locator("#answer-yes").is_hidden() or viewer.page.locator("#answer-yes").is_disabled()
    viewer.page.locator("#stop").click()
    until_it_stands(tab)
    tab.until_state("Stopped")
    assert "viewer pressed STOP" in tab.words("reason")


def test_stop_works_on_the_page_of_the_trials_too(tab):
    walk(tab)
    tab.page.locator("#to-trials").click()
    tab.page.locator("#stop").click()
    until_it_stands(tab)
    tab.until_state("Stopped")
