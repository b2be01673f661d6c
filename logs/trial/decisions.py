"""The decisions of a mission, and the notes beside them."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

from pydantic import field_validator

from logs.trial.parts import Decision, Note, PlanarPose, RecordPart

OLD_STATES = {"confirm": "await_approval"}  # as in trials from before 2026-11-29


class Scored(RecordPart):
    object_id: int
    score: float
    visual: float | None
    language: float | None
    label: str | None


class Ranking(Decision):
    """retrieve(q, R_q): the best remaining candidates, best first; empty is the paper's NONE."""

    topic: ClassVar[str] = "/trial/ranking"
    target: str
    readout: str
    rejected: tuple[int, ...]
    set_aside: tuple[int, ...]
    candidates: tuple[Scored, ...]
    answer: str | None = None  # of the readout "grounded": found, unsure, not found; None for the paper's
    because: str = ""
    understood: dict[str, Any] | None = None
    terms: tuple[dict[str, float], ...] = ()  # what each part of the sentence added, by candidate


class Chosen(Decision):
    """The candidate i of attempt k."""

    topic: ClassVar[str] = "/trial/candidate"
    attempt: int
    object_id: int
    label: str
    score: float


class Goal(Decision):
    """A goal pose, or the reason why there is none. path_length_m is the planner's."""

    topic: ClassVar[str] = "/trial/goal"
    object_id: int
    purpose: Literal["approach", "re-observe"]
    pose: PlanarPose | None
    expected_visibility: float | None
    path_length_m: float | None
    reason: str


class Check(RecordPart):
    """One arrival check: its value against its threshold; None where there was nothing to measure."""

    value: float | None
    threshold: float


class Relative(RecordPart):
    """What the relative check adds: the candidate, with what was seen there, against the rest of the map.

    lead: its score less that of `rival`, the best other object; None where none is left. contrast: how much more what
    is seen (`called` so) is like the words asked for (asked_like, by its name) than like the map's other phrases, of
    which looks_like is the first (rival_like). The candidate's likeness itself is the check `semantic`.
    """

    lead: float | None
    rival: int | None
    called: str | None
    contrast: float
    asked_like: float
    looks_like: str
    rival_like: float


class Checks(Decision):
    """The three ordered checks at a candidate, and the verdict. relative: of the relative check, once it saw a mask."""

    topic: ClassVar[str] = "/trial/checks"
    object_id: int
    frame_stamp_ns: int
    visibility: Check
    semantic: Check
    geometric: Check
    expected: int
    occluded: float
    out_of_view: float
    no_depth: float
    see_through: float
    pose_error_m: float
    mask_index: int | None
    verdict: str
    reason: str
    relative: Relative | None = None


class Exclusion(Decision):
    """A candidate that retrieval leaves out from now on: rejected is evidence, set aside is not."""

    topic: ClassVar[str] = "/trial/exclusion"
    object_id: int
    where: Literal["rejected", "set aside"]
    because: str
    declined: bool = False  # the operator did not want it


class Transition(Decision):
    """A state left for another by an event, and why."""

    topic: ClassVar[str] = "/trial/transition"
    source: str
    event: str
    target: str
    because: str

    @field_validator("source", "target")
    @classmethod
    def _named_today(cls, state: str) -> str:
        """Old trials are not rewritten: the state that awaits the operator's yes was once called confirm."""
        return OLD_STATES.get(state, state)


class Ended(Decision):
    """How the mission ended."""

    topic: ClassVar[str] = "/trial/outcome"
    end: str
    reason: str
    visits: int
    object_id: int | None
    rejected: tuple[int, ...]
    set_aside: tuple[int, ...]
    declined: tuple[int, ...] = ()


class Asked(Note):
    """A question before motion, when it was put to the operator; the answer is on /trial/operator_reply."""

    topic: ClassVar[str] = "/trial/question"
    sentence: str
    because: str
    object_id: int | None
    goal: PlanarPose | None
    path_length_m: float | None
    memory_hash: str
    expires_s: float


class Feedback(Note):
    """What the navigator said on the way."""

    topic: ClassVar[str] = "/trial/feedback"
    stamp_ns: int
    pose: PlanarPose
    distance_remaining_m: float
    navigation_time_s: float
    recoveries: int


class Spoken(Note):
    """What the operator said aloud. asked: what went on from it, after their correction; "" where it was only heard.

    confidence: 0 to 1, None where the recogniser tells none. suggestions: phrases of the memory that were offered.
    took_s: recognising. audio: the attachment that holds the sound, audio/wav.
    """

    topic: ClassVar[str] = "/trial/spoken"
    transcript: str
    asked: str
    confidence: float | None
    recogniser: str
    language: str
    suggestions: tuple[str, ...]
    took_s: float
    audio_s: float
    audio: str


class Told(Note):
    """A sentence shown to the operator."""

    topic: ClassVar[str] = "/trial/told"
    sentence: str
