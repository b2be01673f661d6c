"""The bodies of the recogniser port, by the name that `[voice] recogniser` gives them."""

from __future__ import annotations

from collections.abc import Callable

from robot_app.cli import Failure
from robot_app.voice.moonshine import MoonshineRecogniser
from robot_app.voice.recogniser import FORMS, Recogniser
from robot_app.voice.sherpa import SherpaRecogniser


def open_recogniser(spec: str, language: str = "en") -> Recogniser:
    """Raises Failure, one line with the remedy: unknown, not installed, no such model, or not of that language."""
    kind, _, argument = spec.partition(":")
    if kind not in RECOGNISERS:
        raise Failure(f"there is no recogniser {spec!r}: name {FORMS}")
    return RECOGNISERS[kind](argument, language)


def _moonshine(argument: str, language: str) -> Recogniser:
    if argument:
        raise Failure(f"moonshine takes no argument, got {argument!r}: other models are named by {FORMS}")
    return MoonshineRecogniser.open(language)


RECOGNISERS: dict[str, Callable[[str, str], Recogniser]] = {
    "moonshine": _moonshine,
    "sherpa": SherpaRecogniser.open,
}
