"""The inputs of a trial, given out in their order, a complaint when others are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from drivers.ports import PortError, StopRequest
from logs.trial import records
from logs.trial.journal import Entry
from logs.trial.port_errors import error_of

Kind = TypeVar("Kind", bound=records.Record)


class Divergence(PortError):
    """The mission asked for something else than the trial holds."""


class RecordedInputs:
    """The inputs of a trial, each given out once, in order."""

    def __init__(self, entries: Sequence[Entry]) -> None:
        self._entries = [entry for entry in entries if entry.record.role == "input"]
        self._given = 0
        self._polls = 0

    @property
    def left(self) -> int:
        return len(self._entries) - self._given

    @property
    def upcoming(self) -> records.Record | None:
        return self._entries[self._given].record if self.left else None

    def take(self, kind: type[Kind], call: str) -> tuple[Kind, Entry]:
        """The next input, which must be of that kind; raises what the port raised then, or Divergence."""
        self.raise_failure(call)
        record = self.upcoming
        if not isinstance(record, kind):
            what = "the trial ends there" if record is None else f"the trial has {record.topic} there"
            raise Divergence(f"input {self._given + 1}: the mission asked for {call}, but {what}")
        return record, self._next()

    def raise_failure(self, call: str) -> None:
        """Raise what the port raised at this call, if that is next."""
        failure = self.upcoming
        if isinstance(failure, records.PortFailure) and failure.call == call and failure.polls <= self._polls:
            self._next()
            raise error_of(failure.kind, failure.message)

    def stop(self) -> StopRequest | None:
        """The operator's STOP, at the very poll at which it was heard."""
        self.raise_failure("operator.stop_requested")
        record = self.upcoming
        if isinstance(record, records.Stop) and record.polls <= self._polls:
            self._next()
            return StopRequest(record.because, record.who, record.how, record.at_ns)
        self._polls += 1
        return None

    def verdict(self) -> records.Supervised | None:
        """The supervisor's next verdict, at the very poll at which it came; None before it."""
        self.raise_failure("safety.verdict")
        record = self.upcoming
        if isinstance(record, records.Supervised) and record.polls <= self._polls:
            self._next()
            return record
        return None

    def _next(self) -> Entry:
        entry = self._entries[self._given]
        self._given += 1
        self._polls = 0
        return entry
