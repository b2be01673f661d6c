"""What a mission has come to: one fold over the entries of its journal, live or from a trial's file.

The live page and the scrubber of a recorded trial show the same view, so a trial looks afterwards as it looked then.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from drivers.ports import CameraFrame
from logs.trial import records
from logs.trial.journal import Attached, Entry
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask
from robot_app.mission.outlines import outlines

TOLD_KEPT = 30
TRACK_EVERY_M = 0.05
MOVING = ("navigate", "re_observe")


@dataclass
class CandidateView:
    """One candidate that was ever ranked. number: its place in the last ranking, None once it is left out."""

    object_id: int
    label: str
    score: float
    visual: float | None
    language: float | None
    number: int | None
    status: str = "candidate"
    because: str = ""


@dataclass
class LookView:
    """One arrival: the frame that was judged, what perception saw in it, and the three checks."""

    frame: CameraFrame
    masks: list[dict[str, Any]]
    place: list[list[list[float]]]  # outlines of where the map remembers the object
    checks: dict[str, Any]


@dataclass
class MissionView:
    """`see` each entry in order; `as_json` is what a page shows. Not thread-safe."""

    memory: ObjectMemory | None = None
    query: records.Query | None = None
    state: str = "query"
    because: str = ""
    target: str = ""
    candidates: dict[int, CandidateView] = field(default_factory=dict)
    chosen: int | None = None
    attempt: int = 0
    goal: records.PlanarPose | None = None
    path: tuple[tuple[float, float], ...] = ()
    path_length_m: float | None = None
    asked: records.Asked | None = None
    replies: list[records.OperatorReply] = field(default_factory=list)
    robot: records.PlanarPose | None = None
    track: list[tuple[float, float]] = field(default_factory=list)
    remaining_m: float | None = None
    supervised: records.Supervised | None = None
    told: list[str] = field(default_factory=list)
    looks: list[LookView] = field(default_factory=list)
    outcome: records.Ended | None = None
    frame: CameraFrame | None = None
    _segments: records.Segments | None = None
    _poses: dict[tuple[int, str], Array] = field(default_factory=dict)

    @classmethod
    def of(cls, entries: Iterable[Entry], memory: ObjectMemory | None = None) -> MissionView:
        view = cls(memory)
        for entry in entries:
            view.see(entry.record, entry.attached)
        return view

    def see(self, record: records.Record, attached: Attached = None) -> None:
        if isinstance(attached, CameraFrame):
            self.frame = attached
        handle = HANDLERS.get(type(record))
        if handle is not None:
            handle(self, record)

    @property
    def moving(self) -> bool:
        """Whether a goal may be under way."""
        return self.outcome is None and self.state in MOVING

    def as_json(self) -> dict[str, Any]:
        ended = self.outcome
        return {
            "sentence": self.query.sentence if self.query else "",
            "who": self.query.who if self.query else "",
            "how": self.query.how if self.query else "",
            "state": self.state,
            "because": self.because,
            "target": self.target,
            "candidates": [vars(each) for each in self._in_order()],
            "chosen": self.chosen,
            "attempt": self.attempt,
            "goal": _pose(self.goal),
            "path": [list(point) for point in self.path],
            "path_length_m": self.path_length_m,
            "question": self.asked.model_dump(mode="json") if self.asked else None,
            "replies": [reply.model_dump(mode="json") for reply in self.replies],
            "robot": _pose(self.robot),
            "track": [[round(x, 3), round(y, 3)] for x, y in self.track],
            "remaining_m": self.remaining_m,
            "held": self.supervised.sentence if self.supervised else None,
            "told": self.told[-TOLD_KEPT:],
            "looks": [
                {"frame_stamp_ns": str(look.frame.stamp_ns), "masks": look.masks, "place": look.place} | look.checks
                for look in self.looks
            ],
            "outcome": ended.model_dump(mode="json") if ended else None,
        }

    def _in_order(self) -> list[CandidateView]:
        """Those that are left by rank, then those that are not in the order in which they were left out."""
        left = sorted((c for c in self.candidates.values() if c.number), key=lambda c: c.number or 0)
        return left + [c for c in self.candidates.values() if not c.number]

    # ---- one method for each record that shows

    def _on_query(self, record: records.Query) -> None:
        self.query = record

    def _on_ranking(self, record: records.Ranking) -> None:
        self.target = record.target
        for candidate in self.candidates.values():
            candidate.number = None
        for number, scored in enumerate(record.candidates, start=1):
            label = scored.label or f"object {scored.object_id}"
            shown = CandidateView(scored.object_id, label, scored.score, scored.visual, scored.language, number)
            self.candidates[scored.object_id] = shown

    def _on_chosen(self, record: records.Chosen) -> None:
        self.chosen, self.attempt = record.object_id, record.attempt
        self.goal, self.path, self.path_length_m = None, (), None
        self._mark(record.object_id, "chosen", "")

    def _on_goal(self, record: records.Goal) -> None:
        self.goal = record.pose or self.goal
        self.path_length_m = record.path_length_m if record.purpose == "approach" else self.path_length_m

    def _on_plan(self, record: records.Plan) -> None:
        self.path = record.path or record.path_prefix
        self.path_length_m = record.length_m

    def _on_asked(self, record: records.Asked) -> None:
        self.asked = record

    def _on_reply(self, record: records.OperatorReply) -> None:
        self.asked = None
        self.replies.append(record)

    def _on_pose(self, record: records.RobotPose | records.Feedback) -> None:
        self.robot = record.pose
        if isinstance(record, records.Feedback):
            self.remaining_m = record.distance_remaining_m
        here = (record.pose.x, record.pose.y)
        if not self.track or max(abs(a - b) for a, b in zip(here, self.track[-1], strict=True)) >= TRACK_EVERY_M:
            self.track.append(here)

    def _on_transform(self, record: records.Transform) -> None:
        self._poses[record.stamp_ns, record.frame_id] = record.matrix()

    def _on_segments(self, record: records.Segments) -> None:
        self._segments = record

    def _on_checks(self, record: records.Checks) -> None:
        self._mark(record.object_id, record.verdict, record.reason)
        if self.frame is None or self._segments is None:
            return
        found = [segment.mask() for segment in self._segments.masks]
        masks = [_mask_json(mask, judged=mask.index == record.mask_index) for mask in found]
        checks = record.model_dump(mode="json") | {"frame_stamp_ns": str(record.frame_stamp_ns)}
        self.looks.append(LookView(self.frame, masks, self._place(record.object_id, self.frame), checks))

    def _on_exclusion(self, record: records.Exclusion) -> None:
        self._mark(record.object_id, "declined" if record.declined else record.where, record.because)

    def _on_transition(self, record: records.Transition) -> None:
        self.state, self.because = record.target, record.because
        if record.source == "navigate":
            self.remaining_m = None

    def _on_supervised(self, record: records.Supervised) -> None:
        self.supervised = record if record.sentence else None

    def _on_told(self, record: records.Told) -> None:
        self.told.append(record.sentence)

    def _on_ended(self, record: records.Ended) -> None:
        self.outcome, self.asked, self.supervised = record, None, None
        if record.object_id is not None:
            self._mark(record.object_id, "confirmed", record.reason)

    def _mark(self, object_id: int, status: str, because: str) -> None:
        if (candidate := self.candidates.get(object_id)) is not None:
            candidate.status, candidate.because = status, because

    def _place(self, object_id: int, frame: CameraFrame) -> list[list[list[float]]]:
        if self.memory is None:
            return []
        from robot_app.pictures.arrival import stored_place

        pose = self._poses.get((frame.stamp_ns, frame.frame_id))
        return outlines(stored_place(self.memory.objects[object_id], frame, pose))


def _pose(pose: records.PlanarPose | None) -> dict[str, float] | None:
    return None if pose is None else pose.model_dump()


def _mask_json(mask: Mask, *, judged: bool) -> dict[str, Any]:
    return {"phrase": mask.phrase, "judged": judged, "outline": outlines(mask.pixels)}


HANDLERS: dict[type[records.Record], Callable[[MissionView, Any], None]] = {
    records.Query: MissionView._on_query,
    records.Ranking: MissionView._on_ranking,
    records.Chosen: MissionView._on_chosen,
    records.Goal: MissionView._on_goal,
    records.Plan: MissionView._on_plan,
    records.Asked: MissionView._on_asked,
    records.OperatorReply: MissionView._on_reply,
    records.RobotPose: MissionView._on_pose,
    records.Feedback: MissionView._on_pose,
    records.Transform: MissionView._on_transform,
    records.Segments: MissionView._on_segments,
    records.Checks: MissionView._on_checks,
    records.Exclusion: MissionView._on_exclusion,
    records.Transition: MissionView._on_transition,
    records.Supervised: MissionView._on_supervised,
    records.Told: MissionView._on_told,
    records.Ended: MissionView._on_ended,
}
