"""What one query has come to, while a mission works on it."""

from __future__ import annotations

from dataclasses import dataclass, field

from behaviors.arrival import CameraMount
from behaviors.attempt import Attempt
from openbelief.target_phrase import target_phrase


@dataclass
class QueryProgress:
    """q never changes, R and U only grow."""

    sentence: str
    mount: CameraMount | None = None
    rejected: list[int] = field(default_factory=list)  # R_q
    set_aside: list[int] = field(default_factory=list)  # U
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
    def current(self) -> Attempt:
        """The candidate being tried; the states that need one come after retrieve."""
        if self.attempt is None:
            raise RuntimeError("No candidate was retrieved yet.")
        return self.attempt
