"""What the operator may have meant: phrases of the memory that are spelled alike. Never applied silently."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from openbelief.memory import ObjectMemory
from openbelief.target_phrase import target_phrase

CLOSE = 0.75  # of difflib's ratio: "fire-extane wisher" finds fire extinguisher, "bring me a newspaper" nothing
SUGGESTED = 3
WORD = re.compile(r"[\s-]+")
LONGEST_RUN = 4  # words
SHORTEST = 5  # letters: shorter words are like too many others


@dataclass(frozen=True, slots=True)
class Suggestion:
    """phrase: the memory's. sentence: the transcript with it in place of what was heard. ratio: 0.75 to 1."""

    phrase: str
    sentence: str
    ratio: float


def memory_phrases(memory: ObjectMemory) -> tuple[str, ...]:
    """Every phrase that the memory's objects were given, sorted."""
    return tuple(sorted({phrase for node in memory.objects for c in node.concepts for phrase in c.phrases}))


def suggestions(transcript: str, phrases: Iterable[str], again: str = "") -> list[Suggestion]:
    """The closest phrases, best first; none where the memory knows the very words, or nothing is like what was heard.

    again: a second hearing of the same sound, which may know what the first did not.
    """
    known = {_letters(phrase): phrase for phrase in phrases}
    target = _target(transcript)
    if _letters(target) in known:
        return []
    second = _target(again)
    offered = [Suggestion(known[_letters(second)], again.strip(), 1.0)] if _letters(second) in known else []
    offered += _close(transcript, target, known) + _close(again, second, known)
    if not offered:  # the verb was garbled too, and what is looked for is somewhere in the sentence
        offered = _anywhere(transcript, known) + _anywhere(again, known)
    best = {each.phrase: each for each in sorted(offered, key=lambda each: each.ratio)}  # the best of each stays
    return sorted(best.values(), key=lambda each: (-each.ratio, each.phrase))[:SUGGESTED]


def _target(transcript: str) -> str:
    """What the sentence asks for by name, "" where it names nothing."""
    try:
        return target_phrase(transcript).thing
    except ValueError:
        return ""


def _close(transcript: str, target: str, known: Mapping[str, str]) -> list[Suggestion]:
    """The sentence with a phrase of the memory in its target's place."""
    heard = _letters(target)
    close = difflib.get_close_matches(heard, known, SUGGESTED, CLOSE) if heard else []
    return [Suggestion(known[each], _in_place(transcript, target, known[each]), _ratio(each, heard)) for each in close]


def _anywhere(transcript: str, known: Mapping[str, str]) -> list[Suggestion]:
    """Phrases like any few words of it, each by itself: the words around them were not understood either."""
    words = [heard for word in WORD.split(transcript) if (heard := _letters(word))]
    runs = {"".join(words[at : at + n]) for at in range(len(words)) for n in range(1, LONGEST_RUN + 1)}
    close = [(each, run) for run in runs for each in difflib.get_close_matches(run, known, SUGGESTED, CLOSE)]
    return [Suggestion(known[each], known[each], _ratio(each, run)) for each, run in close if len(run) >= SHORTEST]


def _in_place(transcript: str, target: str, phrase: str) -> str:
    at = transcript.lower().rfind(target)
    # Where cleaning changed the words (quotes, double spaces) there is no place to put the phrase: it stands alone.
    return (phrase if at < 0 else transcript[:at] + phrase + transcript[at + len(target) :]).strip()


def _ratio(letters: str, heard: str) -> float:
    return round(difflib.SequenceMatcher(None, letters, heard).ratio(), 3)


def _letters(text: str) -> str:
    """Recognisers put spaces and hyphens where they like: "fire-extane wisher" is compared as fireextanewisher."""
    return "".join(letter for letter in text.lower() if letter.isalnum())
