"""What the operator may have meant: phrases of the memory that are spelled alike. Never applied silently."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass

from openbelief.memory import ObjectMemory
from openbelief.target_phrase import target_phrase

CLOSE = 0.75  # of difflib's ratio: "fire-extane wisher" finds fire extinguisher, "bring me a newspaper" nothing
SUGGESTED = 3


@dataclass(frozen=True, slots=True)
class Suggestion:
    """phrase: the memory's. sentence: the transcript with it in place of what was heard. ratio: 0.75 to 1."""

    phrase: str
    sentence: str
    ratio: float


def memory_phrases(memory: ObjectMemory) -> tuple[str, ...]:
    """Every phrase that the memory's objects were given, sorted."""
    return tuple(sorted({phrase for node in memory.objects for c in node.concepts for phrase in c.phrases}))


def suggestions(transcript: str, phrases: Iterable[str]) -> list[Suggestion]:
    """The closest phrases, best first; none where the memory knows the very words, or the transcript names nothing."""
    known = {_letters(phrase): phrase for phrase in phrases}
    try:
        target = target_phrase(transcript).thing
    except ValueError:
        return []
    heard = _letters(target)
    if heard in known:
        return []
    close = difflib.get_close_matches(heard, known, SUGGESTED, CLOSE)
    return [_suggestion(transcript, target, heard, letters, known[letters]) for letters in close]


def _suggestion(transcript: str, target: str, heard: str, letters: str, phrase: str) -> Suggestion:
    ratio = difflib.SequenceMatcher(None, letters, heard).ratio()
    at = transcript.lower().rfind(target)
    # Where cleaning changed the words (quotes, double spaces) there is no place to put the phrase: it stands alone.
    sentence = phrase if at < 0 else transcript[:at] + phrase + transcript[at + len(target) :]
    return Suggestion(phrase, sentence.strip(), round(ratio, 3))


def _letters(text: str) -> str:
    """Recognisers put spaces and hyphens where they like: "fire-extane wisher" is compared as fireextanewisher."""
    return "".join(letter for letter in text.lower() if letter.isalnum())
