"""What Nav2's numbers mean, in an operator's words."""

from __future__ import annotations

import numpy as np

from drivers.ports import NavigationResult, NavigationStatus, PathPlan, PortError
from drivers.ros.action import ABORTED, CANCELED, SUCCEEDED
from drivers.ros.convert import path_of
from drivers.ros.messages import Message, WireError
from openbelief.arrays import Array
from openbelief.polyline import arc_length, at_distances, path_length, resampled

REJECTED = NavigationResult(NavigationStatus.REJECTED, "Nav2 rejected the goal: is bt_navigator active?")
ERROR_WORDS = {
    1: "the goal was rejected inside Nav2",
    2: "the goal could not be sent on inside Nav2",
    100: "the controller failed",
    101: "the controller is not configured",
    102: "the controller missed a transform: check /tf and the clocks",
    103: "the path was not valid",
    104: "the controller lost patience: something blocks the way",
    105: "the robot made no progress: something blocks the way",
    106: "no safe motion was found: something is too near",
    107: "the controller took too long",
    200: "the planner failed",
    201: "the planner is not configured",
    202: "the planner missed a transform: check /tf and the clocks",
    203: "the robot stands outside the map",
    204: "the goal lies outside the map",
    205: "the robot stands in an obstacle of the map",
    206: "the goal is occupied",
    207: "planning took too long",
    208: "there is no way to the goal",
    9000: "the navigator failed",
    9001: "the behaviour tree could not be loaded",
    9002: "the navigator missed a transform: check /tf and the clocks",
    9003: "the navigator took too long",
}

SAID = {SUCCEEDED: "succeeded", CANCELED: "canceled", ABORTED: "aborted"}
WAY_M = 3.0  # of a path is looked at: its far end is replanned on the way anyhow
SHOWN_EVERY_M = 0.2  # of the whole path, for a plan on a screen


def error_words(code: int, message: str) -> str:
    """A clause for Nav2's error_code and error_msg; code 0 gives no reason at all."""
    known = ERROR_WORDS.get(code, f"error {code}")
    if code == 0:
        known = "it gave no reason (a pose that it cannot use ends so)"
    return f"{known} ({message})" if message else known


def failure_of(result: Message) -> tuple[int, str]:
    """(code, message) of an action's result; Humble's results have neither."""
    return int(getattr(result, "error_code", 0)), str(getattr(result, "error_msg", ""))


def navigation_result(status: int, result: Message, *, replaced: bool) -> NavigationResult:
    """The end of a goal from its terminal status and result.

    replaced: another goal came after ours. Nav2 aborts a goal that was replaced, with code 0.
    """
    code, message = failure_of(result)
    if status == SUCCEEDED:
        return NavigationResult(NavigationStatus.SUCCEEDED, "Nav2 reached the goal.")
    if status == CANCELED:
        return NavigationResult(NavigationStatus.CANCELED, "The goal was cancelled, and not by this program.", code)
    if status == ABORTED and code == 0 and replaced:
        return NavigationResult(
            NavigationStatus.PREEMPTED, "Another goal replaced ours: somebody else drives the robot."
        )
    return NavigationResult(NavigationStatus.ABORTED, f"Nav2 gave up: {error_words(code, message)}.", code)


def result_from_status(status: int, *, replaced: bool) -> NavigationResult:
    """The end of a goal whose server says that it ended and whose result message is lost.

    That it succeeded is not said without the result.
    """
    said = SAID.get(status, "aborted")
    end = NavigationStatus.CANCELED if status == CANCELED else NavigationStatus.ABORTED
    if status == SUCCEEDED:
        end = NavigationStatus.LOST
    elif end is NavigationStatus.ABORTED and replaced:
        end = NavigationStatus.PREEMPTED
    return NavigationResult(end, f"Nav2's status says {said}; its result message was lost.")


def path_plan(response: Message) -> PathPlan:
    """PathPlan of a ComputePathToPose_GetResult_Response.

    Raises PortError where it makes no statement on the path: cancelled, forgotten, or a path of another frame.
    """
    if response.status == ABORTED:
        return PathPlan(None, f"No way was found: {error_words(*failure_of(response.result))}.")
    if response.status != SUCCEEDED:
        raise PortError(f"Nav2's planner did not finish (goal status {response.status}): ask again.")
    try:
        points = path_of(response.result.path)
    except WireError as error:
        raise PortError(f"The path of Nav2's planner cannot be used: {error}") from error
    if len(points) == 0:
        return PathPlan(None, "No way was found: Nav2's planner returned an empty path.")
    return PathPlan(path_length(points), path_prefix=_first(points), path=_thinned(points))


def _thinned(points: Array) -> tuple[tuple[float, float], ...]:
    """The path by a point each SHOWN_EVERY_M, both ends included."""
    _, shown = resampled(points, SHOWN_EVERY_M)
    return tuple((float(x), float(y)) for x, y in shown)


def _first(points: Array) -> tuple[tuple[float, float], ...]:
    """The points of the first WAY_M metres, and where these end."""
    along = arc_length(points)
    first = points[along <= WAY_M]
    if len(first) < len(points):
        first = np.vstack((first, at_distances(points, along, WAY_M)))
    return tuple((float(x), float(y)) for x, y in first)
