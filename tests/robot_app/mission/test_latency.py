from __future__ import annotations

import io
import json
from types import SimpleNamespace

import numpy as np
import pytest

from logs.structured import configure
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.perception.ports import Perception, PerceptionFailed
from openbelief.perception.stages import Stage
from robot_app.mission.latency import WatchedPerception
from support.clocks import HandClock

FRAME = RgbdFrame(0, 77, np.zeros((3, 4, 3), np.uint8), np.zeros((3, 4)), Intrinsics(4, 3, 1, 1, 1, 1), np.eye(4))
MASK = Mask(0, np.ones((3, 4), bool), "cup", 0.5, np.eye(2, dtype=np.float32)[0])


@pytest.fixture
def log() -> io.StringIO:
    stream = io.StringIO()
    configure(HandClock(), stream, json_lines=True)
    return stream


def watched(clock: HandClock, fails: bool = False, budget_s: float = 2.5) -> WatchedPerception:
    def step(seconds: float, value: object) -> object:
        clock.sleep(seconds)
        if fails and value is not None:
            raise PerceptionFailed("gone")
        return value

    stages = (Stage("phrases", lambda *_: step(2.0, None)), Stage("segments", lambda *_: step(0.25, [MASK])))
    perception = SimpleNamespace(id="steps", feature_text_aligned=True, stages=stages, perceive=None, close=None)
    return WatchedPerception(perception, clock, budget_s=budget_s)


def test_every_look_is_logged_stage_by_stage(log):
    perception = watched(HandClock())
    assert isinstance(perception, Perception) and perception.perceive(FRAME) == [MASK]
    line = json.loads(log.getvalue())
    assert (line["event"], line["level"], line["frame_stamp_ns"]) == ("perception_took", "info", 77)
    assert line["seconds"] == {"phrases": 2.0, "segments": 0.25} and line["slowest"] == "phrases"
    assert (line["total_s"], line["budget_s"]) == (2.25, 2.5)


def test_a_look_over_the_budget_is_a_warning(log):
    watched(HandClock(), budget_s=2.0).perceive(FRAME)
    assert json.loads(log.getvalue())["level"] == "warning"


def test_a_look_that_fails_says_how_far_it_came(log):
    with pytest.raises(PerceptionFailed):
        watched(HandClock(), fails=True).perceive(FRAME)
    assert json.loads(log.getvalue())["seconds"] == {"phrases": 2.0, "segments": 0.25}
