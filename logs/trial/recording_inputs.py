"""What the ports of a mission answered, into its journal in the order in which it was consumed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from logs.trial import records
from logs.trial.journal import Attached, Journal
from logs.trial.port_errors import kind_of

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
            self.write(records.PortFailure(call=call, kind=kind_of(error), message=str(error), polls=self.polls))
            raise
