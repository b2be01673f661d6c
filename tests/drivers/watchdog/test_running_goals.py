"""Which goals run by Nav2's own word, and which of its answers to a cancel are believed."""

from __future__ import annotations

import pytest

from drivers.ros import action
from drivers.ros.messages import codec
from drivers.watchdog.running_goals import RunningGoals
from sim_fakes.wire.nav2_messages import Nav2Messages, ServedGoal

A, B = bytes(16 * [1]), bytes(16 * [2])
OK, REJECTED, UNKNOWN = action.CANCEL_OK, action.CANCEL_REJECTED, action.CANCEL_UNKNOWN_GOAL


def reply(code: int, *named: bytes):
    return Nav2Messages(codec()).cancelled(code, [ServedGoal(uuid, None, 0) for uuid in named])


def running(*uuids: bytes) -> RunningGoals:
    goals = RunningGoals()
    goals.hear(dict.fromkeys(uuids, action.EXECUTING))
    return goals


def test_what_one_server_tells_of_its_goals_says_nothing_about_anothers() -> None:
    goals = running(A)
    goals.hear({B: action.ACCEPTED})
    goals.hear({B: action.CANCELED})
    assert goals, "A still runs"
    goals.hear({A: action.CANCELING})
    assert not goals


def test_a_nav2_that_is_gone_runs_nothing() -> None:
    goals = running(A)
    goals.forget()
    assert not goals


@pytest.mark.parametrize(
    ("goals", "replies", "code"),
    [
        ((), [reply(OK)], OK),
        ((A,), [reply(OK, A)], OK),
        ((A,), [reply(OK)], REJECTED),
        ((A, B), [reply(OK, A)], REJECTED),
        ((A, B), [reply(OK, A), reply(OK, B)], OK),
        ((A, B), [reply(OK, A), reply(REJECTED)], REJECTED),
        ((), [reply(UNKNOWN)], UNKNOWN),
        ((A,), [reply(UNKNOWN)], REJECTED),
    ],
    ids=[
        "nothing runs",
        "it is named",
        "ok that names nobody",
        "one of two is named",
        "each server names its own",
        "one server refuses",
        "no such goal",
        "no such goal, while one runs",
    ],
)
def test_a_cancel_of_all_goals_is_taken_where_every_goal_that_runs_is_named(goals, replies, code) -> None:
    assert running(*goals).code(replies) == code
