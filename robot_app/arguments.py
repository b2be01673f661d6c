"""What argparse asks of a word on the command line: what is wrong here is wrong usage, exit status 2."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from openbelief.grounded.geometry import Viewer
    from robot_app.console.listening import Listening


def whole(lowest: int, highest: int | None = None) -> Callable[[str], int]:
    """A whole number within bounds, both allowed; highest None: without an upper one."""
    asked = f"a whole number from {lowest}" + ("" if highest is None else f" to {highest}")

    def parsed(text: str) -> int:
        if not text.isdecimal() or not lowest <= int(text) <= (math.inf if highest is None else highest):
            raise argparse.ArgumentTypeError(f"{asked}, not {text!r}")
        return int(text)

    return parsed


from_one = whole(1)


def number(unit: str, lowest: float, highest: float) -> Callable[[str], float]:
    """A number of a unit within bounds, both allowed."""

    def parsed(text: str) -> float:
        if not lowest <= (value := _float(text)) <= highest:
            raise argparse.ArgumentTypeError(f"a number of {unit} from {lowest:g} to {highest:g}, not {text!r}")
        return value

    return parsed


bench_seconds = number("seconds", 1, 3600)


def seconds(text: str) -> float:
    """A number of seconds, from 0."""
    if not (value := signed_seconds(text)) >= 0:
        raise argparse.ArgumentTypeError(f"a number of seconds from 0, not {text!r}")
    return value


def signed_seconds(text: str) -> float:
    """A finite number of seconds."""
    if not math.isfinite(value := _float(text)):
        raise argparse.ArgumentTypeError(f"a number of seconds, not {text!r}")
    return value


def _float(text: str) -> float:
    """NaN where it is no number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def perception(text: str) -> str:
    """KIND:ARGUMENT of a kind that there is."""
    from robot_app.cli import Failure
    from robot_app.perceptions import FORMS, kind_of

    try:
        kind_of(text)
    except Failure as failure:
        raise argparse.ArgumentTypeError(f"should be {FORMS}, not {text!r}") from failure
    return text


def a_pose(text: str) -> Viewer:
    """X,Y or X,Y,YAW in metres and degrees, map frame."""
    from openbelief.grounded.geometry import Viewer

    try:
        x, y, *yaw = (float(part) for part in text.split(","))
        if len(yaw) > 1 or not all(math.isfinite(value) for value in (x, y, *yaw)):
            raise ValueError
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"X,Y or X,Y,YAW in metres and degrees, not {text!r}") from error
    return Viewer(x, y, math.radians(yaw[0]) if yaw else 0.0)


def listening(text: str) -> Listening:
    """[HOST:]PORT of the console."""
    from robot_app.console.listening import listening_of

    try:
        return listening_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
