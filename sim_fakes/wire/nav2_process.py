"""A robot of few parts in a process of its own, in wall time: for tests and benches with real processes.

`python -m sim_fakes.wire.nav2_process` opens a router on an ephemeral port of this machine, with Nav2 behind a bridge
on an empty floor, and prints one JSON line per event: its endpoint, and each goal and cancel with its moment on the
monotonic clock (which processes share). Goals never end by themselves. With --whole the robot also has a body that
drives, /tf, /map, camera and lidar. It ends when its standard input does.

A line on standard input makes trouble: "claim succeeded" or "claim aborted" says so of the goal under way while the
robot drives on; "where" prints how the robot is moving; "home" carries it back to where it stood at first.
"""

from __future__ import annotations

import argparse
import json
import queue
import sys
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from drivers.clock import SimClock
from drivers.ros import action
from drivers.ros.messages import codec, stamp_to_ns
from drivers.ros.zenoh_link import open_router
from drivers.topics import NAVIGATE_TO_POSE
from openbelief.pose import Pose2
from openbelief.traversability import FREE, OccupancyGrid
from sim_fakes.sensors.plain_eyes import PlainEyes
from sim_fakes.wire.faults import Nav2Faults
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.ros_publisher import SimRosPublisher
from sim_fakes.wire.sim_bridge import PendingQuery, SimBridge
from sim_fakes.world.robot import SimRobot

TICK_S = 0.02
SIDE_M, CELL_M = 12.0, 0.05
START = Pose2(3.0, 3.0, 0.0)
CLAIMS = {"succeeded": action.SUCCEEDED, "aborted": action.ABORTED}


class EmptyFloor:
    """12 m x 12 m of nothing."""

    def occupancy_grid(self) -> OccupancyGrid:
        cells = round(SIDE_M / CELL_M)
        return OccupancyGrid(np.full((cells, cells), FREE, np.int8), CELL_M, (0.0, 0.0))


class TellingBridge(SimBridge):
    """Prints each goal and each cancel before it is served."""

    def answer(self, key: str, handler: Callable[[PendingQuery], None]) -> None:
        tell = {
            self.keys.action(NAVIGATE_TO_POSE, "cancel_goal"): _cancel,
            self.keys.action(NAVIGATE_TO_POSE, "send_goal"): _goal,
        }.get(key)

        def told(question: PendingQuery) -> None:
            if tell:
                say(tell(question))
            handler(question)

        super().answer(key, told)


def _goal(_question: PendingQuery) -> dict[str, object]:
    return {"goal_ns": time.monotonic_ns()}


def _cancel(question: PendingQuery) -> dict[str, object]:
    now_ns = time.monotonic_ns()
    info = codec().decode(question.payload, f"{action.CANCEL}_Request").goal_info
    every = bytes(info.goal_id.uuid) == action.ALL_GOALS and stamp_to_ns(info.stamp) == 0
    return {"cancel_ns": now_ns, "all": every}


def say(event: dict[str, object]) -> None:
    print(json.dumps(event), flush=True)


def _read(lines: queue.SimpleQueue[str | None]) -> None:
    for line in sys.stdin:
        lines.put(line.strip())
    lines.put(None)


def _obey(line: str, nav2: SimNav2Server, robot: SimRobot) -> None:
    word, _, more = line.partition(" ")
    if word == "claim":
        nav2.claim(CLAIMS[more])
        say({"claimed_ns": time.monotonic_ns()})
    elif word == "where":
        pose = robot.pose
        say({"x": pose.x, "y": pose.y, "moving": robot.moving})
    elif word == "home":
        robot.place(START)
        say({"home_ns": time.monotonic_ns()})


def _options(arguments: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="nav2_process")
    parser.add_argument("--whole", action="store_true")
    parser.add_argument("--listen", help="like tcp/127.0.0.1:7447 (default: any free port)")
    return parser.parse_args(arguments)


def main(arguments: Sequence[str]) -> None:
    options = _options(arguments)
    whole = options.whole
    lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(lines,), daemon=True).start()
    clock, floor = SimClock(time.time_ns()), EmptyFloor()
    offset_ns = clock.now_ns() - time.monotonic_ns()
    robot, grid = SimRobot(floor, clock, START), floor.occupancy_grid()
    with open_router(options.listen) as endpoint, TellingBridge(endpoint) as bridge:
        nav2 = SimNav2Server(bridge, clock, robot, grid, Nav2Faults(stuck=not whole))
        nav2.start()
        if whole:
            SimRosPublisher(bridge, clock, robot, grid, PlainEyes(), camera_rate_hz=5.0, lidar_rate_hz=5.0).start()
        say({"endpoint": endpoint})
        while True:
            try:
                line = lines.get(timeout=TICK_S)
            except queue.Empty:
                clock.sleep((time.monotonic_ns() + offset_ns - clock.now_ns()) / 1e9)
                continue
            if line is None:
                return
            _obey(line, nav2, robot)


if __name__ == "__main__":
    main(sys.argv[1:])
