"""A person at the page: ask, approve, stop, and what never happens unasked. Order and effect; times are the bench's."""

from __future__ import annotations

import math
import os
from pathlib import Path

import pytest

from tests.browser.conftest import DESKTOP, MANY, PHONE, SCREENSHOTS, finish, until

NAMES, CONTRAST, COVERED = (
    (Path(__file__).parent / f"{name}.js").read_text() for name in ("names", "contrast", "covered")
)

ASK = "take me to the fire extinguisher"
THINGS = ("armchair", "bucket") if not SCREENSHOTS else ("laundry basket", "refrigerator")
ROUTE = f"go to the {THINGS[0]}"


def robot_at(tab) -> tuple[float, float] | None:
    pose = (tab.state().get("robot") or {}).get("pose")
    return pose and (pose["x"], pose["y"])


def walk(tab) -> None:
    """A mission whose robot is under way, to the thing that is further off."""
    here, objects = robot_at(tab), tab.page.evaluate("window.openbelief.plan.site.objects")
    places = {thing: next(each["centroid"][:2] for each in objects if each["label"] == thing) for thing in THINGS}
    tab.ask(f"go to the {max(THINGS, key=lambda thing: math.dist(here, places[thing]))}")
    tab.until_asked()
    start = robot_at(tab)
    tab.page.locator("#answer-yes").click()
    until(lambda: (now := robot_at(tab)) and math.dist(now, start) > 0.1, "the robot walks")


def until_it_stands(tab) -> None:
    def stands() -> bool:
        before = robot_at(tab)
        tab.page.wait_for_timeout(600)
        return bool(before) and math.dist(before, robot_at(tab)) < 0.01

    until(stands, "the robot stands")


@pytest.mark.parametrize(("name", "size"), [("desktop", DESKTOP), ("phone", PHONE)])
def test_the_first_candidate_is_rejected_and_the_second_confirmed(open_tab, name, size):
    tab = open_tab(size=size)
    tab.picture(f"{name}-ready")
    tab.take()
    tab.ask(ASK)
    tab.until_asked()
    assert "Go to #1" in tab.words("answer-yes") and "s left" in tab.words("question-left")
    if name == "phone":
        tab.page.locator("#tab-plan").click()
    tab.picture(f"{name}-question")
    tab.page.locator("#answer-yes").click()
    tab.until_state("Walking")
    until(lambda: "is not confirmed" in tab.said(), "the first candidate is rejected")
    tab.until_asked()
    if name == "phone":
        tab.page.locator("#tab-candidates").click()
    tab.picture(f"{name}-rejected")
    tab.page.locator("#answer-yes").click()
    tab.until_state("Found")
    if name == "phone":
        tab.page.locator("#tab-camera").click()
    tab.picture(f"{name}-found")
    mission = tab.state()["mission"]
    assert [look["verdict"] for look in mission["looks"]] == ["no matching mask", "confirmed"]
    assert {reply["who"] for reply in mission["replies"]} == {"operator"} and mission["how"] == "console"
    own = tab.page.url.split("/#")[0]
    assert all(url.replace("ws:", "http:").startswith((own, f"blob:{own}")) for url in tab.requests), tab.requests
    assert tab.complaints == []


STOPS = {
    "tap": lambda tab: tab.page.locator("#stop").click(),
    "Esc while typing": lambda tab: (tab.page.locator("#ask-words").fill("and"), tab.page.keyboard.press("Escape")),
    "hotkey": lambda tab: tab.page.keyboard.press("Control+."),
    "keyboard": lambda tab: (tab.page.locator("#stop").focus(), tab.page.keyboard.press("Enter")),
}


@pytest.mark.parametrize("how", STOPS)
def test_stop_while_the_robot_walks_cancels_and_says_heard_only_when_it_was(tab, how):
    walk(tab)
    STOPS[how](tab)
    until(lambda: tab.page.locator("#stop").get_attribute("data-state") == "heard", "STOP was heard")
    until_it_stands(tab)
    tab.until_state("Stopped")
    assert tab.state()["mission"]["outcome"]["end"] == "CANCELLED"
    if how == "tap":
        tab.picture("stopped")


@pytest.mark.parametrize("how", STOPS)
def test_stop_ends_a_question_and_counts_between_missions(tab, how):
    tab.ask(ROUTE)
    tab.until_asked()
    STOPS[how](tab)
    tab.until_state("Stopped")
    until(lambda: tab.state()["operator"]["mission"] is None, "the mission's end")
    assert tab.page.locator("#question").is_hidden()
    STOPS[how](tab)
    until(lambda: tab.page.locator("#stop").get_attribute("data-state") == "heard", "STOP was heard")


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


def test_a_takeover_is_seen_by_both_and_the_question_is_put_to_the_new_operator(tab, open_tab):
    tab.ask(ROUTE)
    tab.until_asked()
    first = tab.state()["operator"]["question"]["id"]
    other = open_tab()
    assert "Take over" in other.words("take")
    other.take()
    until(lambda: tab.state()["you"]["epoch"] is None, "the old page knows")
    assert tab.page.locator("#answer-yes").is_disabled() and "Take over" in tab.words("take")
    other.until_asked()
    assert other.state()["operator"]["question"]["id"] > first
    other.page.locator("#answer-no").click()
    until(lambda: other.state()["operator"]["mission"] is None, "declined")
    tab.take()


def crash(tab) -> None:
    with pytest.raises(Exception, match="crash"):
        tab.page.goto("chrome://crash")


