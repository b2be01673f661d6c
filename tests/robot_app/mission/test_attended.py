"""A mission that a person attends: a silent page holds the robot, a STOP ends every wait."""

from __future__ import annotations

import threading
import time
from typing import Any

import pytest

from behaviors.safety_conditions import OPERATOR_SILENT
from drivers.clock import SystemClock
from drivers.ports import Interrupted, Ports, Reaction, SafetyVerdict
from openbelief.perception.ports import FrameUnseen
from openbelief.pose import Pose2
from robot_app.mission.attended import AlertClock, AlertPerception, PresenceSafety, attended
from robot_app.mission.operator import SharedOperator
from robot_app.mission.sentences import Sentence

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


class SlowPerception:
    """Answers when it is let go, as a model server that does not answer."""

    id, feature_text_aligned = "slow", True

    def __init__(self) -> None:
        self.go, self.looking, self.at_once, self.most = threading.Event(), threading.Event(), 0, 0

    def perceive(self, frame):
        self.at_once += 1
        self.most = max(self.most, self.at_once)
        self.looking.set()
        assert self.go.wait(LONG_S)
        self.at_once -= 1
        if frame is None:
            raise FrameUnseen("no phrases")
        return [frame]


def test_a_stop_is_heard_while_perception_waits_for_a_model():
    operator, slow = SharedOperator(), SlowPerception()
    nobody: Any = None
    perception = attended(Ports(SystemClock(), *[nobody] * 5, perception=slow), operator).perception
    raised = []

    def look() -> None:
        with pytest.raises(Interrupted) as caught:
            perception.perceive("frame")
        raised.append(caught.value)

    looking = threading.Thread(target=look)
    looking.start()
    assert slow.looking.wait(LONG_S)
    operator.stop(because="STOP")
    looking.join(LONG_S)
    assert raised and not slow.go.is_set()


def test_the_look_after_a_stop_waits_for_the_one_before_it_and_has_its_own_answer():
    operator, slow = SharedOperator(), SlowPerception()
    perception = AlertPerception(slow, operator)
    operator.stop(because="STOP")
    with pytest.raises(Interrupted):
        perception.perceive("first")
    operator.begin(asked(operator))
    slow.go.set()
    assert perception.perceive("second") == ["second"]
    assert slow.most == 1


def test_what_perception_raises_is_raised():
    slow = SlowPerception()
    slow.go.set()
    with pytest.raises(FrameUnseen, match="no phrases"):
        AlertPerception(slow, SharedOperator()).perceive(None)


def asked(operator: SharedOperator) -> Sentence:
    operator.join("terminal")
    operator.ask(operator.take("ada", "terminal"), "the lamp")
    sentence = operator.next_sentence()
    assert sentence is not None
    return sentence
