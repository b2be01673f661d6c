"""Who sees little, or nothing, or uses no mouse: contrast, names for a screen reader, the keyboard alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import DESKTOP, PHONE, SCREENSHOTS, finish, until
from tests.browser.steps import ASK, told_trial, until_idle

CONTRAST = (Path(__file__).parent / "contrast.js").read_text()
CONTROLS = {"button", "link", "textbox", "searchbox", "combobox", "slider", "tab", "image", "list", "region", "main"}


@pytest.mark.parametrize(("size", "name"), [(DESKTOP, "desktop"), (PHONE, "phone")], ids=["desktop", "phone"])
@pytest.mark.parametrize("theme", ["dark", "light"])
def test_every_control_has_a_name_and_every_word_enough_contrast(open_tab, site, theme, size, name):
    tab = open_tab(theme=theme, size=size)
    check(tab)
    tab.take()
    tab.ask(ASK)
    tab.until_asked()
    check(tab)
    if size is PHONE:
        for each in ("plan", "candidates"):
            tab.page.locator(f"#tab-{each}").click()
            check(tab)
    tab.picture(f"{name}-{theme}")
    finish(tab)
    tab.page.locator("#to-trials").click()
    tab.page.locator("#trial-words").fill("trial" if SCREENSHOTS else "number 123")
    until(lambda: 0 < tab.page.locator("a.trial").count() < 50, "a part of the list")
    check(tab)
    trial = told_trial(site)
    tab.page.evaluate("(name) => { location.hash = `trials/${name}`; }", trial)
    until(lambda: tab.page.locator(".one .check").count(), "a trial")
    check(tab)
    tab.page.locator("#logout").click()
    until(lambda: tab.page.locator("#login-name").is_visible(), "the login")
    check(tab)
    tab.may_complain = "401"


def check(tab) -> None:
    assert tab.page.evaluate(CONTRAST) == []
    assert [node for node in tree(tab) if node[0] in CONTROLS and not node[1]] == []


def tree(tab) -> list[tuple[str, str]]:
    """The role and the name of everything that a screen reader is given."""
    session = tab.page.context.new_cdp_session(tab.page)
    nodes = session.send("Accessibility.getFullAXTree")["nodes"]
    session.detach()
    return [(node["role"]["value"], node.get("name", {}).get("value", "")) for node in nodes if not node["ignored"]]


def test_a_screen_reader_is_told_the_state_the_question_and_what_each_button_does(tab):
    tab.ask(ASK)
    tab.until_asked()
    told = tree(tab)
    label = tab.state()["mission"]["candidates"][0]["label"]
    names = {name for role, name in told if role == "button"}
    assert any(name.startswith("Go to #1, ") and name.endswith(f": {label}") for name in names), names
    assert {"Not this one", "No", "Why?", "Ask"} <= names and any(name.startswith("STOP") for name in names)
    assert any(name.startswith("Take candidate 2, ") for name in names)
    assert any(role == "alert" for role, _ in told), "the question is announced"
    assert any(role == "status" for role, _ in told), "so is the state"
    words = " ".join(name for role, name in told if role == "StaticText")
    assert "Waiting for your yes" in words and f"May I walk to the {label}" in words
    pictures = [name for role, name in told if role == "image"]
    assert any(name.startswith("Plan of the site. The robot is at ") for name in pictures), pictures


def test_everything_can_be_done_from_the_keyboard(tab):
    """Ask, evidence, another candidate, yes, look at the plan, STOP: with Tab, Enter and arrow keys."""
    tab.page.locator("#ask-words").focus()
    tab.page.keyboard.type(ASK)
    tab.page.keyboard.press("Enter")
    tab.until_asked()
    focus(tab, lambda now: now["label"].startswith("Take candidate 2, "))
    before = tab.state()["operator"]["question"]
    tab.page.keyboard.press("Enter")
    until(lambda: (now := tab.state()["operator"]["question"]) and now["id"] > before["id"], "the question about it")
    tab.until_asked()
    focus(tab, lambda now: now["id"] == "plan")
    for key in ("+", "+", "ArrowLeft", "Enter"):
        tab.page.keyboard.press(key)
    until(lambda: "Seen" in tab.words("evidence"), "the evidence of what is in the plan's middle")
    focus(tab, lambda now: now["id"] == "answer-no")
    tab.page.keyboard.press("Enter")
    until_idle(tab)
    assert [each["reply"] for each in tab.state()["mission"]["replies"]] == ["take", "no"]


def test_the_tabs_of_a_phone_answer_to_arrow_keys(open_tab):
    tab = open_tab(size=PHONE)
    tab.page.locator("#tab-camera").focus()
    tab.page.keyboard.press("ArrowRight")
    assert tab.page.evaluate("document.activeElement.id") == "tab-plan" and tab.page.locator("#plan-panel").is_visible()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.keyboard.press("ArrowLeft")
    assert tab.page.locator("#candidates-panel").is_visible() and tab.page.locator("#plan-panel").is_hidden()


def focus(tab, wanted) -> None:
    """By Tab alone, from where the focus is."""
    seen = []
    for _ in range(60):
        now = tab.page.evaluate(
            "(({id, ariaLabel, textContent}) => ({id, label: ariaLabel || textContent}))(document.activeElement)"
        )
        if wanted(now):
            return
        seen.append(now)
        tab.page.keyboard.press("Tab")
    raise AssertionError(seen)
