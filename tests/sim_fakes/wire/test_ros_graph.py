"""The robot's end of the wire: fenced, so that a run repeats, and quick."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from drivers.clock import SimClock
from drivers.ports import LidarCloud
from drivers.ros.convert import transforms_of
from drivers.ros.messages import decode
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.topics import TF
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.fence import Fence
from sim_fakes.wire.ros_graph import RosGraph
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.robot import LocalisationError, SimRobot

START_NS = 1_700_000_000_000_000_000


class Floor:
    def occupancy_grid(self) -> OccupancyGrid:
        return OccupancyGrid(np.zeros((60, 60), np.int8), 0.1, (0.0, 0.0))


class CountingEyes:
    def __init__(self) -> None:
        self.images: list[int] = []

    def image(self, T_map_camera, stamp_ns):
        self.images.append(stamp_ns)
        return np.zeros((480, 640, 3), np.uint8), np.ones((480, 640), np.float32)

    def cloud(self, T_map_lidar, stamp_ns):
        return LidarCloud(stamp_ns, np.ones((2, 3), np.float32), "livox_frame")


@pytest.fixture
def robot_and_clock():
    clock = SimClock(START_NS)
    return SimRobot(Floor(), clock, Pose2(2.0, 2.0, 0.0), LocalisationError(0.05, 0.02)), clock


def test_when_sleep_returns_the_driver_has_seen_every_sample(robot_and_clock):
    robot, clock = robot_and_clock
    heard = []
    with RosGraph(clock, robot, Floor().occupancy_grid()) as graph, ZenohLink(graph.link_config) as link:
        link.subscribe("tf", lambda payload: heard.append(decode(payload, TF.type_name)))
        graph.start(link)
        for _ in range(40):
            clock.sleep(0.05)
            newest = transforms_of(heard[-1])[0].stamp_ns
            assert clock.now_ns() - newest < 50_000_001, "one period of 20 Hz"


def test_images_are_rendered_at_their_rate_and_at_each_stop(robot_and_clock):
    robot, clock = robot_and_clock
    eyes = CountingEyes()
    graph = RosGraph(clock, robot, Floor().occupancy_grid(), eyes, camera_rate_hz=0.1)
    with graph, ZenohLink(graph.link_config) as link:
        graph.start(link)
        first = len(eyes.images)
        robot.follow(np.array([[3.0, 2.0]]), 0.0)
        while robot.moving:
            clock.sleep(0.05)
        stopped_ns = clock.now_ns()
        clock.sleep(0.2)
        assert len(eyes.images) == first + 1
        assert 0 <= eyes.images[-1] - stopped_ns + 50_000_000 <= 150_000_000


def test_the_published_pose_is_what_localisation_believes(robot_and_clock):
    from drivers.ros.topics import RosPoseSource

    robot, clock = robot_and_clock
    with RosGraph(clock, robot, Floor().occupancy_grid()) as graph, ZenohLink(graph.link_config) as link:
        poses = RosPoseSource(link, clock)
        poses.start()
        graph.start(link)
        robot.follow(np.array([[4.0, 2.0]]), 0.0)
        clock.sleep(8.0)
        assert robot.believed_pose.distance_to(robot.pose) > 0.001
        assert poses.robot_pose(0.5).distance_to(robot.believed_pose) < 1e-6


def test_a_fence_does_not_wait_for_a_driver_that_is_gone():
    with open_router() as endpoint, SimBridge(endpoint) as bridge:
        link = ZenohLink(LinkConfig((endpoint,)))
        with link:
            fence = Fence(bridge, link)
            fence.wait()
        fence.wait()


def test_a_fence_that_is_never_seen_is_an_error_not_a_hang():
    with (
        open_router() as one,
        open_router() as other,
        SimBridge(one) as bridge,
        ZenohLink(LinkConfig((other,))) as link,
        pytest.raises(RuntimeError, match="has not seen fence"),
    ):
        Fence(bridge, link, timeout_s=0.4).wait()


def test_a_handler_that_fails_is_raised_by_the_simulation(robot_and_clock):
    with open_router() as endpoint, SimBridge(endpoint) as bridge, ZenohLink(LinkConfig((endpoint,))) as link:
        asked = threading.Event()

        def fail(question):
            asked.set()
            raise ZeroDivisionError("of ours")

        bridge.answer("broken", fail)
        while not asked.is_set():
            link.get("broken", b"", 1.0)
        with pytest.raises(ZeroDivisionError, match="of ours"):
            for _ in range(100):
                bridge.flush()
                threading.Event().wait(0.02)


def test_a_look_is_an_image_of_this_moment_in_the_drivers_hands(robot_and_clock):
    from drivers.ros.topics import RosCamera

    robot, clock = robot_and_clock
    graph = RosGraph(clock, robot, Floor().occupancy_grid(), CountingEyes(), camera_rate_hz=0.01)
    with graph, ZenohLink(graph.link_config) as link:
        camera = RosCamera(link, clock)
        camera.start()
        graph.start(link)
        clock.sleep(3.0)
        graph.topics.look()
        assert camera.latest(0.0).stamp_ns == clock.now_ns()
