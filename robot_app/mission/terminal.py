"""The operator at a terminal: a yes before motion, STOP at any moment, one sentence at a time on the screen."""

from __future__ import annotations

import getpass
import os
import re
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from drivers.ports import Approval
from logs.structured import logger, neutralise
from logs.trial.journal import Entry
from robot_app.mission.command_replies import is_stop, reply_to
from robot_app.mission.lease import Lease, Refused
from robot_app.mission.notices import Change, Notice
from robot_app.mission.open_question import OpenQuestion, option_lines
from robot_app.mission.operator import SharedOperator
from robot_app.mission.screen import Screen, is_terminal

HOW = "terminal"
STOP_WORDS = ("stop", "s", "halt")
ANSWERS = {
    "yes": Approval.YES,
    "y": Approval.YES,
    "no": Approval.NO,
    "n": Approval.NO,
    "not this one": Approval.NOT_THIS_ONE,
}
TAKE, NOT_NUMBER, TAKE_OVER = re.compile(r"take (\d{1,3})"), re.compile(r"not (\d{1,3})"), "take over"
ALWAYS = (Change.TOLD, Change.STOPPED, Change.EXPIRED)  # what else happens is shown where somebody else commands


class Terminal:
    """A client of the Operator that reads lines on a thread of its own, so that "stop" is heard while the robot drives.

    Use as a context manager around missions. where_empty: what an empty line does between questions. under_way: whether
    a mission runs; where a terminal goes away meanwhile, nobody could type "stop" any more, and that is a stop.
    more: further words, and what they do at any time; "" is an empty line also while a question is open.
    commands: whether it takes the lease at once, or waits for "take over".
    """

    def __init__(
        self,
        operator: SharedOperator,
        *,
        who: str = "",
        source: TextIO | None = None,
        screen: TextIO | None = None,
        where_empty: Callable[[], None] | None = None,
        under_way: Callable[[], bool] | None = None,
        more: Mapping[str, Callable[[], None]] | None = None,
        commands: bool = True,
    ) -> None:
        self._operator, self.who = operator, who or _user()
        self._source, self.screen = source or sys.stdin, Screen(screen or sys.stderr, self._screen_lost)
        self._where_empty, self._more, self._commands = where_empty or operator.end, more or {}, commands
        self._under_way = under_way or (lambda: operator.mission is not None)
        self._typed = is_terminal(self._source)
        self._lease: Lease | None = None

    def __enter__(self) -> Terminal:
        self._operator.join(HOW)
        if self._commands and self._operator.lease is None:
            self._lease = self._operator.take(self.who, HOW)
        self._end_listening = self._operator.listen(self._hear)
        threading.Thread(target=self._read, name="operator", daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end_listening()  # the reader is a daemon: a blocking read of stdin cannot be interrupted
        self.screen.end()

    def tell(self, sentence: str) -> None:
        """Never waits, never raises: a screen that went away ends no mission but by a STOP."""
        self.screen.show(neutralise(sentence) + "\n")

    def ask(self, text: str, notes: tuple[Entry, ...] = ()) -> None:
        """Ask with this terminal's lease. Raises Refused where somebody else commands. notes: for the trial."""
        self._operator.ask(self._lease, text, notes)

    # ---- the screen

    def _hear(self, notice: Notice) -> None:
        asked = self._operator.question
        if notice.change is Change.ASKED and asked is not None:
            self.tell(f"{notice.sentence} [{asked.words}, {asked.timeout_s:.0f} s; stop at any time]")
        elif notice.sentence and (notice.change in ALWAYS or not self._alone):
            self.tell(notice.sentence)

    @property
    def _alone(self) -> bool:
        """Whether what happens is this terminal's own doing, and needs no telling."""
        return self._lease is not None and self._operator.lease is self._lease

    def _screen_lost(self, error: Exception) -> None:
        _discard(self.screen.stream)
        logger().error("screen_lost", reason=str(error))
        if self.screen.terminal:
            self._lost()

    # ---- the keyboard

    def _read(self) -> None:
        try:
            for line in self._source or ():
                self._take_line(line.strip())
        except (OSError, ValueError) as error:  # a terminal that went away, an input that was closed
            self.tell(f"Nothing more can be typed here: {error}")
        if self._typed:
            self._lost()
        else:
            self.tell("The input has ended: STOP only by signal (Ctrl-C, kill).")
        self._operator.leave(HOW)

    def _lost(self) -> None:
        """The terminal is gone, and with it the way in which its operator says stop."""
        if self._under_way():
            self._operator.stop(because="the operator's terminal went away", who=self.who, how=HOW)

    def _take_line(self, line: str) -> None:
        words = " ".join(line.lower().rstrip("!.").split())
        try:
            if words in STOP_WORDS or is_stop(line):
                self._operator.stop(because="the operator said stop", who=self.who, how=HOW)
            elif words in self._more:
                self._more[words]()
            elif words == TAKE_OVER:
                self._lease = self._operator.take(self.who, HOW, over=True)
            elif (asked := self._operator.question) is not None:
                self._answer(asked, line, words)
            elif words in ANSWERS or words == "why" or TAKE.fullmatch(words):
                self.tell("Nothing is being asked now: say what to look for, or give an empty line to end.")
            elif (said := reply_to(line)) is not None:
                self.tell(said)
            elif line:
                self.ask(line)
            else:
                self._where_empty()
        except Refused as refused:
            self.tell(f"{refused} (here: type {TAKE_OVER!r})" if self._taken else str(refused))

    def _answer(self, asked: OpenQuestion, line: str, words: str) -> None:
        named = TAKE.fullmatch(words) or NOT_NUMBER.fullmatch(words)
        if words == "why":
            self.tell(asked.question.because or "Nothing more is known about it.")
            for option in option_lines(asked.question.options):
                self.tell(option)
        elif named:
            word = Approval.TAKE if TAKE.fullmatch(words) else Approval.NOT_THIS_ONE
            self._send(asked, word, int(named[1]))
        elif words in ANSWERS:
            self._send(asked, ANSWERS[words], None)
        else:
            self.tell(f"{line!r} is neither yes nor no.")

    def _send(self, asked: OpenQuestion, word: Approval, number: int | None) -> None:
        memory_hash = asked.question.memory_hash
        self._operator.answer(self._lease, asked.id, word, memory_hash=memory_hash, number=number)

    @property
    def _taken(self) -> bool:
        return self._lease is None or self._operator.lease is not self._lease


def _discard(screen: TextIO) -> None:
    """What a lost screen still holds goes nowhere: flushing it at the end would fail, and be the exit status."""
    with suppress(OSError, ValueError):  # a screen without a file behind it holds nothing
        descriptor = screen.fileno()
        with Path(os.devnull).open("wb") as nowhere:
            os.dup2(nowhere.fileno(), descriptor)


def _user() -> str:
    try:
        return getpass.getuser()
    except (KeyError, OSError):  # no such user, no environment
        return ""
