"""What an utterance means: a stop, a sentence, what else may have been meant, or nothing at all."""

from __future__ import annotations

import pytest

from robot_app.voice.listener import Listener, NothingHeard
from robot_app.voice.spoken_stop import spoken_stop
from robot_app.voice.suggestions import suggestions
from robot_app.voice.words import word_errors, words_in_common, words_of

from .conftest import ScriptedRecogniser, clip, silence, tone

PHRASES = ("fire extinguisher", "red chair", "newspaper", "sofa")
SPOKEN = clip(silence(0.5), tone(0.6), silence(0.5))


@pytest.mark.parametrize(
    ("said", "near_miss"),
    [
        ("Stop.", False),
        ("STOP!", False),
        ("Stop! Stop! Stop!", False),
        ("please stop", False),
        ("Stop now", False),
        ("stop right now", False),
        ("halt", False),
        ("Step,", True),
        ("Top.", True),
        ("It's top.", True),
        ("Stock, stop", False),
    ],
)
def test_a_spoken_stop_counts_with_its_near_misses(said, near_miss):
    heard = spoken_stop(said)
    assert heard is not None and heard.near_miss == near_miss
    assert "emergency" not in heard.because


@pytest.mark.parametrize(
    "said",
    [
        "",
        "...",
        "yes",
        "red chair",
        "step ladder",
        "stock pot",
        "find the stop sign in the hall",
        "go to the top shelf",
    ],
)
def test_what_is_no_stop_is_none(said):
    assert spoken_stop(said) is None


def test_a_garbled_phrase_of_the_memory_is_suggested_in_its_sentence():
    [found] = suggestions("Take me to the fire-extane wisher.", PHRASES)
    assert (found.phrase, found.sentence) == ("fire extinguisher", "Take me to the fire extinguisher.")
    assert 0.75 <= found.ratio < 1


@pytest.mark.parametrize("said", ["go to the red chair", "go to the red-chair", "bring me a teapot", "", "go to the"])
def test_nothing_is_suggested_for_what_the_memory_knows_or_nothing_is_like(said):
    assert suggestions(said, PHRASES) == []


def test_a_second_hearing_that_knows_the_thing_is_offered_as_it_was_heard():
    [found] = suggestions("Take me to the wire ticket.", PHRASES, "Take me to the sofa.")
    assert (found.phrase, found.sentence, found.ratio) == ("sofa", "Take me to the sofa.", 1.0)


def test_where_the_verb_is_garbled_too_the_thing_alone_is_offered():
    [found] = suggestions("Take meat on the fire extine wisher.", PHRASES)
    assert (found.phrase, found.sentence) == ("fire extinguisher", "fire extinguisher")


@pytest.mark.parametrize(
    "said", ["he was not an ill disposed young man", "four queen of gloves", "I read a news story"]
)
def test_what_only_sounds_a_little_like_a_thing_is_not_offered(said):
    assert suggestions(said, PHRASES, said) == []


def test_the_place_of_a_sentence_is_left_as_it_was_said():
    [found] = suggestions("find the read chair in the kitchen", PHRASES)
    assert found.sentence == "find the red chair in the kitchen"


def test_an_utterance_holds_what_was_said_what_was_heard_and_how_surely():
    recogniser = ScriptedRecogniser("Find the read chair", 0.5)
    heard = Listener(recogniser, PHRASES).understand(SPOKEN)
    assert (heard.transcript, heard.confidence, heard.stop) == ("Find the read chair", 0.5, None)
    assert heard.clip is SPOKEN and len(recogniser.heard[0]) < len(SPOKEN.samples)
    assert [each.phrase for each in heard.suggestions] == ["red chair"]
    assert heard.told == '"Find the read chair" (confidence 0.50)'


def test_a_stop_counts_in_either_of_two_hearings():
    heard = Listener(ScriptedRecogniser("So?", 0.0, again="Stop.")).understand(SPOKEN)
    assert heard.stop is not None and heard.stop.word == "stop"


def test_a_confidence_that_nobody_knows_is_unknown():
    assert "confidence unknown" in Listener(ScriptedRecogniser("sofa")).understand(SPOKEN).told


@pytest.mark.parametrize("words", ["", " . ", "?!"])
def test_sound_without_words_is_nothing_heard(words):
    with pytest.raises(NothingHeard, match="no words"):
        Listener(ScriptedRecogniser(words)).understand(SPOKEN)


def test_silence_never_reaches_the_recogniser():
    recogniser = ScriptedRecogniser("You")
    with pytest.raises(NothingHeard, match="nothing was said"):
        Listener(recogniser).understand(clip(silence(2.0)))
    assert recogniser.heard == []


def test_word_errors_count_substitutions_deletions_and_insertions():
    assert words_of("Don\u2019t STOP, Mr. Robot!") == ["don't", "stop", "mr", "robot"]
    assert word_errors(list("abc"), list("axc")) == 1
    assert word_errors(list("abc"), list("ac")) == 1
    assert word_errors(list("abc"), list("abbcd")) == 2
    assert word_errors([], ["a"]) == 1
    assert words_in_common("go to the sofa", "Go to the sofa!") == 1.0
    assert words_in_common("go", "stop it") == 0.0
