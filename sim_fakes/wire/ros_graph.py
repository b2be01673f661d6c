"""A whole simulated robot at the far end of a Zenoh router: bridge, Nav2 and topics, ready to be connected to."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType

from drivers.clock import SimClock
from drivers.ros.bridge_keys import Keys
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.faults import Nav2Faults, SensorFaults
from sim_fakes.wire.fence import Fence
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.ros_publisher import Eyes, SimRosPublisher
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.robot import SimRobot


class RosGraph:
    """Opens a router on an ephemeral port of this machine and the robot's session behind it.

    with RosGraph(clock, robot, grid, eyes) as graph, ZenohLink(graph.link_config) as link:
        ... make the ports on `link` and start them ...
        graph.start(link, ready=lambda: navigator.unavailable() is None)
    """

    def __init__(
        self,
        clock: SimClock,
        robot: SimRobot,
        grid: OccupancyGrid,
        eyes: Eyes | None = None,
        *,
        keys: Keys | None = None,
        camera_rate_hz: float | None = 1.0,
        nav2_faults: Nav2Faults | None = None,
        sensor_faults: SensorFaults | None = None,
        distribution: str = "jazzy",
    ) -> None:
        self._clock, self._robot, self._grid, self._eyes = clock, robot, grid, eyes
        self._keys, self._camera_rate_hz, self._distribution = keys, camera_rate_hz, distribution
        self.nav2_faults, self.sensor_faults = nav2_faults or Nav2Faults(), sensor_faults or SensorFaults()
        self._open = ExitStack()

    def __enter__(self) -> RosGraph:
        self.link_config = LinkConfig((self._open.enter_context(open_router()),))
        self.bridge = self._open.enter_context(SimBridge(self.link_config.endpoints[0], self._keys))
        self.nav2 = SimNav2Server(
            self.bridge, self._clock, self._robot, self._grid, self.nav2_faults, distribution=self._distribution
        )
        self.topics = SimRosPublisher(
            self.bridge,
            self._clock,
            self._robot,
            self._grid,
            self._eyes,
            self.sensor_faults,
            camera_rate_hz=self._camera_rate_hz,
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._open.close()

    def start(self, link: ZenohLink, ready: Callable[[], bool] = lambda: True, timeout_s: float = 2.0) -> None:
        """Begin to publish and to serve, fenced to the driver's link; returns once `ready` (simulated time passes)."""
        Fence(self.bridge, link).wait()  # or the first samples would come before the driver's subscriptions are known
        self.nav2.start()
        self.topics.start()
        for _ in range(round(timeout_s / 0.05)):
            self._clock.sleep(0.05)
            if ready():
                return
        raise RuntimeError(f"The simulated robot is not ready after {timeout_s} s.")
