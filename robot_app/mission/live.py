"""One mission after the other, as the operator's sentences come."""

from __future__ import annotations

import signal
from collections.abc import Callable, Sequence
from typing import Any

from logs.trial.journal import Journal
from robot_app.mission.missions import Missions
from robot_app.mission.operator import SharedOperator

Report = Callable[[dict[str, Any]], None]


def run_missions(
    missions: Missions,
    operator: SharedOperator,
    heard: Sequence[int],
    *,
    report: Report | None = None,
    watching: Sequence[Journal] = (),
) -> None:
    """Until there will be no further sentence, or a signal other than Ctrl-C told the program to end.

    heard: the signals so far (robot_app.signals).
    report: takes each mission's outcome as JSON. watching: sees each mission as it is written.
    """
    while not any(number != signal.SIGINT for number in heard) and (sentence := operator.next_sentence()):
        operator.begin(sentence)
        try:
            recorded = missions.ask(
                sentence.text, who=sentence.who, how=sentence.how, watching=watching, notes=sentence.notes
            )
        except ValueError as error:
            operator.tell(f"Not asked: {error}")  # on every face: whoever asked may sit at a page
            continue
        finally:
            operator.ended()
        operator.tell(f"trial: {recorded.failure or recorded.trial}")
        if report is not None:
            report({"query": sentence.text} | recorded.as_json())
