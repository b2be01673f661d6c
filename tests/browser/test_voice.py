"""A person speaks at the page: asked, approved, confirmed; a spoken stop on the way; and the robot speaks back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Playwright

from logs.trial.reader import TrialReader
from logs.trial.records import Spoken
from robot_app.voice.audio import RATE_HZ, AudioClip
from robot_app.voice.words import words_of
from tests.browser.conftest import Site, Tab, finish, tabs, until
from tests.browser.microphone import AFTER_S, SOUNDS, Microphone, chromium_here
from tests.browser.steps import robot_at, until_it_stands, walk

SPEECH = Path(__file__).parents[1] / "robot_app" / "voice" / "speech"
HUMAN = Path("/usr/share/pocketsphinx/test/data")
SEVEN_OF_CLUBS = HUMAN / "cards" / "003.wav"
FORWARD = "Go forward ten meters."
TIMES = 3  # that somebody says a thing until it is heard
needs_humans = pytest.mark.skipif(not HUMAN.exists(), reason="people's voices: apt-get install pocketsphinx-testdata")


@pytest.fixture(scope="module")
def microphone(tmp_path_factory: pytest.TempPathFactory) -> Microphone:
    return Microphone(tmp_path_factory.mktemp("microphone") / "said.wav")


@pytest.fixture(scope="module")
def talking(playwright: Playwright, microphone: Microphone, site: Site) -> Iterator[Tab]:
    browser = microphone.open(playwright, chromium_here())
    with tabs(browser, site) as opened:
        yield opened(script=SOUNDS)
    browser.close()


@pytest.fixture
def mine(talking: Tab) -> Iterator[Tab]:
    """The page that commands, before a microphone; afterwards nothing is under way."""
    if not talking.state()["you"]["epoch"]:
        talking.take()
    talking.page.evaluate("window.sounds.length = 0")
    talking.page.locator("#ask-words").fill("")
    yield talking
    finish(talking)


def say(tab: Tab, microphone: Microphone, sound: Path | AudioClip, key: str = "") -> None:
    """Hold the button for as long as that takes."""
    microphone.hears(sound)
    if key:
        tab.page.locator("#talk").focus()
        tab.page.keyboard.down(key)
        tab.page.wait_for_timeout(1000 * (microphone.seconds + AFTER_S))
        tab.page.keyboard.up(key)
        return
    tab.page.locator("#talk").dispatch_event("pointerdown", {"pointerId": 1})
    tab.page.wait_for_timeout(1000 * (microphone.seconds + AFTER_S))
    tab.page.locator("#talk").dispatch_event("pointerup", {"pointerId": 1})


def heard(tab: Tab) -> str:
    return until(lambda: tab.page.locator("#ask-words").input_value(), "the transcript in the ask line")


def letters(words: str) -> str:
    """A browser resamples a little differently each time, and the recogniser spells what it hears by that."""
    return "".join(words_of(words))


def said_until_heard(tab: Tab, microphone: Microphone, sound: Path, words: str) -> str:
    """Said again where it was heard otherwise, as a person would: a busy machine may lose a piece of the sound."""
    for _ in range(TIMES):
        say(tab, microphone, sound)
        if letters(transcript := heard(tab)) == letters(words):
            return transcript
        tab.page.locator("#ask-words").fill("")
    raise AssertionError(f"{words!r} was heard as {transcript!r}")


def newest_trial(site: Site) -> TrialReader:
    return TrialReader(max(site.folder.glob("trial_*.mcap"), key=lambda path: path.stat().st_mtime))


def spoken_in(trial: TrialReader) -> list[Spoken]:
    return [record for record in trial.records if isinstance(record, Spoken)]


def confirmed(tab: Tab, most: int = 3) -> None:
    """Yes to each candidate until one is confirmed."""
    for _ in range(most):
        tab.until_asked()
        number = tab.state()["operator"]["question"]["id"]
        tab.page.locator("#answer-yes").click()
        until(lambda: (tab.state()["operator"]["question"] or {"id": 0})["id"] != number, "the answer was taken")  # noqa: B023
        until(lambda: tab.state()["operator"]["question"] or tab.words("state") == "Found", "what it found")
        if tab.words("state") == "Found":
            return
    raise AssertionError(tab.words("state"))


def test_what_is_said_at_the_page_is_asked_approved_and_confirmed_and_the_robot_speaks_back(mine, microphone, site):
    spoken = SPEECH / "take_me_to_the_fire_extinguisher.wav"
    transcript = said_until_heard(mine, microphone, spoken, "take me to the fire extinguisher")
    assert mine.words("ask-answer").startswith("Heard with confidence")
    mine.page.keyboard.press("Enter")
    confirmed(mine)
    until(lambda: "trial: " in mine.said(), "the trial is written")
    trial = newest_trial(site)
    [said] = spoken_in(trial)
    assert (trial.query.sentence, trial.query.how) == (transcript, "console")
    assert (said.transcript, said.asked) == (transcript, transcript) and 0 < said.confidence <= 1
    sounds = mine.page.evaluate("window.sounds")
    assert len(sounds) >= 3, "the questions, why not, and what was found"
    assert all(each["peak"] > 0.05 and each["seconds"] > 0.4 and not each["listening"] for each in sounds)
    ends = [each["began"] + 1000 * each.get("lasted", 0) for each in sounds]
    assert all(end < after["began"] + 50 for end, after in zip(ends, sounds[1:], strict=False)), "one after the other"
    assert mine.trouble() == []


@needs_humans
def test_what_a_person_says_is_asked_approved_and_confirmed(mine, microphone, site):
    transcript = said_until_heard(mine, microphone, SEVEN_OF_CLUBS, "seven of clubs")
    mine.page.keyboard.press("Enter")
    confirmed(mine)
    until(lambda: newest_trial(site).query.sentence == transcript, "the trial is written")


def test_a_garbled_thing_of_the_memory_is_suggested_and_only_asked_when_it_is_chosen(mine, microphone, site):
    say(mine, microphone, SPEECH / "fire_extinguisher_heard_as_extane_wisher.wav")
    transcript = heard(mine)
    assert "extinguisher" not in transcript and mine.state()["operator"]["waiting"] == []
    mine.page.locator("#meant button").first.click()
    mine.page.locator("#ask-words").press("Enter")
    mine.until_asked()
    mine.page.locator("#answer-no").click()
    until(lambda: mine.state()["operator"]["mission"] is None, "declined")
    until(lambda: "trial: " in mine.said(), "the trial is written")
    trial = newest_trial(site)
    [said] = spoken_in(trial)
    assert (said.transcript, said.asked) == (transcript, trial.query.sentence)
    assert "fire extinguisher" in said.asked


@pytest.mark.parametrize("name", ["stop", "stop_heard_as_step"])
def test_a_spoken_stop_counts_while_the_robot_walks_also_where_it_is_heard_as_another_word(mine, microphone, name):
    walk(mine)
    say(mine, microphone, SPEECH / f"{name}.wav")
    until_it_stands(mine)
    mine.until_state("Stopped")
    mission = mine.state()["mission"]
    assert mission["outcome"]["end"] == "CANCELLED" and "spoke" in mission["outcome"]["reason"]
    assert "STOP" in mine.words("ask-answer") and mine.page.locator("#ask-words").input_value() == ""


def test_a_spoken_stop_ends_an_open_question(mine, microphone):
    mine.ask("go to the armchair")
    mine.until_asked()
    start = robot_at(mine)
    say(mine, microphone, SPEECH / "stop.wav")
    until(lambda: mine.state()["operator"]["mission"] is None, "the mission's end")
    assert mine.state()["mission"]["outcome"]["end"] == "CANCELLED" and robot_at(mine) == pytest.approx(start, abs=0.05)


def test_the_robot_falls_silent_while_the_page_listens(mine, microphone):
    mine.ask("go to the armchair")
    mine.until_asked()
    until(lambda: mine.page.evaluate("window.sounds.length"), "the question is said aloud")
    say(mine, microphone, AudioClip(np.zeros(RATE_HZ, np.float32)), key="Space")
    until(lambda: "nothing was said" in mine.words("ask-answer"), "silence is no sentence")
    [question] = mine.page.evaluate("window.sounds")
    assert question["lasted"] < question["seconds"] - 0.2, "cut off by the talk button"
