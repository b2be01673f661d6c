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
from tests.browser.steps import ASK, robot_at, until_idle, until_it_stands, walk

SPEECH = Path(__file__).parents[1] / "robot_app" / "voice" / "speech"
HUMAN = Path("/usr/share/pocketsphinx/test/data")
SEVEN_OF_CLUBS = HUMAN / "cards" / "003.wav"
FORWARD = "Go forward ten meters."
TIMES = 3  # that somebody says a thing until it is heard
# What the page says came of each utterance, in the order of the utterances; the line itself shows it for seconds only.
TOLD = """() => {
  const {talk} = openbelief.ask, say = talk.say;
  window.told = [];
  talk.say = (answer) => { window.told.push(answer.text); say(answer); };
}"""
needs_humans = pytest.mark.skipif(not HUMAN.exists(), reason="people's voices: apt-get install pocketsphinx-testdata")


@pytest.fixture(scope="module")
def microphone(tmp_path_factory: pytest.TempPathFactory) -> Microphone:
    return Microphone(tmp_path_factory.mktemp("microphone") / "said.wav")


@pytest.fixture(scope="module")
def talking(playwright: Playwright, microphone: Microphone, site: Site) -> Iterator[Tab]:
    browser = microphone.open(playwright, chromium_here())
    with tabs(browser, site) as opened:
        tab = opened(script=SOUNDS)
        tab.page.evaluate(TOLD)
        yield tab
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


def say(tab: Tab, microphone: Microphone, sound: Path | AudioClip, key: str = "") -> str:
    """Hold the button for as long as that takes; what the page says came of it."""
    microphone.hears(sound)
    before = tab.page.evaluate("window.told.length")
    if key:
        tab.page.locator("#talk").focus()
        tab.page.keyboard.down(key)
        tab.page.wait_for_timeout(1000 * (microphone.seconds + AFTER_S))
        tab.page.keyboard.up(key)
    else:
        tab.page.locator("#talk").dispatch_event("pointerdown", {"pointerId": 1})
        tab.page.wait_for_timeout(1000 * (microphone.seconds + AFTER_S))
        tab.page.locator("#talk").dispatch_event("pointerup", {"pointerId": 1})
    return str(until(lambda: tab.page.evaluate(f"window.told[{before}]"), "what came of it"))


def heard(tab: Tab) -> str:
    return tab.page.locator("#ask-words").input_value()


def letters(words: str) -> str:
    """A browser resamples a little differently each time, and the recogniser spells what it hears by that."""
    return "".join(words_of(words))


def said_until_heard(tab: Tab, microphone: Microphone, sound: Path, words: str) -> str:
    """Said again where it was heard otherwise, as a person would: a busy machine may lose a piece of the sound."""
    tried = []
    for _ in range(TIMES):
        told = say(tab, microphone, sound)
        if letters(transcript := heard(tab)) == letters(words):
            assert told.startswith("Heard with confidence")
            return transcript
        tried.append((transcript, told))
        tab.page.locator("#ask-words").fill("")
    raise AssertionError(f"{words!r} was heard as {tried}")


def stop_said_until_heard(tab: Tab, microphone: Microphone, name: str) -> None:
    told = [say(tab, microphone, SPEECH / f"{name}.wav")]
    while "STOP" not in told[-1] and len(told) < TIMES:
        told.append(say(tab, microphone, SPEECH / f"{name}.wav"))
    assert "STOP" in told[-1], told


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
    transcript = said_until_heard(mine, microphone, spoken, ASK)
    mine.page.keyboard.press("Enter")
    confirmed(mine)
    until_idle(mine)
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
    until_idle(mine)
    assert newest_trial(site).query.sentence == transcript


def test_a_garbled_thing_of_the_memory_is_suggested_and_only_asked_when_it_is_chosen(mine, microphone, site):
    say(mine, microphone, SPEECH / "fire_extinguisher_heard_as_extane_wisher.wav")
    transcript = heard(mine)
    assert "extinguisher" not in transcript and mine.state()["operator"]["waiting"] == []
    mine.page.locator("#meant button").first.click()
    mine.page.locator("#ask-words").press("Enter")
    mine.until_asked()
    mine.page.locator("#answer-no").click()
    until_idle(mine)
    trial = newest_trial(site)
    [said] = spoken_in(trial)
    assert (said.transcript, said.asked) == (transcript, trial.query.sentence)
    assert "fire extinguisher" in said.asked


@pytest.mark.parametrize("name", ["stop", "stop_heard_as_step"])
def test_a_spoken_stop_counts_while_the_robot_walks_also_where_it_is_heard_as_another_word(mine, microphone, name):
    walk(mine)
    stop_said_until_heard(mine, microphone, name)
    until_it_stands(mine)
    mine.until_state("Stopped")
    mission = mine.state()["mission"]
    assert mission["outcome"]["end"] == "CANCELLED" and "spoke" in mission["outcome"]["reason"]
    assert heard(mine) == "", "a stop is no sentence to ask"


def test_a_spoken_stop_ends_an_open_question(mine, microphone):
    mine.ask("go to the armchair")
    mine.until_asked()
    start = robot_at(mine)
    stop_said_until_heard(mine, microphone, "stop")
    until_idle(mine)
    assert mine.state()["mission"]["outcome"]["end"] == "CANCELLED" and robot_at(mine) == pytest.approx(start, abs=0.05)


def test_the_robot_falls_silent_while_the_page_listens(mine, microphone):
    mine.ask("go to the armchair")
    mine.until_asked()
    until(lambda: mine.page.evaluate("window.sounds.length"), "the question is said aloud")
    told = say(mine, microphone, AudioClip(np.zeros(RATE_HZ, np.float32)), key="Space")
    assert "nothing was said" in told, "silence is no sentence"
    [question] = mine.page.evaluate("window.sounds")
    assert question["lasted"] < question["seconds"] - 0.2, "cut off by the talk button"


# A browser that asks the person first: the microphone opens late, each time it is asked for.
SLOW_MICROPHONE = """() => {
  const open = navigator.mediaDevices.getUserMedia.bind(navigator.mediaDevices);
  window.opened = [];
  navigator.mediaDevices.getUserMedia = async (wanted) => {
    await new Promise((resume) => setTimeout(resume, 500));
    const stream = await open(wanted);
    window.opened.push(stream);
    return stream;
  };
}"""
LISTENING = "opened.flatMap((stream) => stream.getTracks()).filter((track) => track.readyState === 'live').length"


def test_pressed_anew_before_the_microphone_opened_no_microphone_stays_open(mine, microphone):
    mine.page.evaluate(SLOW_MICROPHONE)
    for event in ("pointerdown", "pointerup"):
        mine.page.locator("#talk").dispatch_event(event, {"pointerId": 1})
    said_until_heard(mine, microphone, SPEECH / "take_me_to_the_fire_extinguisher.wav", ASK)
    until(lambda: mine.page.evaluate("window.opened.length") > 1, "both were opened")
    until(lambda: mine.page.evaluate(LISTENING) == 0, "and each one is closed")
