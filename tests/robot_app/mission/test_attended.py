"""A mission that a person attends: a silent page holds the robot, a STOP ends every wait."""

from __future__ import annotations

import threading
import time

import pytest

from behaviors.safety_conditions import OPERATOR_SILENT
from drivers.clock import SystemClock
from drivers.ports import Reaction, SafetyVerdict
from openbelief.pose import Pose2
from robot_app.mission.attended import AlertClock, PresenceSafety
from robot_app.mission.operator import SharedOperator

GOAL = Pose2(1.0, 2.0, 0.0)
LONG_S = 60.0


class Supervisor:
    def __init__(self, reaction: Reaction = Reaction.GO) -> None:
        self._reaction = reaction

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:
        return SafetyVerdict(self._reaction, "something", "Something is wrong.")


def test_a_silent_page_holds_a_robot_that_moves_and_nothing_else():
    silent = PresenceSafety(Supervisor(), lambda: "The page is not on a screen.")
    assert silent.verdict(GOAL) == SafetyVerdict(Reaction.HOLD, OPERATOR_SILENT, "The page is not on a screen.")
    assert silent.verdict(None).reaction is Reaction.GO


@pytest.mark.parametrize("reaction", [Reaction.HOLD, Reaction.CANCEL])
def test_what_the_supervisor_says_is_not_made_milder(reaction):
    verdict = PresenceSafety(Supervisor(reaction), lambda: "silent").verdict(GOAL)
    assert (verdict.reaction, verdict.condition) == (reaction, "something")


def test_without_a_supervisor_a_silent_page_holds_all_the_same():
    assert PresenceSafety(None, lambda: "silent").verdict(GOAL).reaction is Reaction.HOLD
    assert PresenceSafety(None, lambda: None).verdict(GOAL) == SafetyVerdict()


def test_a_stop_ends_a_sleep_and_sleeps_after_it_are_whole():
    operator = SharedOperator()
    clock = AlertClock(SystemClock(), operator)
    sleeping = threading.Thread(target=lambda: clock.sleep(LONG_S))
    sleeping.start()
    operator.stop(because="STOP")
    sleeping.join(LONG_S)
    assert not sleeping.is_alive()
    began_s = time.monotonic()
    clock.sleep(0.02)
    assert time.monotonic() - began_s >= 0.02
