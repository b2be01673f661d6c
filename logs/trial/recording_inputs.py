"""What the ports of a mission answered, into its journal in the order in which it was consumed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from drivers.ports import PortError
from logs.trial import records
from logs.trial.journal import Attached, Journal

Answer = TypeVar("Answer")


class Inputs:
    """The journal, and how often STOP was asked for in vain since the last input: that places a STOP exactly."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self.polls = 0

    def write(self, record: records.Record, attached: Attached = None) -> None:
        self._journal.write(record, attached)
        self.polls = 0

    def note(self, record: records.Record) -> None:
        self._journal.write(record)

    def ask(self, call: str, port: Callable[[], Answer]) -> Answer:
        """The port's answer, for the caller to write; what it raises is written here."""
        try:
            return port()
        except Exception as error:
            self.write(records.PortFailure(call=call, kind=_kind(error), message=str(error), polls=self.polls))
            raise


def _kind(error: Exception) -> str:
    """The exception's name, as the ports know it: a driver's own kind of PoseUnavailable is a PoseUnavailable."""
    ported = (kind.__name__ for kind in type(error).__mro__ if kind.__module__ == PortError.__module__)
    return next(ported, type(error).__name__)
