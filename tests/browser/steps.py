"""What the tests do again and again: have the robot walk, see where it is and whether it stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.browser.conftest import RECORDED, SCREENSHOTS, Site, Tab, until

SNAPSHOTS = 4  # in 0.6 s, at ten a second
ASK = "take me to the fire extinguisher"
THINGS = ("armchair", "bucket") if not SCREENSHOTS else ("laundry basket", "refrigerator")
ROUTE = f"go to the {THINGS[0]}"


def robot_at(tab: Tab) -> tuple[float, float] | None:
    pose = (tab.state().get("robot") or {}).get("pose")
    return pose and (pose["x"], pose["y"])


def ask_for_what_is_far(tab: Tab) -> None:
    here, objects = robot_at(tab), tab.page.evaluate("window.openbelief.plan.site.objects")
    places = {thing: next(each["centroid"][:2] for each in objects if each["label"] == thing) for thing in THINGS}
    tab.ask(f"go to the {max(THINGS, key=lambda thing: math.dist(here, places[thing]))}")


def walk(tab: Tab) -> None:
    """A mission whose robot is under way, to the thing that is further off."""
    ask_for_what_is_far(tab)
    tab.until_asked()
    start = robot_at(tab)
    tab.page.locator("#answer-yes").click()
    until_under_way(tab, lambda: (now := robot_at(tab)) and math.dist(now, start) > 0.1, "the robot walks")


def until_under_way(tab: Tab, happens: Callable[[], Any], what: str) -> None:
    """A machine that keeps the page from its screen for 0.7 s has the robot held: where it asks, it may walk on."""
    until(lambda: happens() or walk_on(tab), f"{what}, and it asks for nothing else")


def walk_on(tab: Tab) -> None:
    asked = tab.state()["operator"]["question"]
    if asked and "May I walk on" in asked["sentence"]:
        tab.page.evaluate("document.getElementById('answer-yes').click()")


def until_it_stands(tab: Tab) -> None:
    def stands() -> bool:
        before, number = robot_at(tab), tab.state()["n"]
        tab.page.wait_for_timeout(600)
        seen = tab.state()["n"] >= number + SNAPSHOTS  # a page that paints nothing shows a robot that does not move
        return bool(before) and seen and math.dist(before, robot_at(tab)) < 0.01

    until(stands, "the robot stands")


def until_idle(tab: Tab) -> None:
    until(lambda: tab.state()["operator"]["mission"] is None, "the end of the mission")


def newest_trial(site: Site) -> Path:
    return max(site.folder.glob("trial_*.mcap"), key=lambda path: path.stat().st_mtime_ns)


def told_trial(site: Site) -> str:
    """The name of a whole trial: of another site, or in the pictures the first one, whose story they tell."""
    if SCREENSHOTS:
        return min(site.folder.glob("trial_*.mcap"), key=lambda path: path.stat().st_mtime_ns).name
    return RECORDED.name


TYPED = "and"  # half a sentence, when it becomes urgent
STOPS: dict[str, Callable[[Tab], Any]] = {
    "tap": lambda tab: tab.page.locator("#stop").click(),
    "Esc while typing": lambda tab: (tab.page.locator("#ask-words").fill(TYPED), tab.page.keyboard.press("Escape")),
    "hotkey": lambda tab: tab.page.keyboard.press("Control+."),
    "keyboard": lambda tab: (tab.page.locator("#stop").focus(), tab.page.keyboard.press("Enter")),
}
