"""Hardware-in-the-loop: some bodies from a recording, others simulated, in one mission."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.events import End
from behaviors.mission import Mission
from drivers.clock import SimClock
from drivers.ports import StaleData
from logs.trial.compare import compare_decisions
from openbelief.pose import Pose2
from sim_fakes.playback.ports import RecordingPorts

SENTENCE = "take me to the fire extinguisher"


@pytest.fixture
def bench(stage, make, write_recording, tmp_path):
    """A stage with a simulated navigator, and a recording of a robot that looks at the extinguisher."""
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])
    s.robot = Pose2(4.0, 2.0, 0.0)
    s.recording = RecordingPorts(write_recording(tmp_path / "walk.mcap", s, 6.0))
    s.robot = Pose2(1.0, 1.0, 0.0)
    s.clock = SimClock(s.recording.start_ns)
    return s


def run(s, **bodies):
    ports = replace(s.ports, **bodies)
    outcome = Mission(ports, s.memory, s.parameters, s.policy, s.journal).run(SENTENCE)
    assert compare_decisions(s.journal.decisions, s.replayed(SENTENCE)) is None
    return outcome


def test_a_recorded_camera_and_poses_with_a_simulated_navigator_confirm(bench):
    s, played = bench, bench.recording
    outcome = run(s, camera=played.camera(s.clock), poses=played.pose(s.clock), map=played.map(s.clock))
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)


def test_a_recorded_camera_alone_works_with_the_simulated_robots_poses(bench):
    outcome = run(bench, camera=bench.recording.camera(bench.clock))
    assert outcome.end in (End.CONFIRMED, End.FAILED) and outcome.visits == 1


def test_a_recording_that_ends_grows_stale_and_faults_the_mission(bench):
    s = bench
    camera = s.recording.camera(s.clock)
    assert camera.latest(0.5).stamp_ns == s.clock.now_ns()
    s.clock.sleep(10.0)
    with pytest.raises(StaleData, match="recording's newest is"):
        camera.latest(0.5)
    assert run(s, camera=camera).end is End.FAULT


def test_a_recording_begins_when_its_first_body_is_made(bench):
    bench.clock.sleep(100.0)
    frame = bench.recording.camera(bench.clock).latest(0.5)
    assert frame.stamp_ns == bench.clock.now_ns()
    T = bench.recording.pose(bench.clock).transform_at(frame.stamp_ns, "base_link")
    assert T[0, 3] == pytest.approx(4.0)
