"""What is said aloud, and in how few words: where the robot goes, what it found, why not, and what it asks."""

from __future__ import annotations

import re

from robot_app.mission.notices import Change, Notice

SPOKEN = (Change.TOLD, Change.ASKED, Change.STOPPED, Change.EXPIRED)
# For eyes alone: file names, addresses, and what somebody has just said themselves.
NOT_SAID = ("trial:", "Heard ", "Listening:", "Ready over ", "Commands over Zenoh ")
LONGEST = 120  # characters: a listener does not follow more
# Scores in brackets, and quotation marks; the apostrophe of "don't" stays.
DETAIL = re.compile(r"\s*\([^()]*\)|[\"'\u201c\u201d](?!\w)|(?<!\w)[\"'\u201c\u201d]")
SHOUTED = re.compile(r"^[A-Z]{2,}(?: [A-Z]{2,})*")  # NAVIGATION FAILED: would be spelled
PART = re.compile(r"(?<=[.;:?!])\s+")


def said_aloud(notice: Notice) -> str:
    """The words of a notice, "" where it is not said: whole parts of its sentence, at most LONGEST characters."""
    sentence = notice.sentence
    if notice.change not in SPOKEN or sentence.startswith(NOT_SAID):
        return ""
    plain = " ".join(DETAIL.sub("", sentence).split())
    plain = SHOUTED.sub(lambda words: words[0].capitalize(), plain)
    return _short(plain)


def _short(sentence: str) -> str:
    words = ""
    for part in PART.split(sentence):
        longer = f"{words} {part}".strip()
        if len(longer) > LONGEST:
            return words or f"{longer[:LONGEST].rsplit(' ', 1)[0]} ..."
        words = longer
    return words
