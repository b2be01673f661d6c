"""One navigation goal from sending to its end: STOP and the supervisor are polled, and it is cancelled on any error.

A navigator's "succeeded" is a word. The drive has ARRIVED when the robot was also seen to stand near its goal.
"""

from __future__ import annotations

from behaviors.events import NAVIGATION_EVENTS, NO_PATH, REPLIES, USE_THE_REMOTE, Event, Step
from behaviors.path_prefix import PathPrefix, way_is_blocked
from behaviors.policy import MissionPolicy
from behaviors.safety_conditions import GOAL_ZONE, OPERATOR_SILENT
from behaviors.standing import Stillness
from drivers.ports import (
    NavigationResult,
    NavigationStatus,
    Ports,
    PoseUnavailable,
    Question,
    Reaction,
    SafetyVerdict,
    StaleData,
    StampedPose,
)
from openbelief.pose import Pose2

POLL_S = 0.05  # 20 Hz: a STOP is acted on within 50 ms of the clock
HOLD_S = 10.0  # a hold that lasts longer ends the mission
HOLDS_MAX = 3  # of one drive: data that comes and goes is no data to drive by
LOOKS_MAX = 60  # 3 s: a walking robot needs up to one to come to a stand, and half a second more to be seen standing
BRAKING_LOOKS = 20  # 1 s: one that still walks then, and is not near its goal, is not braking
# Ends after which nothing of ours should move the robot: it is looked at, for a status or result may be wrong.
SAID_TO_STAND = (NavigationStatus.SUCCEEDED, NavigationStatus.ABORTED)
STOPPING = (Reaction.HOLD, Reaction.CANCEL)
# What a cancel may answer that leaves a FAULT: nobody took it, or how the goal ended is not known.
TROUBLE = (NavigationStatus.STILL_MOVING, NavigationStatus.LOST)


class RobotMayMove(RuntimeError):
    """A goal was sent and nobody acknowledged its cancel."""


def drive(goal: Pose2, ports: Ports, policy: MissionPolicy, path_prefix: PathPrefix = ()) -> Step:
    """Send `goal` and wait for its end: ARRIVED, UNREACHED, STOP or FAULT, with the reason.

    path_prefix: the path's first metres. A goal that lies in a forbidden zone, or that the lidar sees blocked, is
    UNREACHED without being sent. Where the supervisor holds the robot, the goal is cancelled; once the condition is
    over and the operator agrees, the way is planned and looked at anew and the goal sent again. Any exception once the
    goal may be under way cancels it and goes on; RobotMayMove where that went unanswered.
    """
    try:
        return _unsent(goal, path_prefix, ports, policy) or _driven(goal, ports, policy)
    except BaseException as error:
        _cancel_after(error, ports, policy)
        raise


def halted(because: str, ports: Ports, policy: MissionPolicy, *, under_way: bool = False) -> Step:
    """STOP, in any state: every goal of the robot is cancelled, and it is done once that was acknowledged; else FAULT.

    under_way: whether a goal of ours runs; asked only where an old trial is replayed.
    """
    if policy.standing == "inferred" and not under_way:
        return Step(Event.STOP, because)
    end = _halt(because, ports, policy)
    return Step(Event.FAULT, f"{because}; {_words(end)}") if end.status in TROUBLE else Step(Event.STOP, because)


def refusal(ports: Ports) -> str | None:
    """Why no motion may begin now, before anybody is asked; None where it may."""
    verdict = _verdict(None, ports)
    return None if verdict.reaction is Reaction.GO else verdict.sentence


def _unsent(goal: Pose2, path_prefix: PathPrefix, ports: Ports, policy: MissionPolicy) -> Step | None:
    """Why the goal is not sent: STOP, the supervisor, or what the lidar sees; None where it may be."""
    verdict = _verdict(goal, ports)
    if verdict.reaction is not Reaction.GO and (step := _wait(verdict, goal, ports, policy)):
        return step
    blocked = way_is_blocked(goal, path_prefix, ports, policy)
    return Step(Event.UNREACHED, blocked) if blocked else None


