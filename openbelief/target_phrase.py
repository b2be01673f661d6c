"""The operator's sentence to what is looked for: "take me to the lamp?" -> "lamp"."""

from __future__ import annotations

import re
from dataclasses import dataclass

from openbelief.phrase import clean

MAX_CHARACTERS = 300
POLITE = r"(?:please|hey|hi|hello|ok|okay|robot|now|just|kindly)"
ASKING = (
    r"(?:can|could|will|would) you|i (?:want|need|would like|'d like)(?: you)?(?: to)?|i'd like(?: you)?(?: to)?|"
    r"let's|let us|help me(?: to)?|is there|are there|do you (?:see|know)"
)
VERBS = (
    r"(?:take|bring|guide|lead|walk|drive|get|show|point) (?:me|us)(?: over)?(?: to)?|where(?: is|'s| are)|"
    r"(?:go|walk|drive|move|navigate|head|come|get)(?: over)? to|(?:go|walk|come) (?:over|near)|"
    r"(?:go and |go )?(?:find|locate|look for|search for|fetch|see|visit|reach|approach)(?: me)?"
)
ARTICLES = r"the|a|an|some|any|my|our|your|this|that|these|those"
LEADING = re.compile(rf"^(?:(?:{POLITE}|{ASKING}|{VERBS}|{ARTICLES})(?=[\s,]|$)[\s,]*)+", re.IGNORECASE)
TRAILING = re.compile(r"(?:[\s,]+(?:please|now|for me|thanks|thank you))+$", re.IGNORECASE)
PLACE = re.compile(rf"\s(?:in|inside|at|from)\s+(?:(?:{ARTICLES})\s+)?(?P<place>\S.*)$", re.IGNORECASE)


@dataclass(frozen=True)
class TargetPhrase:
    """text: the words that are compared with the map, place included. place: where, if the sentence says."""

    text: str
    place: str | None = None


def target_phrase(sentence: str) -> TargetPhrase:
    """Raises ValueError where the sentence names nothing, or is over 300 characters."""
    words = " ".join(clean(sentence[: MAX_CHARACTERS * 4]).split()).strip(" .,;:!?\"'`()[]{}<>-_*")
    if len(words) > MAX_CHARACTERS:
        raise ValueError(f"The sentence has over {MAX_CHARACTERS} characters: name the thing in a few words.")
    text = LEADING.sub("", TRAILING.sub("", words)).strip(" .,;:!?\"'").lower()
    if not any(letter.isalnum() for letter in text):
        raise ValueError("The sentence names nothing to look for: say for example 'take me to the lamp'.")
    place = PLACE.search(text)
    return TargetPhrase(text, place["place"] if place else None)
