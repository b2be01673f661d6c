"""The ports of a mission, writing into its journal what each of them answered, in the order in which it was consumed.

A port that raises has answered too: a PortFailure is written and the exception goes on. What only streams past
(feedback while driving, sentences shown) becomes notes. A whole drive is few inputs: the answer to the goal, and its
end or the STOP and the answer to the cancel; the polls between leave no record.
"""

from __future__ import annotations

from drivers.ports import (
    Camera,
    CameraFrame,
    Lidar,
    LidarCloud,
    Map,
    NavigationFeedback,
    NavigationResult,
    Navigator,
    Operator,
    PathPlan,
    Ports,
    PoseSource,
    Question,
    Reaction,
    Reply,
    Safety,
    SafetyVerdict,
    StampedPose,
    StopRequest,
)
from logs.trial import records
from logs.trial.journal import Journal
from logs.trial.recording_inputs import Inputs
from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import Perception
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid


def recorded(ports: Ports, journal: Journal) -> Ports:
    """The same bodies, recorded."""
    inputs = Inputs(journal)
    return Ports(
        clock=ports.clock,
        camera=JournaledCamera(ports.camera, inputs),
        poses=JournaledPoses(ports.poses, inputs),
        map=JournaledMap(ports.map, inputs),
        navigator=JournaledNavigator(ports.navigator, inputs),
        operator=JournaledOperator(ports.operator, inputs),
        perception=JournaledPerception(ports.perception, inputs),
        lidar=None if ports.lidar is None else JournaledLidar(ports.lidar, inputs),
        safety=None if ports.safety is None else JournaledSafety(ports.safety, inputs),
    )


class JournaledCamera:
    def __init__(self, camera: Camera, inputs: Inputs) -> None:
        self._camera, self._inputs = camera, inputs

    def latest(self, max_age_s: float) -> CameraFrame:
        frame = self._inputs.ask("camera.latest", lambda: self._camera.latest(max_age_s))
        self._inputs.write(records.Frame.of(frame), frame)
        return frame


class JournaledLidar:
    def __init__(self, lidar: Lidar, inputs: Inputs) -> None:
        self._lidar, self._inputs = lidar, inputs

    def latest(self, max_age_s: float) -> LidarCloud:
        cloud = self._inputs.ask("lidar.latest", lambda: self._lidar.latest(max_age_s))
        self._inputs.write(records.Cloud.of(cloud), cloud)
        return cloud


class JournaledPoses:
    def __init__(self, poses: PoseSource, inputs: Inputs) -> None:
        self._poses, self._inputs = poses, inputs

    def transform_at(self, stamp_ns: int, frame_id: str) -> Array:
        T = self._inputs.ask("poses.transform_at", lambda: self._poses.transform_at(stamp_ns, frame_id))
        self._inputs.write(records.Transform.of(stamp_ns, frame_id, T))
        return T

    def robot_pose(self, max_age_s: float) -> Pose2:
        pose = self._inputs.ask("poses.robot_pose", lambda: self._poses.robot_pose(max_age_s))
        self._inputs.write(records.RobotPose(pose=records.PlanarPose.of(pose)))
        return pose

    def stamped_pose(self, max_age_s: float) -> StampedPose:
        look = self._inputs.ask("poses.stamped_pose", lambda: self._poses.stamped_pose(max_age_s))
        self._inputs.write(records.PoseLook(stamp_ns=int(look.stamp_ns), pose=records.PlanarPose.of(look.pose)))
        return look


class JournaledMap:
    def __init__(self, port: Map, inputs: Inputs) -> None:
        self._map, self._inputs = port, inputs

    def latest(self) -> OccupancyGrid:
        grid = self._inputs.ask("map.latest", self._map.latest)
        self._inputs.write(records.MapUsed.of(grid), grid)
        return grid


class JournaledPerception:
    def __init__(self, perception: Perception, inputs: Inputs) -> None:
        self._perception, self._inputs = perception, inputs
        self.id, self.feature_text_aligned = perception.id, perception.feature_text_aligned

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        masks = self._inputs.ask("perception.perceive", lambda: self._perception.perceive(frame))
        self._inputs.write(
            records.Segments.of(frame.stamp_ns, self.id, masks, feature_text_aligned=self.feature_text_aligned)
        )
        return masks


