"""A model's reply read tolerantly (lines, bullets, numbers, JSON, fences, thoughts) and cleaned strictly.

A refusal or a description in sentences has no phrases in it. Whatever the reply says, it is data: phrases of bounded
number and length come out, and nothing in them is acted on.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

from openbelief.perception.vlm_prompt import MAX_PHRASES
from openbelief.perception.vlm_prose import is_prose
from openbelief.phrase import MAX_CHARACTERS, MAX_WORDS, clean, comparable

MAX_REPLY_CHARACTERS = 20_000
NOTHING_SEEN = {"none", "nothing", "no objects", "no object", "no physical objects", "no objects visible", "n/a"}

THOUGHT = re.compile(r"<think(ing)?>.*?(</think(ing)?>|\Z)", re.DOTALL | re.IGNORECASE)
LATE_THOUGHT_END = re.compile(r"\A.*</think(ing)?>", re.DOTALL | re.IGNORECASE)  # templates that open it themselves
FENCE = re.compile(r"^\s*```.*$", re.MULTILINE)
TAG = re.compile(r"</?[A-Za-z!][^<>\n]{0,80}>|<\|[^<>\n]{1,40}\|>")
BULLET = re.compile(r"^\s*(?:[-*+•·‣▪–—#>]+\s+|\(?\d{1,3}\s*[.):]\s*|[•·‣▪–—]\s*)+")
QUOTED = re.compile(r'"((?:[^"\\\n]|\\.){1,200})"')
WRAPPING = " \t*_`'\"“”‘’«».,;:!"
NAME_KEYS = ("name", "label", "object", "phrase", "noun_phrase", "description")


class Garbage(ValueError):
    """A reply without a phrase in it; the message says what it began with."""


def phrases_of(reply: str, *, cut: bool = False) -> list[str]:
    """At most 20 distinct phrases in their order; none where the model says that it sees nothing.

    cut: the server stopped in the middle, so that the last item is not to be trusted. Raises Garbage.
    """
    text = _without_thoughts(reply[:MAX_REPLY_CHARACTERS]).strip()
    cut = cut or len(reply) > MAX_REPLY_CHARACTERS
    items = _json_items(text, cut)
    phrases = _distinct(_line_items(text, cut) if items is None else items)
    if not phrases and items != [] and not _says_nothing(text):
        raise Garbage("there is no phrase in it" if text else "it is empty")
    return phrases


def _without_thoughts(text: str) -> str:
    return FENCE.sub("", LATE_THOUGHT_END.sub("", THOUGHT.sub("", text)))


def _says_nothing(text: str) -> bool:
    return text.lower().strip(WRAPPING) in NOTHING_SEEN


def _json_items(text: str, cut: bool) -> list[str] | None:
    """The strings of a JSON list, also one that was cut off; None where the text is not JSON."""
    start = min((at for at in (text.find("["), text.find("{")) if at >= 0), default=-1)
    if start < 0 or "\n" in text[:start].strip():
        return None
    try:
        value, _ = json.JSONDecoder().raw_decode(text[start:])
    except (ValueError, RecursionError):
        return _quoted(text[start:]) if cut or QUOTED.search(text[start:]) else None
    items = list(_strings(value))
    return items if items or _is_empty(value) else None


def _is_empty(value: Any) -> bool:
    return all(inner == [] for inner in value.values()) if isinstance(value, dict) else value == []


def _quoted(text: str) -> list[str]:
    """What stands between whole quotes in broken JSON; the word in front of a colon is a key."""
    return [match[1] for match in QUOTED.finditer(text) if not text[match.end() :].lstrip().startswith(":")]


def _strings(value: Any) -> Iterator[str]:
    """Strings of a list, of a list in an object, or the names of a list of objects."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, list):
        for item in value[: 4 * MAX_PHRASES]:
            yield from _strings(item)
    elif isinstance(value, dict):
        named = [value[key] for key in NAME_KEYS if isinstance(value.get(key), str)]
        nested = [item for item in value.values() if isinstance(item, list)]
        yield from named[:1] or (text for item in nested for text in _strings(item))


def _line_items(text: str, cut: bool) -> list[str]:
    lines = [line for line in text.splitlines() if line.strip()]
    if cut:
        lines = lines[:-1]
    items = [BULLET.sub("", line) for line in lines if not line.rstrip(" *_").endswith(":")]  # "Objects I can see:"
    if len(items) == 1:
        return [] if is_prose(items[0]) else re.split(r"[,;]", items[0])
    return [re.split(r":\s", item)[0] for item in items]  # "chair: a wooden one by the wall"


def _distinct(items: list[str]) -> list[str]:
    """Cleaned, without doubles, at most MAX_PHRASES."""
    phrases: dict[str, str] = {}
    for item in items:
        phrase = None if is_prose(item) else _phrase(item)
        key = comparable(phrase)
        if phrase and key and key not in NOTHING_SEEN:
            phrases.setdefault(key, phrase)
    return list(phrases.values())[:MAX_PHRASES]


def _phrase(item: str) -> str | None:
    """One line of printable words within the house's bounds, case kept; None where it is not made of words."""
    words = _unwrapped(clean(TAG.sub(" ", item))).split()[:MAX_WORDS]
    while len(words) > 1 and len(" ".join(words)) > MAX_CHARACTERS:
        words.pop()
    phrase = _unwrapped(" ".join(words)[:MAX_CHARACTERS])
    letters = sum(letter.isalpha() for letter in phrase)
    return phrase if letters * 2 > len(phrase.replace(" ", "")) else None


def _unwrapped(text: str) -> str:
    """Without quotes, emphasis and punctuation around it, and without brackets that hold all of it."""
    text = text.strip(WRAPPING)
    return text[1:-1].strip(WRAPPING) if text[:1] + text[-1:] in ("()", "[]", "{}") else text
