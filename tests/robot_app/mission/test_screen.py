"""What is shown waits for nobody: it comes in order, what is too much is counted, and a lost stream is told once."""

from __future__ import annotations

import io
import threading

from robot_app.mission.screen import TEXTS_MAX, Screen

LONG_S = 60.0


class Held(io.StringIO):
    """Takes nothing until it is let go."""

    def __init__(self) -> None:
        super().__init__()
        self.asked, self.let_go = threading.Event(), threading.Event()

    def write(self, text: str) -> int:
        self.asked.set()
        assert self.let_go.wait(LONG_S)
        return super().write(text)


class Gone(io.StringIO):
    def flush(self) -> None:
        raise OSError(5, "Input/output error")


def test_what_waited_is_shown_in_order_and_what_was_too_much_is_counted() -> None:
    stream = Held()
    screen = Screen(stream, lost=lambda error: None)
    screen.show("first\n")
    assert stream.asked.wait(LONG_S)
    for number in range(TEXTS_MAX + 3):
        screen.show(f"{number}\n")
    stream.let_go.set()
    assert screen.settled(LONG_S)
    shown = stream.getvalue().splitlines()
    assert shown[:3] == ["first", "(3 lines were not shown)", "3"] and shown[-1] == str(TEXTS_MAX + 2)
    assert len(shown) == TEXTS_MAX + 2


def test_a_lost_stream_is_told_once_and_nothing_is_shown_or_waited_for_any_more() -> None:
    lost: list[Exception] = []
    told = threading.Event()
    screen = Screen(Gone(), lost=lambda error: (lost.append(error), told.set())[0])
    screen.show("one\n")
    assert told.wait(LONG_S)
    screen.show("two\n")
    assert screen.settled(LONG_S) and [str(error) for error in lost] == ["[Errno 5] Input/output error"]