class JournaledNavigator:
    def __init__(self, navigator: Navigator, inputs: Inputs) -> None:
        self._navigator, self._inputs = navigator, inputs
        self._feedback: NavigationFeedback | None = None
        self._result: NavigationResult | None = None

    def unavailable(self) -> str | None:
        why = self._inputs.ask("navigator.unavailable", self._navigator.unavailable)
        self._inputs.write(records.NavigatorState(unavailable=why))
        return why

    def plan(self, goal: Pose2) -> PathPlan:
        plan = self._inputs.ask("navigator.plan", lambda: self._navigator.plan(goal))
        self._inputs.write(
            records.Plan(
                goal=records.PlanarPose.of(goal),
                length_m=plan.length_m,
                reason=plan.reason,
                path_prefix=plan.path_prefix,
                path=plan.path,
            )
        )
        return plan

    def send(self, goal: Pose2) -> NavigationResult | None:
        self._result = None
        end = self._inputs.ask("navigator.send", lambda: self._navigator.send(goal))
        self._inputs.write(
            records.GoalAnswer(
                goal=records.PlanarPose.of(goal),
                status=end.status if end else None,
                reason=end.reason if end else "",
                code=end.code if end else 0,
            )
        )
        return end

    def feedback(self) -> NavigationFeedback | None:
        feedback = self._inputs.ask("navigator.feedback", self._navigator.feedback)
        if feedback is not None and feedback != self._feedback:
            self._feedback = feedback
            self._inputs.note(
                records.Feedback(
                    stamp_ns=feedback.stamp_ns,
                    pose=records.PlanarPose.of(feedback.pose),
                    distance_remaining_m=float(feedback.distance_remaining_m),
                    navigation_time_s=float(feedback.navigation_time_s),
                    recoveries=int(feedback.recoveries),
                )
            )
        return feedback

    def result(self) -> NavigationResult | None:
        end = self._inputs.ask("navigator.result", self._navigator.result)
        if end is not None and end != self._result:
            self._result = end
            self._inputs.write(records.NavigationEnd(status=end.status, reason=end.reason, code=end.code))
        return end

    def cancel(self, *, because: str) -> NavigationResult:
        end = self._inputs.ask("navigator.cancel", lambda: self._navigator.cancel(because=because))
        self._inputs.write(records.CancelAnswer(because=because, status=end.status, reason=end.reason, code=end.code))
        return end

    def halt(self, *, because: str) -> NavigationResult:
        end = self._inputs.ask("navigator.halt", lambda: self._navigator.halt(because=because))
        self._inputs.write(records.HaltAnswer(because=because, status=end.status, reason=end.reason))
        return end


class JournaledSafety:
    """Verdicts are asked for at every poll; only a change is written, with the poll at which it came."""

    def __init__(self, safety: Safety, inputs: Inputs) -> None:
        self._safety, self._inputs = safety, inputs
        self._before = SafetyVerdict()
        self._about: tuple[Reaction, str, Pose2 | None] = (Reaction.GO, "", None)

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:
        verdict = self._inputs.ask("safety.verdict", lambda: self._safety.verdict(goal))
        about = (verdict.reaction, verdict.condition, None if verdict.reaction is Reaction.GO else goal)
        if about == self._about:
            return self._before  # its sentence may count seconds; what was written is what is told
        self._before, self._about, polls = verdict, about, self._inputs.polls
        self._inputs.write(
            records.Supervised(
                reaction=verdict.reaction, condition=verdict.condition, sentence=verdict.sentence, polls=polls
            )
        )
        return verdict


class JournaledOperator:
    def __init__(self, operator: Operator, inputs: Inputs) -> None:
        self._operator, self._inputs = operator, inputs

    def confirm(self, question: Question, timeout_s: float) -> Reply:
        self._inputs.note(_asked(question, timeout_s))
        reply = self._inputs.ask("operator.confirm", lambda: self._operator.confirm(question, timeout_s))
        self._inputs.write(
            records.OperatorReply(
                question=question.sentence,
                reply=reply.word,
                object_id=reply.object_id,
                who=reply.who,
                how=reply.how,
                at_ns=reply.at_ns,
            )
        )
        return reply

    def stop_requested(self) -> StopRequest | None:
        stop = self._inputs.ask("operator.stop_requested", self._operator.stop_requested)
        if stop is None:
            self._inputs.polls += 1
        else:
            polls = self._inputs.polls
            self._inputs.write(
                records.Stop(because=stop.because, polls=polls, who=stop.who, how=stop.how, at_ns=stop.at_ns)
            )
        return stop

    def tell(self, sentence: str) -> None:
        self._inputs.ask("operator.tell", lambda: self._operator.tell(sentence))
        self._inputs.note(records.Told(sentence=sentence))


def _asked(question: Question, timeout_s: float) -> records.Asked:
    return records.Asked(
        sentence=question.sentence,
        because=question.because,
        object_id=question.object_id,
        goal=None if question.goal is None else records.PlanarPose.of(question.goal),
        path_length_m=question.path_length_m,
        memory_hash=question.memory_hash,
        expires_s=timeout_s,
    )
