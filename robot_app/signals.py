"""What ends a program stops the robot first: Ctrl-C, a kill, and a terminal that goes away (a closed ssh session)."""

from __future__ import annotations

import functools
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from robot_app.mission.operator import SharedOperator

BECAUSE = {
    signal.SIGINT: "the operator pressed Ctrl-C",
    signal.SIGTERM: "the program was told to end (SIGTERM)",
    signal.SIGHUP: "the operator's terminal went away (SIGHUP)",
}


@contextmanager
def signals_stop(operator: SharedOperator) -> Iterator[list[int]]:
    """Within, each of these signals is a STOP with its reason, or ends a program that waits for a sentence.

    Yields those that came, for who should then end.
    """
    heard: list[int] = []

    def stop(number: int, _frame: Any) -> None:
        heard.append(number)
        because = BECAUSE[signal.Signals(number)]
        stop_it = functools.partial(operator.interrupt, because=because, how="signal")
        threading.Thread(target=stop_it, name="stop").start()  # what was interrupted may hold a lock or the screen

    before = {number: signal.signal(number, stop) for number in BECAUSE}
    try:
        yield heard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
