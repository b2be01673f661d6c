"""A bridge with Nav2 behind it in a process of its own, in wall time: for tests and benches with real processes.

`python -m sim_fakes.wire.nav2_process` opens a router on an ephemeral port of this machine and prints one JSON line per
event: its endpoint, and each cancel with its moment on the monotonic clock (which processes share).
Goals never end by themselves. It ends when its standard input does.
"""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from drivers.clock import SimClock
from drivers.ros import action
from drivers.ros.messages import codec, stamp_to_ns
from drivers.ros.zenoh_link import open_router
from drivers.topics import NAVIGATE_TO_POSE
from openbelief.pose import Pose2
from openbelief.traversability import FREE, OccupancyGrid
from sim_fakes.wire.faults import Nav2Faults
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.sim_bridge import Question, SimBridge
from sim_fakes.world.robot import SimRobot

TICK_S = 0.05


class Floor:
    """6 m x 6 m of nothing."""

    def occupancy_grid(self) -> OccupancyGrid:
        return OccupancyGrid(np.full((120, 120), FREE, np.int8), 0.05, (0.0, 0.0))


class TellingBridge(SimBridge):
    """Prints each cancel before it is served."""

    def answer(self, key: str, handler: Callable[[Question], None]) -> None:
        tells = key == self.keys.action(NAVIGATE_TO_POSE, "cancel_goal")

        def told(question: Question) -> None:
            if tells:
                say(_cancel(question))
            handler(question)

        super().answer(key, told)


def _cancel(question: Question) -> dict[str, object]:
    now_ns = time.monotonic_ns()
    info = codec().decode(question.payload, f"{action.CANCEL}_Request").goal_info
    every = bytes(info.goal_id.uuid) == action.ALL_GOALS and stamp_to_ns(info.stamp) == 0
    return {"cancel_ns": now_ns, "all": every}


def say(event: dict[str, object]) -> None:
    print(json.dumps(event), flush=True)


def _await_end(ended: threading.Event) -> None:
    sys.stdin.read()
    ended.set()


def main() -> None:
    ended = threading.Event()
    threading.Thread(target=_await_end, args=(ended,), daemon=True).start()
    clock, floor = SimClock(time.time_ns()), Floor()
    robot = SimRobot(floor, clock, Pose2(3.0, 3.0, 0.0))
    with open_router() as endpoint, TellingBridge(endpoint) as bridge:
        SimNav2Server(bridge, clock, robot, floor.occupancy_grid(), Nav2Faults(stuck=True)).start()
        say({"endpoint": endpoint})
        while not ended.wait(TICK_S):
            clock.sleep(TICK_S)


if __name__ == "__main__":
    main()
