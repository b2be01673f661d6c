"""Sentences in a model's reply, which are no names of objects: refusals, apologies, descriptions of the picture."""

from __future__ import annotations

import re

# A noun phrase does not begin so
BEGINS = re.compile(
    r"(i|i'm|i've|i'd|i'll|we|we're|you|it|it's|there|there's|this (image|picture|photo|scene)|these are|here (is|are)|"
    r"in (the|this) (image|picture|photo|scene|room|foreground|background)|"
    r"the (image|picture|photo|scene|view) (shows|depicts|contains|features|appears|has|does|seems|cannot|could)|"
    r"no (image|picture|photo)|sorry|apologies|my apologies|unfortunately|please|as an ai|however|but|note that|let me|"
    r"error)\b"
)
# ... nor does one hold such words
HOLDS = re.compile(
    r"\b(is|are|was|were|isn't|aren't|cannot|can't|couldn't|unable to|i'm|i am|i can|i see|we see|you see|"
    r"(i|we|they|it|you) (don't|do not|won't|will|would|could|have)|apologi[sz]e|assist (you|with)|as an ai|"
    r"language model|(content|usage|safety) (policy|guidelines))\b"
)
ELSEWHERE = re.compile(
    r"对不起|抱歉|无法|我不能|申し訳|できません|죄송|"
    r"es tut mir leid|ich kann|leider|désolé|je ne (peux|suis)|lo siento|"
    r"no puedo|mi dispiace|non posso|desculpe|não posso|извините|я не могу"
)
FILLERS = {"sure", "certainly", "of course", "ok", "okay", "absolutely", "yes", "no", "thank you", "n/a"}


def is_prose(text: str) -> bool:
    """Whether a line or an item is a sentence or a filler word rather than a noun phrase."""
    plain = text.lower().replace("’", "'").strip(' \t*_`"“”«».,;:!?')
    return bool(plain in FILLERS or BEGINS.match(plain) or HOLDS.search(plain) or ELSEWHERE.search(plain))
