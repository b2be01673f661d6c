"""The frame that is judged is of the place where the robot was seen to stand."""

from __future__ import annotations

import pytest

from behaviors.events import End
from logs.trial import records


def test_a_camera_that_went_stale_at_arrival_is_a_fault_with_its_sentence(stage, extinguisher):
    s = stage([extinguisher])
    s.camera_works = lambda: s.sent == []
    outcome = s.run()
    assert outcome.end is End.FAULT and "9.0 s old" in outcome.reason
    assert s.perceived == 0


def test_a_camera_that_is_late_is_waited_for(stage, extinguisher):
    s = stage([extinguisher])
    ready_ns = s.clock.now_ns() + 800_000_000
    s.camera_works = lambda: s.clock.now_ns() >= ready_ns
    assert s.run().end is End.CONFIRMED


def test_the_frame_that_is_judged_is_the_first_after_the_robot_was_seen_to_stand(stage, extinguisher):
    s = stage([extinguisher])
    s.run()
    _, arrival = s.of(records.Frame)  # one to measure the mount, one at arrival
    looks = s.of(records.PoseLook)
    assert 0.5e9 <= looks[-1].stamp_ns - looks[0].stamp_ns < 0.6e9
    assert looks[-1].stamp_ns <= arrival.stamp_ns < looks[-1].stamp_ns + 0.05e9


@pytest.mark.parametrize("hz", [5, 15, 30])
def test_no_frame_of_before_the_stand_is_judged_and_none_is_waited_for_longer_than_it_takes(stage, extinguisher, hz):
    s = stage([extinguisher])
    s.camera_period_ns = 1_000_000_000 // hz
    judged_ns = []
    s.on_perceive = lambda: judged_ns.append(s.clock.now_ns())
    assert s.run().end is End.CONFIRMED
    stood_ns = s.of(records.PoseLook)[-1].stamp_ns
    first_ns = -(-stood_ns // s.camera_period_ns) * s.camera_period_ns
    assert s.of(records.Frame)[-1].stamp_ns == first_ns
    assert judged_ns[0] - first_ns <= 0.02e9  # one look more
