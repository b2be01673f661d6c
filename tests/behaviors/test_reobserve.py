"""What could not be seen, or perception could not look at, is looked at once more, within bounds."""

from __future__ import annotations

import dataclasses

import numpy as np

from behaviors.events import End
from drivers.ports import Interrupted, NavigationResult, NavigationStatus
from logs.trial import records
from openbelief.perception.ports import FrameUnseen, PerceptionFailed
from openbelief.pose import Pose2

ABORTED = NavigationResult(NavigationStatus.ABORTED, "no valid path", 208)


def test_a_robot_that_faces_away_turns_and_then_confirms(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(turned=np.pi)]
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert s.path.count("re_observe") == 1
    assert s.sent[1].distance_to(s.sent[0]) < 1e-6  # in place


def test_what_stays_hidden_after_one_turn_and_one_move_is_rejected(stage, extinguisher, make):
    hood = make.box(5.0, 2.0, None, None, size=0.6, in_map=False)
    s = stage([extinguisher, hood])
    outcome = s.run()
    assert (outcome.end, outcome.rejected, outcome.visits) == (End.FAILED, (0,), 1)
    assert {c.verdict for c in s.of(records.Checks)} == {"insufficient visibility"}
    looks = [g for g in s.of(records.Goal) if g.purpose == "re-observe"]
    assert 1 <= len(looks) <= 2 and s.perceived == 1 + len(looks)


def test_a_re_observation_that_cannot_be_driven_sets_the_candidate_aside(stage, extinguisher, make):
    s = stage([extinguisher])
    s.drives = [make.drive(turned=np.pi), make.drive(end=ABORTED)]
    outcome = s.run()
    assert (outcome.end, outcome.set_aside, outcome.visits) == (End.NAVIGATION_FAILED, (0,), 0)


def failing(times, error):
    """Raises the error at the first so many frames."""
    left = iter(range(times))

    def perceive() -> None:
        if next(left, None) is not None:
            raise error

    return perceive


def test_what_one_frame_did_not_show_is_looked_at_again_without_a_step(stage, extinguisher):
    s = stage([extinguisher])
    s.on_perceive = failing(1, FrameUnseen("no phrases: the reply is no list"))
    outcome = s.run()
    assert (outcome.end, outcome.visits) == (End.CONFIRMED, 1)
    assert s.path == ["retrieve", "await_approval", "navigate", "verify", "re_observe", "verify", "confirmed"]
    assert len(s.sent) == 1
    assert any("again: no phrases: the reply is no list" in sentence for sentence in s.told)
    first, second = s.of(records.Frame)[-2:]
    assert second.stamp_ns > first.stamp_ns


def test_what_no_frame_shows_to_perception_is_set_aside_and_the_next_one_is_tried(stage, impostor, make):
    s = stage([impostor, make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])

    def perceive() -> None:
        if s.robot.distance_to(Pose2(2.5, 5.0, 0.0)) < 2.0:
            raise FrameUnseen("no phrases: the reply is no list")

    s.on_perceive = perceive
    outcome = s.run()
    assert (outcome.end, outcome.object_id) == (End.CONFIRMED, 1)
    assert (outcome.rejected, outcome.set_aside, outcome.visits) == ((), (0,), 1)
    assert 2 <= s.path.count("re_observe") <= 3


def test_a_look_in_vain_and_too_little_in_view_end_all_the_same(stage, extinguisher, make):
    hood = make.box(5.0, 2.0, None, None, size=0.6, in_map=False)
    s = stage([extinguisher, hood])
    s.on_perceive = failing(1, FrameUnseen("no phrases"))
    outcome = s.run()
    assert (outcome.end, outcome.rejected) == (End.FAILED, (0,))


def test_a_perception_that_cannot_go_on_is_a_fault_in_its_own_words(stage, extinguisher):
    class ServerGone(PerceptionFailed):
        pass

    s = stage([extinguisher])
    s.on_perceive = failing(1, ServerGone("The model server does not answer: start it."))
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.FAULT, "The model server does not answer: start it.")


def test_a_stop_that_perception_did_not_wait_for_cancels_and_replays(stage, extinguisher):
    s = stage([extinguisher])
    heard = []

    def perceive() -> None:
        heard.append(True)
        raise Interrupted("STOP came while perception looked at the frame.")

    s.on_perceive, s.stop_when = perceive, lambda: bool(heard)
    outcome = s.run()
    assert (outcome.end, outcome.reason) == (End.CANCELLED, "STOP pressed")
    assert s.of(records.Transition)[-1].source == "verify"
    assert s.cancelled


def test_a_trial_of_before_ends_at_a_frame_that_was_not_seen(stage, extinguisher):
    s = stage([extinguisher])
    s.policy = dataclasses.replace(s.policy, unlooked="fault")
    s.on_perceive = failing(1, FrameUnseen("no phrases"))
    assert s.run().reason == "unexpected FrameUnseen: no phrases"
