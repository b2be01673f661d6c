"""A long job on a terminal of 80 columns: it knows its total and its end, and no name spoils the screen."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from robot_app.progress_bar import BarProgress

RATES = {"masks": 3.4, "acquire": 6.6, "read": 32.1, "phrases": 2.5}


@pytest.fixture
def screen() -> io.StringIO:
    return io.StringIO()


@pytest.fixture
def bar(screen: io.StringIO) -> BarProgress:
    return BarProgress(Console(file=screen, width=80, force_terminal=False))


def drawn(bar: BarProgress) -> list[str]:
    """The lines of the bars as they are just now."""
    console = Console(file=io.StringIO(), width=80)
    with console.capture() as captured:
        console.print(bar._bar.get_renderable())
    return captured.get().splitlines()


@pytest.mark.parametrize("name", ["walk.mcap", "a_long_walk_through_the_whole_ground_floor_2026-11-29.mcap"])
def test_a_bar_is_one_line_with_its_count_whole(bar: BarProgress, name: str) -> None:
    bar.frames(name, 108, 109, RATES)
    [line] = drawn(bar)
    assert len(line) <= 80 and "108/109" in line
    assert "phrases 2.5/s" in line or len(name) > 40, "the slowest stage sets the pace"


def test_what_has_ended_is_one_line_above_and_no_bar_any_more(bar: BarProgress, screen: io.StringIO) -> None:
    for done in (1, 5, 10, 10):
        bar.frames("walk.mcap", done, 10, RATES)
    assert drawn(bar) == [] or not "".join(drawn(bar)).strip()
    assert screen.getvalue().count("walk.mcap: 10 frames in ") == 1


def test_a_second_recording_of_the_same_name_has_a_bar_of_its_own(bar: BarProgress, screen: io.StringIO) -> None:
    bar.frames("walk.mcap", 10, 10)
    bar.frames("walk.mcap", 1, 5)
    assert "1/5" in drawn(bar)[0]
    bar.frames("walk.mcap", 5, 5)
    assert screen.getvalue().count(" frames in ") == 2


def test_a_name_with_brackets_or_control_characters_is_only_a_name(bar: BarProgress, screen: io.StringIO) -> None:
    bar.frames("[/red]\x1b[2J.mcap", 1, 2)
    assert "[/red]" in drawn(bar)[0]
    bar.frames("[/red]\x1b[2J.mcap", 2, 2)
    assert "\x1b" not in screen.getvalue()
