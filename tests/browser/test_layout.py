"""STOP and what is always visible, whole on the screen at every size, whatever is open."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import DESKTOP, finish, until
from tests.browser.steps import ASK, told_trial

WHOLE = (Path(__file__).parent / "covered.js").read_text()
ALWAYS = ["state", "reason", "commander", "link-age", "battery", "disk", "recording", "stop"]
SIZES = {
    "desk": (1440, 900),
    "small desk": (1024, 600),
    "tablet": (768, 1024),
    "phone": (390, 844),
    "small phone": (320, 568),
    "phone with its keyboard open": (390, 430),
    "phone on its side": (844, 390),
    "phone on its side with its keyboard open": (844, 210),
}


def trouble(tab) -> dict[str, list[str]]:
    """What is not whole on the screen, by size."""
    found = {}
    for name, (width, height) in SIZES.items():
        tab.page.set_viewport_size({"width": width, "height": height})
        tab.page.wait_for_timeout(60)
        wrong = tab.page.evaluate(f"({WHOLE})({ALWAYS})")
        if not tab.page.evaluate("document.documentElement.scrollWidth <= innerWidth"):
            wrong.append("the page is wider than the screen")
        if wrong:
            found[name] = wrong
    tab.page.set_viewport_size(DESKTOP)
    return found


def test_stop_and_what_is_always_visible_are_whole_at_every_size_whatever_is_open(open_tab, site):
    tab = open_tab()
    assert trouble(tab) == {}
    tab.take()
    tab.ask(ASK)
    tab.until_asked()
    tab.page.locator("#answer-why").click()
    assert trouble(tab) == {}
    for name, size in (("phone-side", (844, 390)), ("phone-keyboard", (390, 430))):
        tab.page.set_viewport_size(dict(zip(("width", "height"), size, strict=True)))
        assert answers_in_sight(tab), name
        tab.picture(f"{name}")
    tab.page.set_viewport_size({"width": 390, "height": 844})
    tab.page.locator("#answer-why").click()
    assert tab.page.locator("#stop").bounding_box()["y"] > 740 and dock_height(tab) < 0.42 * 844
    tab.page.set_viewport_size(DESKTOP)
    tab.page.locator("#ask-words").fill("and then to the armchair, please, as soon as that is possible")
    tab.page.locator("#ask-words").focus()
    assert trouble(tab) == {}
    tab.page.evaluate("openbelief.ask.say({ok: false, text: 'Not done: that was too long ago. Look again.'})")
    assert trouble(tab) == {}
    finish(tab)
    tab.page.evaluate("location.hash = 'trials'")
    until(lambda: tab.page.locator("a.trial").count(), "the list")
    assert trouble(tab) == {}
    tab.page.evaluate("(name) => { location.hash = `trials/${name}`; }", told_trial(site))
    until(lambda: tab.page.locator(".one .check").count(), "a trial")
    assert trouble(tab) == {}


def answers_in_sight(tab) -> bool:
    return not tab.page.evaluate(f"({WHOLE})(['answer-yes', 'answer-other', 'answer-no'])")


def dock_height(tab) -> float:
    return tab.page.locator(".dock").bounding_box()["height"]


# What a browser tells that lays out nothing anew for its keyboard (iOS): only the visual viewport becomes lower.
KEYBOARD = """(height) => {
  Object.defineProperty(visualViewport, "height", {get: () => height, configurable: true});
  visualViewport.dispatchEvent(new Event("resize"));
}"""


@pytest.mark.parametrize("height", [430, 844])
def test_a_keyboard_that_lies_over_the_page_never_covers_stop(open_tab, height):
    tab = open_tab(size={"width": 390, "height": 844})
    tab.page.evaluate(KEYBOARD, height)
    box = tab.page.locator("#stop").bounding_box()
    assert box["y"] + box["height"] <= height and box["y"] + box["height"] > height - 20
