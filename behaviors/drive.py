"""One goal, from sending it to its end: STOP and the supervisor are heard all the way, and it never outlives us."""

from __future__ import annotations

from behaviors.events import NAVIGATION_EVENTS, NO_PATH, REPLIES, USE_THE_REMOTE, Event, Step
from behaviors.path_prefix import PathPrefix, way_is_blocked
from behaviors.policy import MissionPolicy
from behaviors.supervisor import GOAL_ZONE
from drivers.ports import NavigationResult, NavigationStatus, Ports, Question, Reaction, SafetyVerdict
from openbelief.pose import Pose2

POLL_S = 0.05  # 20 Hz: a STOP is acted on within 50 ms of the clock
HOLD_S = 10.0  # a hold that lasts longer ends the mission
HOLDS_MAX = 3  # of one drive: data that comes and goes is no data to drive by
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
        _cancel_after(error, ports)
        raise


def refusal(ports: Ports) -> str | None:
    """Why no motion may begin now, before anybody is asked; None where it may."""
    verdict = _verdict(None, ports)
    return None if verdict.reaction is Reaction.GO else verdict.sentence


def _unsent(goal: Pose2, path_prefix: PathPrefix, ports: Ports, policy: MissionPolicy) -> Step | None:
    """Why the goal is not sent: STOP, the supervisor, or what the lidar sees; None where it may be."""
    verdict = _verdict(goal, ports)
    if verdict.reaction is not Reaction.GO and (step := _wait(verdict, goal, ports)):
        return step
    blocked = way_is_blocked(goal, path_prefix, ports, policy)
    return Step(Event.UNREACHED, blocked) if blocked else None


def _driven(goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int = 0) -> Step:
    end = ports.navigator.send(goal)
    deadline_ns = ports.clock.now_ns() + round(policy.navigation_timeout_s * 1e9)
    while end is None:
        if stop := ports.operator.stop_requested():
            return _stopped(stop.because, ports)
        verdict = _verdict(goal, ports)
        if verdict.reaction in STOPPING:
            return _supervised(verdict, goal, ports, policy, holds)
        ports.navigator.feedback()  # the recorded port notes it
        if ports.clock.now_ns() > deadline_ns:
            end = _timed_out(ports, policy)
            break
        ports.clock.sleep(POLL_S)
        end = ports.navigator.result()
    if end.status is NavigationStatus.LOST:
        return _after_loss(end, ports)
    return _step(end)


def _step(end: NavigationResult) -> Step:
    return Step(NAVIGATION_EVENTS[end.status], _words(end))


def _stopped(because: str, ports: Ports) -> Step:
    end = ports.navigator.cancel(because=because)
    return Step(Event.FAULT, f"{because}; {_words(end)}") if end.status in TROUBLE else Step(Event.STOP, because)


def _supervised(verdict: SafetyVerdict, goal: Pose2, ports: Ports, policy: MissionPolicy, holds: int) -> Step:
    """The goal is cancelled first, whatever comes after; a hold goes on with the same goal, a cancel does not."""
    end = ports.navigator.cancel(because=verdict.sentence)
    if end.status in TROUBLE:
        return Step(Event.FAULT, f"{verdict.sentence} {_words(end)}")
    ports.operator.tell(f"The robot was stopped: {verdict.sentence}")
    if verdict.reaction is Reaction.CANCEL or holds >= HOLDS_MAX:
        return Step(Event.FAULT, verdict.sentence)
    step = _wait(verdict, goal, ports) or _agreed(verdict, goal, ports, policy) or _unsent_again(goal, ports, policy)
    return step or _driven(goal, ports, policy, holds + 1)


def _unsent_again(goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step | None:
    """As `_unsent`, from where the robot was stopped: what came back may show what stands there now."""
    plan = ports.navigator.plan(goal)
    if plan.length_m is None:
        return Step(Event.UNREACHED, plan.reason or NO_PATH)
    return _unsent(goal, plan.path_prefix, ports, policy)


def _wait(verdict: SafetyVerdict, goal: Pose2, ports: Ports) -> Step | None:
    """None once nothing holds the robot any more; it stands meanwhile."""
    deadline_ns = ports.clock.now_ns() + round(HOLD_S * 1e9)
    while verdict.reaction is not Reaction.GO:
        if stop := ports.operator.stop_requested():
            return Step(Event.STOP, stop.because)
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
    return None if event is Event.APPROVED else Step(Event.STOP, because)


def _verdict(goal: Pose2 | None, ports: Ports) -> SafetyVerdict:
    return SafetyVerdict() if ports.safety is None else ports.safety.verdict(goal)


def _timed_out(ports: Ports, policy: MissionPolicy) -> NavigationResult:
    because = f"no arrival within {policy.navigation_timeout_s:g} s"
    end = ports.navigator.cancel(because=because)
    if end.status is NavigationStatus.CANCELED:
        return NavigationResult(NavigationStatus.TIMED_OUT, because)
    return end


def _after_loss(end: NavigationResult, ports: Ports) -> Step:
    """The robot's state is unknown: the goal is cancelled still, for the link may carry that much."""
    cancelled = ports.navigator.cancel(because=end.reason)
    unanswered = cancelled.status is NavigationStatus.STILL_MOVING
    return Step(Event.FAULT, _may_move(end.reason) if unanswered else end.reason)


def _cancel_after(error: BaseException, ports: Ports) -> None:
    try:
        end = ports.navigator.cancel(because=f"error while driving: {error}")
    except Exception as second:  # noqa: BLE001 - whatever it was, nobody knows now whether the robot stands
        raise RobotMayMove(_may_move(f"{error}; the cancel failed too: {second}")) from error
    if end.status is NavigationStatus.STILL_MOVING:
        raise RobotMayMove(_may_move(str(error))) from error


def _words(end: NavigationResult) -> str:
    reason = end.reason or f"navigation {end.status}"
    return _may_move(reason) if end.status is NavigationStatus.STILL_MOVING else reason


def _may_move(because: str) -> str:
    return because if USE_THE_REMOTE in because.lower() else f"{because.rstrip('.')}; {USE_THE_REMOTE}"
