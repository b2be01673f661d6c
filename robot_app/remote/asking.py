"""`openbelief ask --remote`: a mission of a robot that runs elsewhere, asked for and answered from this terminal."""

from __future__ import annotations

import queue
import sys
import threading
import time
from collections.abc import Callable
from typing import Any, TextIO

from drivers.ports import PortError
from logs.structured import neutralise
from openbelief.target_phrase import target_phrase
from robot_app.cli import Failure
from robot_app.mission.command_replies import is_stop
from robot_app.mission.lease import Refused
from robot_app.mission.terminal import STOP_WORDS
from robot_app.remote.client import RemoteOperator

LOOK_S = 0.1
GONE_LOOKS = 20  # a sentence is nowhere for a moment between the queue and its mission
ANSWERS = {"yes": "yes", "y": "yes", "no": "no", "n": "no", "not this one": "not this one"}


class RemoteAsking:
    """Follows one mission to its end. approve: as --yes says, yes to what is surely meant, no to a doubt."""

    def __init__(
        self,
        operator: RemoteOperator,
        who: str,
        *,
        approve: bool,
        source: TextIO | None = None,
        screen: TextIO | None = None,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        self._operator, self._who, self._approve = operator, who, approve
        self._source, self._screen, self._sleep = source or sys.stdin, screen or sys.stderr, sleep
        self._lines: queue.Queue[str] = queue.Queue()
        self._said = 0
        self._asked: int | None = None
        self._gone = 0

    def run(self, sentence: str) -> dict[str, Any]:
        """The mission's outcome as `status` has it; Ctrl-C stops the robot. Raises Failure, Refused or PortError.

        Raises ValueError in one line where the sentence names nothing, or is too long to be sent.
        """
        if not is_stop(sentence):  # a stop is sent, however it is said
            target_phrase(sentence)
        self._said = max((each["number"] for each in self._operator.status()["said"]), default=0)
        order = self._operator.ask(sentence)
        threading.Thread(target=self._read, name="remote keyboard", daemon=True).start()
        try:
            return self._followed(order)
        except KeyboardInterrupt:
            self._operator.stop(self._who)
            return self._followed(order)

    def _followed(self, order: int) -> dict[str, Any]:
        while True:
            status = self._operator.status(self._said)
            for each in status["said"]:
                self._said = each["number"]
                self._tell(each["sentence"])
            outcome = status["outcome"]
            if outcome is not None and outcome["order"] == order and status["mission"] is None:
                return dict(outcome)
            self._gone = self._gone + 1 if self._nowhere(order, status) else 0
            if self._gone > GONE_LOOKS:
                raise Failure(f"the mission did not begin: {status['stop'] or 'somebody else commands the robot'}")
            self._answer(status["question"])
            self._sleep(LOOK_S)

    @staticmethod
    def _nowhere(order: int, status: dict[str, Any]) -> bool:
        known = [each["order"] for each in (*status["waiting"], *([status["mission"]] if status["mission"] else []))]
        return order not in known

    def _answer(self, question: dict[str, Any] | None) -> None:
        if question is None:
            return
        if self._asked != question["id"]:
            self._asked = question["id"]
            self._drain()
            if self._approve:  # --yes approves what is surely meant; a doubt is for a person to settle
                self._send(question, "no" if question["doubt"] else "yes")
                return
            self._tell(f"[yes/no/not this one/take N, {question['left_s']:.0f} s; stop at any time]")
        while not self._lines.empty():
            self._take(question, self._lines.get())

    def _take(self, question: dict[str, Any], line: str) -> None:
        words = " ".join(line.lower().split())
        if words.startswith("take ") and words[5:].isdigit():
            self._send(question, "take", int(words[5:]))
        elif words in ANSWERS:
            self._send(question, ANSWERS[words])
        elif words == "why":
            self._tell(question["because"])
        else:
            self._tell(f"{line!r} is neither yes nor no.")

    def _send(self, question: dict[str, Any], word: str, number: int | None = None) -> None:
        try:
            self._operator.answer(question, word, number)
        except Refused as refused:
            self._tell(str(refused))

    def _drain(self) -> None:
        """What was typed before the question is no answer to it."""
        while not self._lines.empty():
            self._lines.get()

    def _tell(self, sentence: str) -> None:
        print(neutralise(sentence), file=self._screen, flush=True)

    def _read(self) -> None:
        try:
            for line in self._source or ():
                if line.strip().lower().rstrip("!.") in STOP_WORDS or is_stop(line):
                    self._operator.stop(self._who)
                else:
                    self._lines.put(line.strip())
        except (OSError, ValueError, PortError) as error:
            self._tell(f"Nothing more can be typed here: {error}")
