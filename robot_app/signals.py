"""What ends a program stops the robot first: Ctrl-C, a kill, and a terminal that goes away (a closed ssh session)."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from robot_app.mission.terminal import TerminalOperator

BECAUSE = {
    signal.SIGINT: "the operator pressed Ctrl-C",
    signal.SIGTERM: "the program was told to end (SIGTERM)",
    signal.SIGHUP: "the operator's terminal went away (SIGHUP)",
}


@contextmanager
def signals_stop(operator: TerminalOperator) -> Iterator[list[int]]:
    """Within, each of these signals is a STOP with its reason; yields those that came, for who should then end."""
    heard: list[int] = []

    def stop(number: int, _frame: Any) -> None:
        heard.append(number)
        operator.request_stop(because=BECAUSE[signal.Signals(number)])

    before = {number: signal.signal(number, stop) for number in BECAUSE}
    try:
        yield heard
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
