"""The taps: topics as they come over real Zenoh sessions, and ports that are no topics."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.ports import CameraFrame, LidarCloud, LinkLost, StaleData
from drivers.ros.clouds import cloud_of
from drivers.ros.convert import grid_of, transforms_message
from drivers.ros.image_messages import camera_info_message, color_message, depth_message
from drivers.ros.images import color_image, depth_image
from drivers.ros.messages import decode, encode
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.topics import CAMERA_INFO, COLOR, COLOR_JPEG, DEPTH, LIDAR, LIDAR_IMU, MAP, TF
from logs.frames.reader import FrameReader
from logs.mcap_io.reader import LogReader
from logs.record.port_tap import PortTap
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from logs.record.tap import TopicTap
from openbelief.observation import Intrinsics
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.sim_bridge import SimBridge
from support.waiting import until

CAMERA = Intrinsics(fx=60.0, fy=60.0, cx=32.0, cy=24.0, width=64, height=48)
STAMP_NS = 1_700_000_000_123_456_789


@pytest.fixture
def wire() -> Iterator[tuple[SimBridge, ZenohLink]]:
    """(the robot's end, our end)"""
    with open_router() as endpoint, SimBridge(endpoint) as bridge, ZenohLink(LinkConfig((endpoint,))) as link:
        yield bridge, link


def test_colour_becomes_jpeg_and_everything_else_is_kept_byte_for_byte(
    wire: tuple[SimBridge, ZenohLink], tmp_path: Path
) -> None:
    bridge, link = wire
    color = np.full((48, 64, 3), (200, 30, 30), np.uint8)
    depth = encode(depth_message(STAMP_NS, "camera", np.full((48, 64), 1.5, np.float32)))
    sent = {
        COLOR: encode(color_message(STAMP_NS, "camera", color)),
        DEPTH: depth,
        TF: encode(transforms_message(STAMP_NS, [("map", "camera", np.eye(4))])),
    }
    clock = SystemClock()
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        TopicTap(link, queue).start()
        names = (COLOR_JPEG.name, DEPTH.name, TF.name)
        until(
            lambda: all(queue.streams[name].written for name in names),
            again=lambda: [bridge.publish(topic, payload) for topic, payload in sent.items()],
        )
    messages = {message.topic: message for message in LogReader(tmp_path / "a.mcap")}
    assert set(messages) == set(names)
    assert messages[DEPTH.name].payload == depth
    assert messages[TF.name].payload == sent[TF]
    assert {message.stamp_ns for message in messages.values()} == {STAMP_NS}
    jpeg = decode(messages[COLOR_JPEG.name].payload, COLOR_JPEG.type_name)
    assert np.abs(color_image(jpeg).astype(int) - color).max() < 12


@pytest.mark.parametrize(
    ("payload", "reason"),
    [(b"\x00\x01", "2 bytes are not a"), (bytes(9 << 20), "more than the 8388608 allowed")],
    ids=["no message", "oversize"],
)
def test_what_is_no_message_or_too_large_is_dropped_visibly(
    wire: tuple[SimBridge, ZenohLink], tmp_path: Path, payload: bytes, reason: str
) -> None:
    bridge, link = wire
    link_config = replace(link.config, max_message_bytes=32 << 20)
    clock = SystemClock()
    with (
        ZenohLink(link_config) as wide,
        McapRecorder(tmp_path / "a.mcap", clock) as recorder,
        QueuedRecorder(recorder, clock) as queue,
    ):
        TopicTap(wide, queue).start()
        until(lambda: queue.streams[DEPTH.name].dropped > 0, again=lambda: bridge.publish(DEPTH, payload))
    assert reason in queue.streams[DEPTH.name].reason
    assert queue.streams[DEPTH.name].written == 0


class Sensors:
    """A camera, lidar with an IMU, map and poses that answer as a driver of this process would."""

    def __init__(self) -> None:
        self.stamp_ns = STAMP_NS
        self.gone = False
        self.grid = OccupancyGrid(np.zeros((4, 6), np.int8), 0.5, (0.0, 0.0), STAMP_NS)

    def latest(self, max_age_s: float) -> CameraFrame:
        if self.gone:
            raise StaleData("The camera is silent.")
        color, depth = np.full((48, 64, 3), 90, np.uint8), np.full((48, 64), 2.0, np.float32)
        return CameraFrame(self.stamp_ns, color, depth, CAMERA, "camera")

    def transform_at(self, stamp_ns: int, frame_id: str) -> np.ndarray:
        T = np.eye(4)
        T[0, 3] = 3.0 if frame_id == "camera" else 1.0
        return T


class Clouds:
    """Two clouds a time, and an IMU."""

    def __init__(self) -> None:
        self.number = 0

    def latest(self, max_age_s: float) -> LidarCloud:
        return self._cloud(self.number)

    def take_clouds(self) -> list[LidarCloud]:
        self.number += 2
        return [self._cloud(self.number - 1), self._cloud(self.number)]

    def take_imu(self) -> list[object]:
        raise LinkLost("The IMU is gone.")

    def _cloud(self, number: int) -> LidarCloud:
        return LidarCloud(STAMP_NS + number, np.full((5, 3), number, np.float32), "livox_frame")


class Still:
    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid

    def latest(self) -> OccupancyGrid:
        return self.grid


def test_ports_that_are_no_topics_make_a_recording_that_can_be_mapped(tmp_path: Path) -> None:
    camera, lidar, clock = Sensors(), Clouds(), SystemClock()
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        tap = PortTap(queue)
        tap.add_camera(camera)
        tap.add_lidar(lidar)
        tap.add_map(Still(camera.grid))
        tap.add_poses(camera)
        for step in range(3):
            camera.stamp_ns = STAMP_NS + step * 10**8
            tap.poll()
            tap.poll()  # the same frame again is not another frame
    [*frames] = FrameReader(tmp_path / "a.mcap")
    assert [frame.stamp_ns for frame in frames] == [STAMP_NS + step * 10**8 for step in range(3)]
    assert frames[0].T_map_camera[0, 3] == 3.0
    by_topic: dict[str, list[bytes]] = {}
    for message in LogReader(tmp_path / "a.mcap"):
        by_topic.setdefault(message.topic, []).append(message.payload)
    clouds = [cloud_of(decode(payload, LIDAR.type_name)) for payload in by_topic[LIDAR.name]]
    assert [cloud.points[0, 0] for cloud in clouds] == list(range(1, 13))
    assert [grid_of(decode(p, MAP.type_name)).cells.shape for p in by_topic[MAP.name]] == [(4, 6)]
    assert depth_image(decode(by_topic[DEPTH.name][0], DEPTH.type_name))[0, 0] == 2.0
    assert len(by_topic[CAMERA_INFO.name]) == 3
    assert tap.trouble == {LIDAR_IMU.name: "The IMU is gone."}


def test_a_sensor_that_falls_silent_is_told_and_the_others_go_on(tmp_path: Path) -> None:
    camera, lidar, clock = Sensors(), Clouds(), SystemClock()
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder, QueuedRecorder(recorder, clock) as queue:
        tap = PortTap(queue)
        tap.add_camera(camera)
        tap.add_lidar(lidar)
        camera.gone = True
        tap.poll()
    assert tap.trouble[DEPTH.name] == "The camera is silent."
    assert queue.streams[LIDAR.name].written == 2


def test_a_link_that_is_down_is_told(tmp_path: Path) -> None:
    clock = SystemClock()
    with ExitStack() as router, ExitStack() as opened:
        endpoint = router.enter_context(open_router())
        link = opened.enter_context(ZenohLink(LinkConfig((endpoint,))))
        recorder = opened.enter_context(McapRecorder(tmp_path / "a.mcap", clock))
        tap = TopicTap(link, opened.enter_context(QueuedRecorder(recorder, clock)))
        tap.start()
        assert tap.gone() is None
        router.close()
        until(lambda: tap.gone() is not None)
        assert tap.gone() == f"The link to {endpoint} is down."


def test_the_first_transform_gives_the_stamp_of_many() -> None:
    from logs.record.tap import header_stamp

    edges = [("map", "odom", np.eye(4)), ("odom", "base_link", np.eye(4))]
    assert header_stamp(TF, encode(transforms_message(STAMP_NS, edges))) == STAMP_NS
    assert header_stamp(CAMERA_INFO, encode(camera_info_message(STAMP_NS, "camera", CAMERA))) == STAMP_NS
