"""What one query has come to, while a mission works on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from behaviors.arrival import CameraMount
from behaviors.attempt import Attempt
from openbelief.memory import Candidate
from openbelief.target_phrase import target_phrase


@dataclass
class QueryProgress:
    """q never changes, R and U only grow."""

    sentence: str
    mount: CameraMount | None = None
    rejected: list[int] = field(default_factory=list)  # R_q
    set_aside: list[int] = field(default_factory=list)  # U
    declined: list[int] = field(default_factory=list)  # the part of U that the operator did not want
    ranking: Sequence[Candidate] = ()  # the last one
    picked: int | None = None  # the object that the operator wants first
    skipped: int | None = None  # the object that the operator does not want
    confirmed: int | None = None
    arrivals: int = 0
    attempt: Attempt | None = None

    @property
    def target(self) -> str:
        return target_phrase(self.sentence).text

    @property
    def visits(self) -> int:
        """Candidates whose verification came to an end."""
        return len(self.rejected) + (self.confirmed is not None)

    @property
    def wanted(self) -> Candidate:
        """The candidate to try now: the operator's choice while it is left, else the best."""
        return next((each for each in self.ranking if each.object_id == self.picked), self.ranking[0])

    @property
    def unwanted(self) -> bool:
        """Whether the operator's will is all that keeps the candidates away."""
        return bool(self.declined) and set(self.declined) == set(self.set_aside)

    @property
    def current(self) -> Attempt:
        """The candidate being tried; the states that need one come after retrieve."""
        if self.attempt is None:
            raise RuntimeError("No candidate was retrieved yet.")
        return self.attempt
