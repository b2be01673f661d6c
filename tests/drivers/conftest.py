"""A small room with a simulated robot at the far end of real Zenoh sessions, for the tests of the wires."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.sparse.csgraph  # noqa: F401  the simulated planner's first path would load it while a question waits

from drivers.clock import SimClock
from drivers.nav2.bridge import Nav2Bridge
from drivers.nav2.limits import Nav2Limits
from drivers.ports import LidarCloud, NavigationResult
from drivers.ros.bridge_keys import Keys
from drivers.ros.topics import RosCamera, RosLidar, RosMap, RosPoseSource
from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.ros_graph import RosGraph
from sim_fakes.wire.silent_wire import SilentWire
from sim_fakes.world.robot import SimRobot

START_NS = 1_700_000_000_000_000_000
LIMITS = Nav2Limits(plan_s=1.0, result_wait_s=0.5, result_ask_s=1.0, cancel_s=1.0)  # a loaded machine may stall


class Room:
    """6 m x 4 m, walls around, and a closed chamber in the upper right corner that nothing can enter."""

    def occupancy_grid(self) -> OccupancyGrid:
        cells = np.zeros((80, 120), np.int8)
        cells[:2], cells[-2:], cells[:, :2], cells[:, -2:] = 100, 100, 100, 100
        cells[50:52, 90:], cells[50:, 90:92] = 100, 100
        return OccupancyGrid(cells, 0.05, (0.0, 0.0))


class PlainEyes:
    """Images and clouds that tell the stamp: no renderer needed."""

    def image(self, T_map_camera: Any, stamp_ns: int) -> tuple[Any, Any]:
        shade = stamp_ns // 1_000_000 % 200
        return np.full((480, 640, 3), shade, np.uint8), np.full((480, 640), 2.0, np.float32)

    def cloud(self, T_map_lidar: Any, stamp_ns: int) -> LidarCloud:
        return LidarCloud(stamp_ns, np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], np.float32), "livox_frame")


@dataclass
class Rig:
    room: Room
    clock: SimClock
    robot: SimRobot
    graph: RosGraph
    link: ZenohLink
    camera: RosCamera
    lidar: RosLidar
    poses: RosPoseSource
    map: RosMap
    nav: Nav2Bridge

    def start(self) -> None:
        self.graph.start(self.link, ready=lambda: self.nav.unavailable() is None)

    def until_end(self, within_s: float = 60.0) -> NavigationResult:
        """Poll as a mission does; the end must come within that much simulated time."""
        deadline_ns = self.clock.now_ns() + round(within_s * 1e9)
        while (result := self.nav.result()) is None:
            assert self.clock.now_ns() < deadline_ns, "no result"
            self.clock.sleep(0.1)
        return result


@pytest.fixture
def make_rig() -> Iterator[Callable[..., Rig]]:
    """A factory of rigs: ports started, the robot's end not yet (`rig.start()`).

    distribution: the robot's. expected: what the driver is told of it.
    """
    with ExitStack() as opened:

        def make(
            *,
            keys: Keys | None = None,
            distribution: str = "jazzy",
            expected: str = "auto",
            limits: Nav2Limits = LIMITS,
            through: Callable[[str], str] = lambda endpoint: endpoint,
            seed: int = 7,
            stop: Callable[[], str | None] = lambda: None,
            **graph_options: Any,
        ) -> Rig:
            clock, room = SimClock(START_NS), Room()
            robot = SimRobot(room, clock, Pose2(1.0, 1.0, 0.0))
            graph = opened.enter_context(
                RosGraph(
                    clock,
                    robot,
                    room.occupancy_grid(),
                    PlainEyes(),
                    keys=keys,
                    distribution=distribution,
                    **graph_options,
                )
            )
            endpoint = through(graph.link_config.endpoints[0])
            link = opened.enter_context(ZenohLink(LinkConfig((endpoint,), lease_s=1.0)))
            ports = RosCamera(link, clock, keys), RosLidar(link, clock, keys), RosPoseSource(link, clock, keys)
            grid, uuids = RosMap(link, keys), np.random.default_rng(seed)
            nav = Nav2Bridge(
                link,
                clock,
                ports[2],
                grid,
                new_uuid=lambda: uuids.bytes(16),
                keys=keys,
                distribution=expected,
                limits=limits,
                stop=stop,
            )
            for port in (*ports, grid, nav):
                port.start()
            return Rig(room, clock, robot, graph, link, *ports, grid, nav)

        yield make


@pytest.fixture
def rig(make_rig: Callable[..., Rig]) -> Rig:
    """A robot in a room, Nav2 up."""
    made = make_rig()
    made.start()
    return made


@pytest.fixture
def silent_wire() -> Iterator[Callable[[str], SilentWire]]:
    with ExitStack() as opened:
        yield lambda endpoint: opened.enter_context(SilentWire(endpoint))
