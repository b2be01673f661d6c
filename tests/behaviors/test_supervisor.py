"""The supervisor as a table: what is known -> the reaction, the condition, and words of the operator's sentence."""

from __future__ import annotations

from dataclasses import replace

import pytest

from behaviors.safety_conditions import CONDITIONS, GRAVITY
from behaviors.safety_facts import SafetyFacts, Sample
from behaviors.safety_policy import SafetyPolicy
from behaviors.supervisor import Supervisor
from drivers.ports import Reaction
from openbelief.pose import Pose2

S = 1_000_000_000
SQUARE = ((2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (2.0, 4.0))
POLICY = SafetyPolicy(keep_out=(SQUARE,), allowed=((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)))
FINE = SafetyFacts(
    expected=frozenset({"camera", "cloud", "battery"}),
    pose=Pose2(1.0, 1.0, 0.0),
    camera=Sample(1, 1),
    cloud=Sample(1, 1),
    battery=0.8,
    disk_free_bytes=50_000_000_000,
)
GOAL = Pose2(1.0, 6.0, 0.0)

# what differs from FINE -> (reaction, condition, words)
ROWS = {
    "nothing": ({}, Reaction.GO, "", ""),
    "watchdog latched": ({"watchdog": "latched: x"}, Reaction.CANCEL, "watchdog", "latched"),
    "link down": ({"link": "The link is down."}, Reaction.CANCEL, "link", "link is down"),
    "another site's memory": ({"memory": "They do not match."}, Reaction.CANCEL, "memory and map", "match"),
    "no pose": ({"pose": None}, Reaction.HOLD, "pose", "does not know where it is"),
    "no camera yet": ({"camera": None}, Reaction.NO_NEW_MOTION, "camera", "no camera image yet"),
    "no cloud yet": ({"cloud": None}, Reaction.HOLD, "cloud", "no lidar cloud yet"),
    "no battery state": ({"battery": None}, Reaction.NO_NEW_MOTION, "battery unknown", "not known"),
    "battery below the start": ({"battery": 0.39}, Reaction.NO_NEW_MOTION, "battery low", "39%"),
    "battery below the start, under way": ({"battery": 0.39, "goal": GOAL}, Reaction.GO, "", ""),
    "battery below the return": ({"battery": 0.24, "goal": GOAL}, Reaction.CANCEL, "battery empty", "bring the robot"),
    "disk full": ({"disk_free_bytes": 10**9}, Reaction.NO_NEW_MOTION, "disk", "1.0 GB"),
    "goal in keep-out": ({"goal": Pose2(3.0, 3.0, 0.0)}, Reaction.NO_NEW_MOTION, "goal zone", "keep-out area 1"),
    "goal outside": ({"goal": Pose2(11.0, 3.0, 0.0)}, Reaction.NO_NEW_MOTION, "goal zone", "outside the allowed"),
    "robot in keep-out": ({"pose": Pose2(3.0, 3.0, 0.0)}, Reaction.CANCEL, "robot zone", "keep-out area 1"),
    "robot outside": ({"pose": Pose2(-0.1, 3.0, 0.0)}, Reaction.CANCEL, "robot zone", "outside the allowed"),
    "what is not there is not expected": (
        {"expected": frozenset(), "camera": None, "cloud": None, "battery": None},
        Reaction.GO,
        "",
        "",
    ),
}


@pytest.mark.parametrize("name", ROWS)
def test_each_condition_has_its_reaction_and_sentence(name):
    changes, reaction, condition, words = ROWS[name]
    verdict = Supervisor(POLICY).update(0, replace(FINE, **changes))
    assert (verdict.reaction, verdict.condition) == (reaction, condition)
    assert words in verdict.sentence


def test_of_several_conditions_the_gravest_speaks():
    facts = replace(FINE, camera=None, cloud=None, link="The link is down.")
    assert Supervisor(POLICY).update(0, facts).condition == "link"
    assert Supervisor(POLICY).update(0, replace(facts, link=None)).condition == "cloud"
    assert {reaction for reaction, _ in CONDITIONS.values()} == set(GRAVITY) - {Reaction.GO}


# seconds, stamp, digest of the cloud at each poll; whether the last poll is a HOLD, and what it says
STREAMS = {
    "new each time": ([(0.0, 1, 1), (0.5, 2, 2), (1.4, 3, 3)], None),
    "missing": ([(0.0, 1, 1), (0.9, None, 0), (1.1, None, 0)], "No new lidar cloud for 1.1 s"),
    "frozen stamp": ([(0.0, 1, 1), (0.9, 1, 2), (1.1, 1, 3)], "No new lidar cloud for 1.1 s"),
    "same points, new stamps": ([(i / 2, i, 7) for i in range(8)], "content has been the same"),
    "back again": ([(0.0, 1, 1), (1.5, 1, 1), (1.6, 2, 2)], None),
    "the robot's clock jumps ahead an hour": ([(0.0, 1, 1), (0.5, 3600 * S, 2), (1.0, 3601 * S, 3)], None),
    "the robot's clock jumps back an hour": ([(0.0, 3600 * S, 1), (0.5, 1, 2), (1.0, 2, 3)], None),
    "frozen across the jump": ([(0.0, 1, 1), (0.5, 3600 * S, 2), (1.6, 3600 * S, 2)], "No new lidar cloud"),
}


@pytest.mark.parametrize("name", STREAMS)
def test_missing_and_stuck_data_hold_the_robot_whatever_the_stamps_say(name):
    polls, words = STREAMS[name]
    supervisor = Supervisor(POLICY)
    for seconds, stamp_ns, digest in polls:
        cloud = None if stamp_ns is None else Sample(stamp_ns, digest)
        camera = Sample(round(seconds * S) + 1, round(seconds * 1000))
        verdict = supervisor.update(round(seconds * S), replace(FINE, cloud=cloud, camera=camera))
    assert (verdict.reaction is Reaction.HOLD) == (words is not None), verdict
    assert (words or "") in verdict.sentence


# seconds between the poses, metres and radians from each to the next, on the way to -> jumped?
MOVES = {
    "walking": ([0.05] * 40, 0.05, 0.05, GOAL, False),
    "standing": ([0.05] * 40, 0.0, 0.0, GOAL, False),
    "jump": ([0.05], 1.0, 0.0, GOAL, True),
    "turned over": ([0.05], 0.0, 2.0, GOAL, True),
    "many small jumps": ([0.05] * 20, 0.3, 0.0, GOAL, True),
    "found again elsewhere after eight seconds": ([8.0], 3.0, 0.0, GOAL, True),
    "found again where it stood": ([8.0], 0.3, 0.2, GOAL, False),
    "carried for a minute between missions": ([60.0], 20.0, 3.0, None, False),
}


@pytest.mark.parametrize("name", MOVES)
def test_a_pose_that_no_robot_can_have_reached_ends_the_mission(name):
    seconds, metres, radians, goal, jumped = MOVES[name]
    supervisor, now_ns = Supervisor(SafetyPolicy()), 0
    facts = replace(FINE, expected=frozenset(), goal=goal)
    verdicts = [supervisor.update(0, facts)]
    for step, after_s in enumerate(seconds, start=1):
        now_ns += round(after_s * S)
        moved = replace(facts, pose=Pose2(1.0 + step * metres, 1.0, step * radians))
        verdicts.append(supervisor.update(now_ns, moved))
    assert any(v.condition == "localisation jump" and v.reaction is Reaction.CANCEL for v in verdicts) == jumped


@pytest.mark.parametrize(
    "limits",
    [
        {"jump_m": -1.0},
        {"battery_start": float("nan")},
        {"battery_return": 25.0},
        {"keep_out": (((0.0, 0.0), (1.0, 1.0)),)},
        {"allowed": ((0.0, 0.0),)},
        {"battery_start": 0.2, "battery_return": 0.3},
        {"disk_min_bytes": -5},
    ],
)
def test_limits_that_make_no_sense_are_refused(limits):
    with pytest.raises(ValueError, match=r"must be|must not be|share of 1|needs 3 or more"):
        SafetyPolicy(**limits)
