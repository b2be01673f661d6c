"""What every body of a port promises. To hold another body to it, add a function that makes it to BODIES."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import pytest

from drivers.clock import SimClock, SystemClock
from drivers.ports import (
    Camera,
    CameraFrame,
    Clock,
    Lidar,
    LidarCloud,
    Map,
    NavigationStatus,
    Navigator,
    PoseSource,
    PoseUnavailable,
    StaleData,
)
from drivers.realsense.camera import RealSenseCamera
from drivers.realsense.messages import RealSenseSettings
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import grid_message
from drivers.topics import COLOR, LIDAR, TF
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from sim_fakes.playback.ports import RecordingPorts
from sim_fakes.sensors.realsense_bus import open_twin
from sim_fakes.sensors.realsense_faults import Fault, TwinState
from sim_fakes.sensors.realsense_software import TwinSpec, box_images

NEAR, CLOSED_OFF = Pose2(2.0, 1.5, 0.5), Pose2(5.5, 3.5, 0.0)


@dataclass
class Body:
    """One body of a port with data flowing. fall_silent: nothing new arrives from now on."""

    port: Any
    clock: Clock
    fall_silent: Callable[[], None] = lambda: None


def ros(name: str, topic: str = "") -> Callable[[pytest.FixtureRequest], Body]:
    """The body that listens to the simulated robot over Zenoh."""

    def make(request: pytest.FixtureRequest) -> Body:
        rig = request.getfixturevalue("rig")
        return Body(getattr(rig, name), rig.clock, lambda: rig.graph.sensor_faults.muted.add(topic))

    return make


def replay(name: str) -> Callable[[pytest.FixtureRequest], Body]:
    """The body that plays a recording by a clock; it falls silent when the recording ends."""

    def make(request: pytest.FixtureRequest) -> Body:
        walk = request.getfixturevalue("make_walk")(frames=20)
        start_ns, cloud = walk.stamps[0], np.ones((9, 3), np.float32)
        grid = OccupancyGrid(np.zeros((20, 30), np.int8), 0.05, (-1.0, -1.0))
        walk.messages.append(("/map", start_ns, grid_message(grid)))
        for at in walk.stamps:
            walk.messages.append(("/livox/lidar", at, cloud_message(LidarCloud(at, cloud, "livox_frame"))))
        recording = RecordingPorts(walk.write(request.getfixturevalue("tmp_path") / "walk.mcap"))
        clock = SimClock(recording.start_ns)
        return Body(getattr(recording, name)(clock), clock, lambda: clock.sleep(10.0))

    return make


class SkippingClock(SystemClock):
    """The real clock, on which sleeping is instant."""

    skipped_ns = 0

    def now_ns(self) -> int:
        return super().now_ns() + self.skipped_ns

    def sleep(self, seconds: float) -> None:
        self.skipped_ns += round(seconds * 1e9)


def realsense(request: pytest.FixtureRequest) -> Body:
    """The body over librealsense, in its own process, with the simulated twin inside."""
    clock, state = SkippingClock(), TwinState()
    opener = partial(open_twin, box_images, TwinSpec(), state)
    camera = RealSenseCamera(RealSenseSettings(), clock, open_device=opener)
    request.addfinalizer(camera.close)
    camera.start()
    request.getfixturevalue("eventually")(lambda: camera.health().domain is not None)
    return Body(camera, clock, lambda: setattr(state, "fault", Fault.SILENT))


BODIES: dict[str, dict[str, Callable[[pytest.FixtureRequest], Body]]] = {
    "camera": {"ros": ros("camera", COLOR.name), "replay": replay("camera"), "realsense": realsense},
    "lidar": {"ros": ros("lidar", LIDAR.name), "replay": replay("lidar")},
    "poses": {"ros": ros("poses", TF.name), "replay": replay("pose")},
    "map": {"ros": ros("map"), "replay": replay("map")},
    "navigator": {"ros": ros("nav")},
}


def bodies(port: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("make", BODIES[port].values(), ids=BODIES[port])


@bodies("camera")
def test_a_camera_gives_whole_frames_and_refuses_old_ones(make, request):
    body = make(request)
    assert isinstance(body.port, Camera)
    frame = body.port.latest(2.0)
    assert isinstance(frame, CameraFrame)
    shape = (frame.intrinsics.height, frame.intrinsics.width)
    assert frame.color.shape == (*shape, 3) and frame.color.dtype == np.uint8
    assert frame.depth_m.shape == shape and frame.depth_m.dtype == np.float32
    assert np.isfinite(frame.depth_m).all() and (frame.depth_m >= 0).all()
    assert 0 <= body.clock.now_ns() - frame.stamp_ns <= 2_000_000_000
    assert body.port.latest(2.0).stamp_ns >= frame.stamp_ns, "never backwards"
    body.fall_silent()
    body.clock.sleep(3.0)
    with pytest.raises(StaleData):
        body.port.latest(1.0)


@bodies("lidar")
def test_a_lidar_gives_finite_points_and_refuses_old_ones(make, request):
    body = make(request)
    assert isinstance(body.port, Lidar)
    cloud = body.port.latest(1.0)
    assert isinstance(cloud, LidarCloud) and cloud.frame_id
    assert cloud.points.ndim == 2 and cloud.points.shape[1] == 3 and cloud.points.dtype == np.float32
    assert np.isfinite(cloud.points).all() and cloud.points.any(axis=1).all()
    body.fall_silent()
    body.clock.sleep(3.0)
    with pytest.raises(StaleData):
        body.port.latest(1.0)


@bodies("poses")
def test_a_pose_source_answers_inside_its_record_and_never_guesses(make, request):
    body = make(request)
    assert isinstance(body.port, PoseSource)
    body.clock.sleep(0.5)
    now_ns = body.clock.now_ns()
    assert np.isfinite(body.port.robot_pose(0.5).xy).all()
    T = body.port.transform_at(now_ns - 200_000_000, "base_link")
    assert T.shape == (4, 4) and np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    for stamp_ns, frame in (
        (now_ns - 3_600_000_000_000, "base_link"),
        (now_ns + 3_600_000_000_000, "base_link"),
        (now_ns - 200_000_000, "no_such_frame"),
    ):
        with pytest.raises(PoseUnavailable):
            body.port.transform_at(stamp_ns, frame)
    body.fall_silent()
    body.clock.sleep(2.0)
    with pytest.raises(StaleData):
        body.port.robot_pose(0.5)


@bodies("map")
def test_a_map_is_a_grid_of_the_map_frame(make, request):
    body = make(request)
    assert isinstance(body.port, Map)
    grid = body.port.latest()
    assert isinstance(grid, OccupancyGrid) and grid.cells.dtype == np.int8 and grid.resolution_m > 0
    assert grid.cells.min() >= -1 and grid.cells.max() <= 100


@bodies("navigator")
def test_a_navigator_takes_a_goal_to_one_end_and_keeps_to_it(make, request):
    body = make(request)
    assert isinstance(body.port, Navigator)
    assert body.port.unavailable() is None
    assert body.port.plan(NEAR).length_m > 0
    assert body.port.send(NEAR) is None
    end = _end(body)
    assert end.status == NavigationStatus.SUCCEEDED
    assert body.port.result() == end and body.port.cancel(because="it is over") == end


@bodies("navigator")
def test_a_navigator_says_why_there_is_no_way(make, request):
    body = make(request)
    plan = body.port.plan(CLOSED_OFF)
    assert plan.length_m is None and plan.reason
    first = body.port.send(CLOSED_OFF)
    end = first or _end(body)
    assert end.status in (NavigationStatus.ABORTED, NavigationStatus.REJECTED) and end.reason


@bodies("navigator")
def test_a_navigator_cancels_with_a_reason(make, request):
    body = make(request)
    body.port.send(NEAR)
    end = body.port.cancel(because="the operator said stop")
    assert end.status == NavigationStatus.CANCELED and "the operator said stop" in end.reason
    assert body.port.result() == end


def _end(body: Body) -> Any:
    for _ in range(600):
        body.clock.sleep(0.1)
        if (result := body.port.result()) is not None:
            return result
    raise AssertionError("the goal has no end")
