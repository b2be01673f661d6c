"""What one query has come to, while a mission works on it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from behaviors.arrival import CameraMount
from behaviors.attempt import Attempt
from behaviors.events import NO_CANDIDATE_LEFT, NONE_WANTED, End, Event, Outcome, Step
from openbelief.grounded.geometry import Viewer
from openbelief.memory import Candidate
from openbelief.request.encoded import EncodedRequest


@dataclass
class QueryProgress:
    """q never changes, R and U only grow."""

    asked: EncodedRequest  # parsed and embedded once, for ranking, checking and the record
    viewer: Viewer | None = None  # where the robot stood when it was asked, where the sentence needs it
    doubt_because: str = ""  # why the operator has to say, where it is unsure
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
        """The words that the paper's readouts compare with the map."""
        return self.asked.request.text

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
        """Whether candidates are set aside only because the operator declined them."""
        return bool(self.declined) and set(self.declined) == set(self.set_aside)

    @property
    def current(self) -> Attempt:
        """The candidate being tried; the states that need one come after retrieve."""
        if self.attempt is None:
            raise RuntimeError("No candidate was retrieved yet.")
        return self.attempt

    def nothing_left(self, why: str | None) -> Step:
        """The end where no candidate is left to try. why: what keeps the memory from giving one."""
        if self.visits:
            return Step(Event.EXHAUSTED, NO_CANDIDATE_LEFT)
        if self.unwanted:
            return Step(Event.DECLINED, NONE_WANTED)
        return Step(Event.NONE_VERIFIED, f"{NO_CANDIDATE_LEFT}: {why}")

    def outcome(self, end: End, because: str) -> Outcome:
        rejected, set_aside, declined = map(tuple, (self.rejected, self.set_aside, self.declined))
        return Outcome(end, because, self.visits, self.confirmed, rejected, set_aside, declined)