def _driven(goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int = 0) -> Step:
    end = ports.navigator.send(goal)
    deadline_ns = ports.clock.now_ns() + round(policy.navigation_timeout_s * 1e9)
    while end is None:
        if step := _interrupted(goal, ports, policy, holds):
            return step
        ports.navigator.feedback()  # only so that the recording port writes it down
        if ports.clock.now_ns() > deadline_ns:
            end = _timed_out(ports, policy)
            break
        ports.clock.sleep(POLL_S)
        end = ports.navigator.result()
    if end.status is NavigationStatus.LOST:
        return _after_loss(end, ports, policy)
    if end.status in SAID_TO_STAND and policy.standing == "checked":
        return _looked_at(end, goal, ports, policy, holds)
    return _step(end)


def _step(end: NavigationResult) -> Step:
    return Step(NAVIGATION_EVENTS[end.status], _words(end))


def _interrupted(goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int) -> Step | None:
    """What the operator's STOP or the supervisor makes of a drive, None where neither says anything."""
    if stop := ports.operator.stop_requested():
        return halted(stop.because, ports, policy, under_way=True)
    verdict = _verdict(goal, ports)
    return _supervised(verdict, goal, ports, policy, holds) if verdict.reaction in STOPPING else None


def _looked_at(end: NavigationResult, goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int) -> Step:
    """The step of an end after which the robot should stand: looked at until it does, else halted and named."""
    still, trouble = Stillness(), "its pose stands still"
    for number in range(LOOKS_MAX):
        if step := _interrupted(goal, ports, policy, holds):
            return step
        try:
            still.see(ports.poses.stamped_pose(policy.pose_max_age_s))
        except (StaleData, PoseUnavailable) as error:
            trouble = str(error)
        if (stands := still.last) and still.stands:
            return _standing(end, stands, goal, ports, policy)
        if stands and number >= BRAKING_LOOKS and still.moved > 1.0 and _away(stands, goal, policy):
            break
        ports.clock.sleep(POLL_S)
    seen = "the robot moves on" if still.moved > 1.0 else f"nobody can tell whether the robot stands: {trouble}"
    return _not_believed(Event.FAULT, f"{_words(end).rstrip('.')}, but {seen}", ports, policy)


