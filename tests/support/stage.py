"""Honest bodies for a mission: a robot that jumps among boxes, a clock that is slept, an operator with a script."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np

from behaviors.events import Outcome
from behaviors.mission import Mission
from behaviors.policy import MissionPolicy
from drivers.clock import SimClock
from drivers.ports import (
    Approval,
    CameraFrame,
    LidarCloud,
    NavigationResult,
    NavigationStatus,
    PathPlan,
    Ports,
    Question,
    Reply,
    SafetyVerdict,
    StaleData,
    StampedPose,
    StopRequest,
)
from logs.trial.compare import compare_decisions
from logs.trial.journal import ListJournal
from logs.trial.records import Record, Transition
from logs.trial.replay_ports import replay_ports
from openbelief import g1
from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.pose import Pose2, apply, inverse
from support.boxes import CAMERA_FRAME, ENCODER, Box, K, grid_of, memory_of, render

OK = NavigationResult(NavigationStatus.SUCCEEDED, "goal reached")


class Stage:
    """Everything around one mission; tests set its attributes before `run`."""

    def __init__(self, boxes: list[Box], **parameters) -> None:
        self.boxes, self.robot = boxes, Pose2(1.0, 1.0, 0.0)
        self.parameters = Parameters(**parameters)
        # The paper's; tests of doubt say "grounded", tests of the relative check "relative".
        self.policy = MissionPolicy(readout="consensus", arrival_check="paper")
        self.memory = memory_of(boxes, self.parameters)
        self.clock = SimClock(1_700_000_000_000_000_000)
        self.camera_works: Callable[[], bool] = lambda: True
        self.camera_period_ns = 1  # of its frames; a frame is there as soon as it is stamped
        self.unavailable: str | None = None
        self.drives: list[Drive] = []  # scripts of the goals to come; afterwards every drive succeeds
        self.no_path: Callable[[Pose2], str | None] = lambda goal: None
        self.replies: list[str | Reply] = []  # to "may I?"; afterwards "yes"
        self.stop_when: Callable[[], bool] = lambda: False
        self.on_perceive: Callable[[], None] = lambda: None
        self.cloud: Callable[[], Array] | None = None  # (n, 3) map points that the lidar sees; None: no lidar
        self.path_prefix: tuple[tuple[float, float], ...] = ()  # what the planner tells of each path
        self.verdict: Callable[[Pose2 | None], SafetyVerdict] | None = None  # None: nobody supervises
        self.look_at: Callable[[Pose2], Pose2] = lambda robot: robot  # where it is when it is looked at
        self.told: list[str] = []
        self.sent: list[Pose2] = []
        self.cancelled: list[str] = []
        self.asked: list[str] = []
        self.questions: list[Question] = []
        self.perceived = 0
        self.journal = ListJournal()

    def run(self, sentence: str = "take me to the fire extinguisher", after: str = "") -> Outcome:
        """One mission; its replay from the journal must decide the same."""
        mission = Mission(self.ports, self.memory, self.parameters, self.policy, self.journal)
        self.outcome = mission.run(sentence, after=after)
        difference = compare_decisions(self.journal.decisions, self.replayed(sentence, after))
        assert difference is None, str(difference)
        return self.outcome

    def replayed(self, sentence: str, after: str = "") -> list[Record]:
        journal = ListJournal()
        mission = Mission(replay_ports(self.journal.entries), self.memory, self.parameters, self.policy, journal)
        mission.run(sentence, after=after)
        return journal.decisions

    def of(self, kind: type[Record]) -> list:
        return [entry.record for entry in self.journal.entries if isinstance(entry.record, kind)]

    @property
    def path(self) -> list[str]:
        """The states that the mission went through."""
        return [transition.target for transition in self.of(Transition)]

    @property
    def ports(self) -> Ports:
        return Ports(
            clock=self.clock,
            camera=StageCamera(self),
            poses=StagePoses(self),
            map=SimpleNamespace(latest=lambda: grid_of(self.boxes)),
            navigator=StageNavigator(self),
            operator=StageOperator(self),
            perception=StagePerception(self),
            lidar=StageLidar(self) if self.cloud else None,
            safety=SimpleNamespace(verdict=self.verdict) if self.verdict else None,
        )


@dataclass
class Drive:
    """What becomes of one goal. polls: results asked for before `end`. turned: error of the final yaw, radians."""

    end: NavigationResult | None = OK  # None: under way until cancelled
    polls: int = 3
    rejected: NavigationResult | None = None
    cancel: NavigationResult = field(default=NavigationResult(NavigationStatus.CANCELED, "cancelled"))
    turned: float = 0.0
    raises: Exception | None = None
    cancel_raises: Exception | None = None


class StageNavigator:
    def __init__(self, stage: Stage) -> None:
        self.stage = stage
        self.drive = Drive()
        self.polled = 0
        self.goal: Pose2 | None = None

    def unavailable(self) -> str | None:
        return self.stage.unavailable

    def plan(self, goal: Pose2) -> PathPlan:
        why = self.stage.no_path(goal)
        return (
            PathPlan(None, why)
            if why
            else PathPlan(goal.distance_to(self.stage.robot), path_prefix=self.stage.path_prefix)
        )

    def send(self, goal: Pose2) -> NavigationResult | None:
        self.stage.sent.append(goal)
        self.drive = self.stage.drives.pop(0) if self.stage.drives else Drive()
        self.goal, self.polled = goal, 0
        return self.drive.rejected

    def feedback(self) -> None:
        return None

    def result(self) -> NavigationResult | None:
        self.polled += 1
        if self.drive.raises:
            raise self.drive.raises
        if self.drive.end is None or self.polled < self.drive.polls:
            return None
        if self.drive.end.status is NavigationStatus.SUCCEEDED:
            self.stage.robot = Pose2(self.goal.x, self.goal.y, self.goal.yaw + self.drive.turned)
        return self.drive.end

    def cancel(self, *, because: str) -> NavigationResult:
        self.stage.cancelled.append(because)
        if self.drive.cancel_raises:
            raise self.drive.cancel_raises
        return self.drive.cancel

    def halt(self, *, because: str) -> NavigationResult:
        return self.cancel(because=because)


class StageOperator:
    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def confirm(self, question: Question, timeout_s: float) -> Reply:
        self.stage.asked.append(question.sentence)
        self.stage.questions.append(question)
        reply = self.stage.replies.pop(0) if self.stage.replies else "yes"
        return reply if isinstance(reply, Reply) else Reply(Approval(reply), who="Ada", how="stage", at_ns=7)

    def stop_requested(self) -> StopRequest | None:
        return StopRequest("STOP pressed", "Ada", "stage", 7) if self.stage.stop_when() else None

    def tell(self, sentence: str) -> None:
        self.stage.told.append(sentence)


class StageCamera:
    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def latest(self, max_age_s: float) -> CameraFrame:
        if not self.stage.camera_works():
            raise StaleData("The camera's newest frame is 9.0 s old.")
        now_ns = self.stage.clock.now_ns()
        stamp_ns = now_ns - now_ns % self.stage.camera_period_ns
        if now_ns - stamp_ns > max_age_s * 1e9:
            raise StaleData(f"The camera's newest frame is {(now_ns - stamp_ns) / 1e9:.2f} s old.")
        depth, _ = render(self.stage.boxes, self.stage.robot)
        color = np.full((*depth.shape, 3), 90, np.uint8)
        return CameraFrame(stamp_ns, color, depth, K, CAMERA_FRAME)


class StageLidar:
    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def latest(self, max_age_s: float) -> LidarCloud:
        points = apply(inverse(self.stage.robot.matrix()), self.stage.cloud()).astype(np.float32)
        return LidarCloud(self.stage.clock.now_ns(), points, "livox_frame")


class StagePoses:
    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        base = self.stage.robot.matrix()
        return base @ g1.T_BASE_CAMERA if frame_id == CAMERA_FRAME else base

    def robot_pose(self, max_age_s: float) -> Pose2:
        return self.stage.robot

    def stamped_pose(self, max_age_s: float) -> StampedPose:
        return StampedPose(self.stage.clock.now_ns(), self.stage.look_at(self.stage.robot))


class StagePerception:
    id = "boxes"
    feature_text_aligned = True

    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        self.stage.on_perceive()
        self.stage.perceived += 1
        _, ids = render(self.stage.boxes, self.stage.robot)
        return [
            Mask(index, ids == index, item.seen, 0.9, ENCODER.encode([item.seen])[0])
            for index, item in enumerate(self.stage.boxes)
            if item.seen and (ids == index).sum() >= 100
        ]
