"""An operator's sentence made plain: one line of lower-case words, without who is spoken to and without politeness."""

from __future__ import annotations

import re

from openbelief.phrase import clean
from openbelief.target_phrase import ARTICLES, LEADING, MAX_CHARACTERS, QUOTES

LETTERS_MAX = MAX_CHARACTERS * 4  # more than this is not even looked at
MIDDLE = re.compile(r",\s*(?:please|thanks|thank you|ok|okay)\s*,")
EDGES = " .,;:!?`()[]{}<>-_*"
POLITE = (
    r"please|pls|plz|kindly|thanks|thank you(?: very much| so much)?|thanks a lot|many thanks|cheers|for me|for us|"
    r"if you (?:can|could|would|please|like|don't mind|do not mind|are able)|if possible|when you can|now|okay|ok|"
    r"would you|will you|could you|can you|my friend|dear robot|robot|excuse me|sorry|gone|"
    r"good (?:morning|afternoon|evening)"
)
HURRIED = r"right now|quickly|at once|immediately|asap|right away|again"
CALLED = rf"(?:hey|hi|hello|so|um|uh|{POLITE}|{HURRIED})"
OPENING = re.compile(rf"^(?:{CALLED}(?=[\s,!.]|$)[\s,!.]*)+")
CLOSING = re.compile(rf"(?:[\s,!.]+(?:{POLITE}))+$")
CLOSING_COMMAND = re.compile(rf"(?:[\s,!.]+{CALLED})+$")
# More ways to ask for a thing than the paper's target phrase strips; what consensus embeds stays as it was.
NAMED = r"(?=the |my |our |a |an )"
WAYS = (
    r"where (?:did|do|have|has) (?:i|we|you|he|she|they|somebody|someone) (?:leave|put|left|see|saw|seen|keep)",
    r"where (?:can|could|do|would|might|will) (?:i|we|you) (?:find|get|see)|where (?:might|could|would|should)",
    r"(?:have|did) you (?:seen|see|found|find)|i (?:can't|cannot|can not|could not|couldn't) find|i(?:'ve| have)? lost",
    r"(?:do|does) (?:we|you|anybody|anyone) have|is there|are there|we need|we want|we are looking for|i require",
    r"(?:give|hand|pass|fetch|get|bring|buy|pick) (?:me|us)|pick up|check(?: on| out| for)?|inspect|i could use",
    r"be so (?:kind|good|nice)(?: and| as to| to)?|which (?=\w+ is )|make your way to|head over to|proceed to|approach",
    r"(?:go|walk|drive|come) back to|(?:could|can|may) (?:i|we) have|what about|how about|i wonder where|i'm after",
    r"(?:drive|walk|go|navigate|move|run|come)(?: with me)? (?:up to|towards|toward|to|over to|near|by|past)",
    rf"(?:carry|take|move|push|open|close|clean|water|feed|switch on|switch off|turn on|turn off|put|throw) {NAMED}",
    rf"(?:hold|bring) {NAMED}|what(?: is|'s| are|'re)|which(?: one)? is|who is|you should (?:go to|find|see)",
    r"i(?: would|'d)? (?:like|love|wish|prefer)(?: to (?:see|go to|find|visit|have|get|use|reach|be at))?",
    rf"(?:to|at|near|towards) {NAMED}",
)
ASKING = re.compile(rf"^(?:{'|'.join(WAYS)})[\s,]*")
DETERMINERS = re.compile(rf"^(?:(?:{ARTICLES})(?=[\s,]|$)[\s,]*)+")
HOW = (
    r"(?:very |as |so )?(?:quickly|slowly|carefully|gently|quietly|safely|directly|straight|immediately|fast|asap|soon)"
    r"(?: as (?:you can|possible))?|right away|right now|at once|as soon as possible|hurry(?: up)?|again|today|later|"
    r"first"
)
HOW_LAST, HOW_FIRST = re.compile(rf"(?:^|[\s,]+)(?P<how>{HOW})$"), re.compile(rf"^(?P<how>{HOW})[\s,]+(?!aid\b)")
BE_LAST = re.compile(r"\s(?:is|are|at|be|went|located|kept|around|anywhere|somewhere|here|there)$")


def plain(sentence: str) -> str:
    """One line, lower case, quotation marks away, no punctuation at its ends; commas inside stay."""
    unquoted = QUOTES.sub(" ", clean(sentence[:LETTERS_MAX]).replace("\u2019", "'"))
    return " ".join(unquoted.split()).strip(EDGES).lower()


def polished(sentence: str) -> str:
    """`plain`, without the robot's name and politeness at either end; "" where nothing else was said."""
    words = plain(sentence)
    while (shorter := CLOSING_COMMAND.sub("", OPENING.sub("", words)).strip(EDGES)) != words:
        words = shorter
    return "" if re.fullmatch(CALLED, words) else words


def asked_for(text: str) -> tuple[str, tuple[str, ...]]:
    """What is left of a target phrase when further ways of asking, articles and politeness are taken off.

    Second: what it says of the manner ("quickly"), which nothing here can heed.
    """
    words = MIDDLE.sub(",", text)
    manner: list[str] = []
    while True:
        shorter = _asked_once(words)
        for pattern in (HOW_LAST, HOW_FIRST):
            if (found := pattern.search(shorter)) and len(found.group()) < len(shorter):
                manner += found["how"].split()
                shorter = pattern.sub("", shorter).strip(EDGES)
        if shorter == words:
            return words, tuple(manner)
        words = shorter


def _asked_once(words: str) -> str:
    words = CLOSING.sub("", words).strip(EDGES)
    asked = ASKING.sub("", words)
    if asked != words:
        asked = BE_LAST.sub("", asked)
    rest = DETERMINERS.sub("", LEADING.sub("", asked)).strip(EDGES)
    return rest or words