def _standing(end: NavigationResult, look: StampedPose, goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step:
    if end.status is not NavigationStatus.SUCCEEDED:
        return _step(end)
    if away_m := _away(look, goal, policy):
        because = f"{_words(end).rstrip('.')}, but the robot stands {away_m:.1f} m from it"
        return _not_believed(Event.UNREACHED, because, ports, policy)
    return Step(Event.ARRIVED, _words(end), look.stamp_ns)


def _away(look: StampedPose, goal: Pose2, policy: MissionPolicy) -> float | None:
    """Metres from the goal, None where it is near enough."""
    away_m = look.pose.distance_to(goal)
    return away_m if away_m > policy.goal_tolerance_m else None


def _not_believed(event: Event, because: str, ports: Ports, policy: MissionPolicy) -> Step:
    end = _halt(because, ports, policy)
    if end.status in TROUBLE:
        return Step(Event.FAULT, f"{because}; {_words(end)}")
    return Step(event, f"{because}; all goals were cancelled")


def _halt(because: str, ports: Ports, policy: MissionPolicy) -> NavigationResult:
    """Every goal is cancelled, whatever is believed of ours. Old trials recorded the cancel of ours alone."""
    tell = ports.navigator.halt if policy.standing == "checked" else ports.navigator.cancel
    return tell(because=because)


def _supervised(verdict: SafetyVerdict, goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int) -> Step:
    """The goal is cancelled first, whatever comes after; a hold goes on with the same goal, a cancel does not."""
    end = _halt(verdict.sentence, ports, policy)
    if end.status in TROUBLE:
        return Step(Event.FAULT, f"{verdict.sentence} {_words(end)}")
    ports.operator.tell(f"The robot was stopped: {verdict.sentence}")
    counted = verdict.condition != OPERATOR_SILENT
    if verdict.reaction is Reaction.CANCEL or (counted and holds >= HOLDS_MAX):
        return Step(Event.FAULT, verdict.sentence)
    step = (
        _wait(verdict, goal, ports, policy)
        or _agreed(verdict, goal, ports, policy)
        or _unsent_again(goal, ports, policy)
    )
    return step or _driven(goal, ports, policy, holds + counted)


def _unsent_again(goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step | None:
    """As `_unsent`, from where the robot was stopped: what came back may show what stands there now."""
    plan = ports.navigator.plan(goal)
    if plan.length_m is None:
        return Step(Event.UNREACHED, plan.reason or NO_PATH)
    return _unsent(goal, plan.path_prefix, ports, policy)


def _wait(verdict: SafetyVerdict, goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step | None:
    """None once nothing holds the robot any more; it stands meanwhile."""
    deadline_ns = ports.clock.now_ns() + round(HOLD_S * 1e9)
    while verdict.reaction is not Reaction.GO:
        if stop := ports.operator.stop_requested():
            return halted(stop.because, ports, policy)
        if verdict.condition == GOAL_ZONE:  # another goal mends it
            return Step(Event.UNREACHED, verdict.sentence)
        if verdict.reaction is not Reaction.HOLD or ports.clock.now_ns() > deadline_ns:
            return Step(Event.FAULT, verdict.sentence)
        ports.clock.sleep(POLL_S)
        verdict = _verdict(goal, ports)
    return None


def _agreed(verdict: SafetyVerdict, goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step | None:
    """A hold that is over never moves the robot by itself, unless the configuration allows motion without asking."""
    if policy.motion == "allow":
        return None
    question = f"I stopped because: {verdict.sentence} That is over. May I walk on?"
    event, because = REPLIES[ports.operator.confirm(Question(question, goal=goal), policy.confirm_timeout_s).word]
    if event is Event.STOP:
        return halted(because, ports, policy)
    return None if event is Event.APPROVED else Step(Event.STOP, because)


def _verdict(goal: Pose2 | None, ports: Ports) -> SafetyVerdict:
    return SafetyVerdict() if ports.safety is None else ports.safety.verdict(goal)


def _timed_out(ports: Ports, policy: MissionPolicy) -> NavigationResult:
    because = f"no arrival within {policy.navigation_timeout_s:g} s"
    end = _halt(because, ports, policy)
    if end.status is NavigationStatus.CANCELED:
        return NavigationResult(NavigationStatus.TIMED_OUT, because)
    return end


def _after_loss(end: NavigationResult, ports: Ports, policy: MissionPolicy) -> Step:
    """The robot's state is unknown: the goal is cancelled still, for the link may carry that much."""
    cancelled = _halt(end.reason, ports, policy)
    unanswered = cancelled.status is NavigationStatus.STILL_MOVING
    return Step(Event.FAULT, _may_move(end.reason) if unanswered else end.reason)


def _cancel_after(error: BaseException, ports: Ports, policy: MissionPolicy) -> None:
    try:
        end = _halt(f"error while driving: {error}", ports, policy)
    except Exception as second:  # noqa: BLE001 - whatever it was, nobody knows now whether the robot stands
        raise RobotMayMove(_may_move(f"{error}; the cancel failed too: {second}")) from error
    if end.status is NavigationStatus.STILL_MOVING:
        raise RobotMayMove(_may_move(str(error))) from error


def _words(end: NavigationResult) -> str:
    reason = end.reason or f"navigation {end.status}"
    return _may_move(reason) if end.status is NavigationStatus.STILL_MOVING else reason


def _may_move(because: str) -> str:
    return because if USE_THE_REMOTE in because.lower() else f"{because.rstrip('.')}; {USE_THE_REMOTE}"
