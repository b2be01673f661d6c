"""The operator's sentence to what is looked for: "take me to the lamp?" -> "lamp"."""

from __future__ import annotations

import re
from dataclasses import dataclass

from openbelief.phrase import clean

MAX_CHARACTERS = 300
NAMES_NOTHING = "The sentence names nothing to look for: say for example 'take me to the lamp'."
POLITE = r"please|hey|hi|hello|ok|okay|now|just|kindly"
ASKING = (
    r"(?:can|could|will|would) you|i (?:want|need|would like|'d like)(?: you)?(?: to)?|i'd like(?: you)?(?: to)?|"
    r"let's|let us|let me|help me(?: to)?|is there|are there|do you (?:see|know)|tell (?:me|us)"
)
ARTICLES = r"the|a|an|some|any|my|our|your|this|that|these|those"
VERBS = (
    r"(?:take|bring|guide|lead|walk|drive|navigate|direct|get|show|point) (?:me|us)(?: over)?(?: to)?|"
    r"where(?: is|'s| are)|(?:is|are)(?= (?:the|my|our|your)\s)|(?:which|what) way(?: is it)? to|which way is|"
    r"how (?:do|can) (?:i|we) get to|(?:i'm|i am|we're|we are) (?:looking|searching) for|have a look at|look at|"
    r"(?:go|walk|drive|move|navigate|head|come|get)(?: over)? to|(?:go|walk|come) (?:over|near)|"
    r"(?:go and |go )?(?:find|locate|look for|search for|fetch|see|visit|reach|approach)(?: me)?"
)
SAID = rf"{POLITE}|{ASKING}|{VERBS}"
CALLED = rf"robot(?=\s*,|\s+(?:{SAID})(?:[\s,]|$))"  # the one spoken to, and not a robot vacuum
LEADING = re.compile(rf"^(?:(?:{CALLED}|{SAID})(?=[\s,]|$)[\s,]*)*(?:(?:{ARTICLES})(?=[\s,]|$)[\s,]*)*", re.IGNORECASE)
WHERE_IT_IS = re.compile(r"\bwhere (?!is\b|are\b)(?P<thing>\S.*?) (?:is|are)$", re.IGNORECASE)
QUOTES = re.compile("[\"\u201c\u201d\u201e\u00ab\u00bb]|(?<!\\w)'|'(?!\\w)")  # an apostrophe inside a word stays
TRAILING = re.compile(r"(?:[\s,]+(?:please|now|for me|thanks|thank you))+$", re.IGNORECASE)
ELSEWHERE = re.compile(
    r"\s(?:in|inside|at|from|on|under|above|below|over|near|behind|beside|by|against|next to|in front of|with)\s",
    re.IGNORECASE,
)
PLACE = re.compile(rf"\s(?:in|inside|at|from)\s+(?:(?:{ARTICLES})\s+)?(?P<place>\S.*)$", re.IGNORECASE)


@dataclass(frozen=True)
class TargetPhrase:
    """text: the words that are compared with the map, place included. place: where, if the sentence says."""

    text: str
    place: str | None = None

    @property
    def thing(self) -> str:
        """What is asked for by name, without where it is: "wall" of "wall in the kitchen"."""
        return ELSEWHERE.split(self.text, maxsplit=1)[0]


def target_phrase(sentence: str) -> TargetPhrase:
    """Raises ValueError where the sentence names nothing, or is over 300 characters."""
    unquoted = QUOTES.sub(" ", clean(sentence[: MAX_CHARACTERS * 4]).replace("\u2019", "'"))
    words = " ".join(unquoted.split()).strip(" .,;:!?`()[]{}<>-_*")
    if len(words) > MAX_CHARACTERS:
        raise ValueError(f"The sentence has over {MAX_CHARACTERS} characters: name the thing in a few words.")
    told = WHERE_IT_IS.sub(r"where is \g<thing>", TRAILING.sub("", words))
    text = LEADING.sub("", told).strip(" .,;:!?").lower()
    if not any(letter.isalnum() for letter in text):
        raise ValueError(NAMES_NOTHING)
    place = PLACE.search(text)
    return TargetPhrase(text, place["place"] if place else None)
