"""The simulated robot in wall time: its clock keeps step, and its remote is obeyed."""

from __future__ import annotations

import json

import pytest

from drivers.clock import SimClock
from openbelief.pose import Pose2
from sim_fakes.wire.robot_process import RealTimePacer, Remote
from sim_fakes.world.robot import SimRobot

SECOND_NS = 10**9


class Room:
    """The ground and the mapping walk of an empty floor."""

    walk = (Pose2(3.0, 3.0, 0.0), Pose2(3.5, 3.0, 1.0))

    def occupancy_grid(self):
        from sim_fakes.wire.nav2_process import EmptyFloor

        return EmptyFloor().occupancy_grid()


@pytest.fixture
def clock() -> SimClock:
    return SimClock(100 * SECOND_NS)


@pytest.fixture
def robot(clock) -> SimRobot:
    return SimRobot(Room(), clock, Pose2(3.0, 3.0, 0.0))


def test_simulated_time_keeps_step_with_the_wall_and_catches_up_after_a_pause(clock):
    wall, ticks = SimClock(100 * SECOND_NS), []
    clock.every(0.1, lambda: ticks.append(clock.now_ns()))
    keeper = RealTimePacer(clock, wall)
    for pause_s in (0.01, 0.25, 3.0):
        wall.sleep(pause_s)
        keeper.step()
        assert clock.now_ns() == wall.now_ns()
    assert len(ticks) == 32


def test_a_wall_clock_that_is_set_back_is_waited_for(clock):
    keeper = RealTimePacer(clock, SimClock(90 * SECOND_NS))
    keeper.step()
    assert clock.now_ns() == 100 * SECOND_NS


def test_walk_walks_the_scene_and_tells_its_end(clock, robot, capsys):
    remote = Remote(robot, clock, Room())
    remote.obey("walk")
    for _ in range(100):
        assert remote.step()
        clock.sleep(0.1)
    assert robot.pose.distance_to(Room.walk[-1]) < 0.1
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [{"walk": "begun"}, {"walk": "ended"}]


@pytest.mark.parametrize("word", ["halt", "", "wlak", "stop!"])
def test_anything_but_walk_halts_the_robot(clock, robot, word):
    remote = Remote(robot, clock, Room())
    remote.obey("walk")
    remote.step()
    clock.sleep(0.2)
    remote.step()
    clock.sleep(0.2)
    assert robot.moving
    remote.obey(word)
    here = robot.pose
    for _ in range(10):
        remote.step()
        clock.sleep(0.1)
    assert robot.pose == here and not robot.moving


def test_an_obstacle_on_the_walk_stops_the_robot_and_nothing_else(clock, robot, capsys):
    class Blocked(Room):
        walk = (Pose2(-3.0, 3.0, 0.0),)  # beyond the floor's edge

    remote = Remote(robot, clock, Blocked())
    remote.obey("walk")
    for _ in range(200):
        assert remote.step()
        clock.sleep(0.1)
    assert not robot.moving
    last = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert last["walk"] == "blocked" and "obstacle" in last["because"]
    remote.obey("halt")
    assert remote.step()
