"""One goal, from sending it to its end: STOP is heard all the way, and whatever happens it does not outlive us."""

from __future__ import annotations

from behaviors.events import NAVIGATION_EVENTS, USE_THE_REMOTE, Event, Step
from behaviors.policy import MissionPolicy
from drivers.ports import NavigationResult, NavigationStatus, Ports
from openbelief.pose import Pose2

POLL_S = 0.05  # 20 Hz: a STOP is acted on within 50 ms of the clock
# What a cancel may answer that leaves a FAULT: nobody took it, or how the goal ended is not known.
TROUBLE = (NavigationStatus.STILL_MOVING, NavigationStatus.LOST)


class RobotMayMove(RuntimeError):
    """A goal was sent and nobody acknowledged its cancel."""


def drive(goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step:
    """Send `goal` and wait for its end: ARRIVED, UNREACHED, STOP or FAULT, with the reason.

    Any exception once the goal may be under way cancels it and goes on; RobotMayMove where that went unanswered.
    """
    try:
        return _driven(goal, ports, policy)
    except BaseException as error:
        _cancel_after(error, ports)
        raise


def _driven(goal: Pose2, ports: Ports, policy: MissionPolicy) -> Step:
    end = ports.navigator.send(goal)
    deadline_ns = ports.clock.now_ns() + round(policy.navigation_timeout_s * 1e9)
    while end is None:
        if because := ports.operator.stop_requested():
            return _stopped(because, ports)
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
