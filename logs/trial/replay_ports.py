"""The ports of a recorded trial: the same answers in the same order, a complaint when others are asked for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivers.clock import SimClock
from drivers.ports import (
    Approval,
    CameraFrame,
    LidarCloud,
    NavigationFeedback,
    NavigationResult,
    NavigationStatus,
    PathPlan,
    Ports,
    Question,
    Reaction,
    Reply,
    SafetyVerdict,
    StampedPose,
    StopRequest,
)
from logs.trial import records
from logs.trial.compare import TOLERANCE
from logs.trial.journal import Entry
from logs.trial.replay_inputs import Divergence, RecordedInputs
from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

# What may come next while a goal is under way and has no result yet.
DURING_A_DRIVE = (records.Stop, records.CancelAnswer, records.HaltAnswer, records.Supervised)


def replay_ports(entries: Sequence[Entry]) -> Ports:
    """One body behind every port, fed from a trial's entries. The clock passes only in sleep.

    Another perception can stand before the recorded one: logs.trial.perception_comparison.
    """
    inputs = RecordedInputs([entry for entry in entries if not isinstance(entry.record, records.Query)])
    return Ports(
        clock=SimClock(0),
        camera=ReplayCamera(inputs),
        poses=ReplayPoses(inputs),
        map=ReplayMap(inputs),
        navigator=ReplayNavigator(inputs),
        operator=ReplayOperator(inputs),
        perception=ReplayPerception(inputs, entries),
        lidar=ReplayLidar(inputs) if _had_lidar(entries) else None,
        safety=ReplaySafety(inputs),
    )


def _had_lidar(entries: Sequence[Entry]) -> bool:
    """Whether the mission asked a lidar; trials from before it was used have none."""
    return any(
        isinstance(e.record, records.Cloud)
        or (isinstance(e.record, records.PortFailure) and e.record.call == "lidar.latest")
        for e in entries
    )


class ReplayCamera:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs

    def latest(self, max_age_s: float) -> CameraFrame:  # noqa: ARG002 - how old it was then is what counts
        _, entry = self._inputs.take(records.Frame, "camera.latest")
        if not isinstance(entry.attached, CameraFrame):
            raise Divergence("the trial's frame has no images")
        return entry.attached


class ReplayLidar:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs

    def latest(self, max_age_s: float) -> LidarCloud:  # noqa: ARG002
        _, entry = self._inputs.take(records.Cloud, "lidar.latest")
        if not isinstance(entry.attached, LidarCloud):
            raise Divergence("the trial's cloud has no points")
        return entry.attached


class ReplaySafety:
    """The verdict of the trial's supervisor: GO until it says something else."""

    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs
        self._verdict = SafetyVerdict()

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:  # noqa: ARG002
        if (record := self._inputs.verdict()) is not None:
            self._verdict = SafetyVerdict(Reaction(record.reaction), record.condition, record.sentence)
        return self._verdict


class ReplayPoses:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        record, _ = self._inputs.take(records.Transform, "poses.transform_at")
        _same_question("transform_at", (stamp_ns, frame_id), (record.stamp_ns, record.frame_id))
        return record.matrix()

    def robot_pose(self, max_age_s: float) -> Pose2:  # noqa: ARG002
        return self._inputs.take(records.RobotPose, "poses.robot_pose")[0].pose.pose2()

    def stamped_pose(self, max_age_s: float) -> StampedPose:  # noqa: ARG002
        record, _ = self._inputs.take(records.PoseLook, "poses.stamped_pose")
        return StampedPose(record.stamp_ns, record.pose.pose2())


class ReplayMap:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs

    def latest(self) -> OccupancyGrid:
        _, entry = self._inputs.take(records.MapUsed, "map.latest")
        if not isinstance(entry.attached, OccupancyGrid):
            raise Divergence("the trial's map has no cells")
        return entry.attached


class ReplayPerception:
    """Its id and its kind of features are those of the trial's first masks."""

    def __init__(self, inputs: RecordedInputs, entries: Sequence[Entry]) -> None:
        self._inputs = inputs
        first = next((e.record for e in entries if isinstance(e.record, records.Segments)), None)
        self.id = first.perception if first else "none"
        self.feature_text_aligned = first.feature_text_aligned if first else True

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        record, _ = self._inputs.take(records.Segments, "perception.perceive")
        _same_question("perceive", frame.stamp_ns, record.stamp_ns)
        return [segment.mask() for segment in record.masks]


class ReplayNavigator:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs
        self._ended: NavigationResult | None = None

    def unavailable(self) -> str | None:
        return self._inputs.take(records.NavigatorState, "navigator.unavailable")[0].unavailable

    def plan(self, goal: Pose2) -> PathPlan:
        record, _ = self._inputs.take(records.Plan, "navigator.plan")
        _same_goal("plan", goal, record.goal)
        return PathPlan(record.length_m, record.reason, record.path_prefix, record.path)

    def send(self, goal: Pose2) -> NavigationResult | None:
        self._ended = None
        record, _ = self._inputs.take(records.GoalAnswer, "navigator.send")
        _same_goal("send", goal, record.goal)
        if record.status is not None:
            self._ended = NavigationResult(NavigationStatus(record.status), record.reason, record.code)
        return self._ended

    def feedback(self) -> NavigationFeedback | None:
        self._inputs.raise_failure("navigator.feedback")
        return None

    def result(self) -> NavigationResult | None:
        """None while the trial has a STOP or a cancel before the goal's end."""
        following = self._inputs.upcoming
        elsewhere = isinstance(following, records.PortFailure) and following.call != "navigator.result"
        if self._ended is None and not (isinstance(following, DURING_A_DRIVE) or elsewhere):
            record, _ = self._inputs.take(records.NavigationEnd, "navigator.result")
            self._ended = NavigationResult(NavigationStatus(record.status), record.reason, record.code)
        return self._ended

    def cancel(self, *, because: str) -> NavigationResult:  # noqa: ARG002 - the reason is ours, the answer recorded
        record, _ = self._inputs.take(records.CancelAnswer, "navigator.cancel")
        return NavigationResult(NavigationStatus(record.status), record.reason, record.code)

    def halt(self, *, because: str) -> NavigationResult:  # noqa: ARG002
        record, _ = self._inputs.take(records.HaltAnswer, "navigator.halt")
        return NavigationResult(NavigationStatus(record.status), record.reason)


class ReplayOperator:
    def __init__(self, inputs: RecordedInputs) -> None:
        self._inputs = inputs

    def confirm(self, question: Question, timeout_s: float) -> Reply:  # noqa: ARG002
        said = self._inputs.take(records.OperatorReply, "operator.confirm")[0]
        return Reply(Approval(said.reply), said.object_id, said.who, said.how, said.at_ns)

    def stop_requested(self) -> StopRequest | None:
        return self._inputs.stop()

    def tell(self, sentence: str) -> None:  # noqa: ARG002 - there is nobody to tell
        self._inputs.raise_failure("operator.tell")


def _same_goal(call: str, asked: Pose2, recorded: records.PlanarPose) -> None:
    a, b = np.array([asked.x, asked.y, asked.yaw]), np.array([recorded.x, recorded.y, recorded.yaw])
    if np.abs(a - b).max() > TOLERANCE:
        raise Divergence(f"the mission asked to {call} {np.round(a, 3).tolist()}, the trial {np.round(b, 3).tolist()}")


def _same_question(call: str, asked: object, recorded: object) -> None:
    if asked != recorded:
        raise Divergence(f"the mission asked {call} {asked}, the trial {recorded}")