HANG = "setTimeout(() => { for (const end = Date.now() + 4000; Date.now() < end;); })"


LOST = {
    "closed": lambda tab: tab.page.close(),
    "killed": crash,
    "script hung": lambda tab: tab.page.evaluate(
        "setTimeout(() => { for (const end = Date.now() + 4000; Date.now() < end;); })"
    ),
    "offline": lambda tab: tab.page.context.set_offline(True),
    "elsewhere": lambda tab: tab.page.goto("about:blank"),
}


@pytest.mark.parametrize("how", LOST)
def test_a_page_that_is_not_on_a_screen_holds_the_robot_and_nothing_resumes_unasked(open_tab, site, how):
    watcher, tab = open_tab("viewer"), open_tab()
    tab.take()
    walk(tab)
    LOST[how](tab)
    until(lambda: "The robot was stopped: The page of operator" in watcher.said(), "the robot is held")
    until_it_stands(watcher)
    held_at = robot_at(watcher)
    other = open_tab()
    other.take()  # the condition is over: somebody is there again
    other.until_asked()
    assert "May I walk on" in other.words("question-words")
    assert math.dist(held_at, robot_at(watcher)) < 0.05, "it did not move unasked"
    if how == "closed":
        other.picture("held")
    finish(other)


def test_a_command_given_offline_is_refused_and_never_carried_out(tab):
    tab.page.context.set_offline(True)
    until(lambda: not tab.page.evaluate("window.openbelief.link.open"), "the link is down")
    assert tab.page.locator("#ask-send").is_disabled()
    sent = tab.page.evaluate("window.openbelief.link.command({type: 'ask', epoch: 1, text: 'find the lamp'})")
    assert not sent["ok"] and "Not sent" in sent["text"]
    assert "No link to the console" in tab.words("state")
    tab.page.context.set_offline(False)
    until(lambda: tab.page.evaluate("window.openbelief.link.open"), "the link is up")
    until(lambda: tab.page.locator("#ask-send").is_enabled(), "the same page still commands")
    assert tab.state()["operator"]["waiting"] == [] and tab.state()["operator"]["mission"] is None


def test_everything_can_be_done_from_the_keyboard(tab):
    tab.page.locator("#ask-words").focus()
    tab.page.keyboard.type(ROUTE)
    tab.page.keyboard.press("Enter")
    tab.until_asked()
    for _ in range(40):
        if tab.page.evaluate("document.activeElement.id") == "answer-no":
            break
        tab.page.keyboard.press("Shift+Tab")
    tab.page.keyboard.press("Enter")
    until(lambda: tab.state()["operator"]["mission"] is None, "declined")
    assert tab.state()["mission"]["replies"][0]["reply"] == "no"


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_every_control_has_a_name_and_every_word_enough_contrast(open_tab, theme):
    tab = open_tab(theme=theme)
    tab.take()
    tab.ask(ROUTE)
    tab.until_asked()
    assert tab.page.evaluate(NAMES) == [] and tab.page.evaluate(CONTRAST) == []
    tab.picture(f"theme-{theme}")
    finish(tab)
    tab.page.locator("#to-trials").click()
    until(lambda: tab.page.locator("a.trial").count(), "the list")
    assert tab.page.evaluate(NAMES) == [] and tab.page.evaluate(CONTRAST) == []


def test_stop_is_on_every_page_of_a_phone_and_nothing_lies_over_it(open_tab):
    tab = open_tab(size=PHONE)
    for place in ("to-live", "to-trials"):
        tab.page.locator(f"#{place}").click()
        assert tab.page.evaluate(COVERED) == []
        assert tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_two_thousand_trials_are_listed_at_once_and_filtered(open_tab):
    if SCREENSHOTS:
        pytest.skip("the pictures show the trials of the flat")
    tab = open_tab()
    tab.page.locator("#to-trials").click()
    until(lambda: tab.page.locator("a.trial").count() > MANY, "every trial is listed")
    tab.page.locator("#trial-words").fill("number 1234")
    until(lambda: tab.page.locator("a.trial").count() == 1, "one is left")
    assert "find thing number 1234" in tab.page.locator("a.trial").inner_text()


def test_a_trial_is_scrubbed_from_its_file_alone(open_tab, site):
    tab = open_tab()
    tab.page.goto(tab.page.url.split("/#")[0] + "/#trials")
    tab.page.reload()
    tab.picture("trials")
    tab.page.goto(tab.page.url.split("/#")[0] + "/#trials/trial.mcap")
    state = tab.page.locator(".one .state")
    until(lambda: state.count() and state.inner_text() == "Found", "the end")
    tab.picture("trial")
    slider = tab.page.locator("input[type=range]")
    slider.focus()
    tab.page.keyboard.press("Home")
    until(lambda: state.inner_text() != "Found", "the beginning")
    for _ in range(6):
        tab.page.keyboard.press("PageUp")
    until(lambda: tab.page.locator(".one .candidate").count() > 1, "the candidates of then")
    note = f"seen from the page {os.getpid()}"
    tab.page.locator(".notes input").fill(note)
    tab.page.keyboard.press("Enter")
    until(lambda: note in (tab.page.locator(".notes ol").inner_text() or ""), "the note")
    with tab.page.expect_download() as download:
        tab.page.locator("a[download]").click()
    assert download.value.suggested_filename == "trial.zip"
    assert tab.complaints == []
