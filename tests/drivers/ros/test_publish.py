"""What `openbelief onboard` publishes, heard by the workstation's own ports through a real router."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import pytest

from drivers.clock import SimClock
from drivers.livox.intake import LivoxImuSample
from drivers.livox.wire import TimeType
from drivers.ports import CameraFrame, LidarCloud, LinkLost, PoseUnavailable, StaleData
from drivers.ros.convert import battery_message
from drivers.ros.messages import decode, encode, stamp_to_ns
from drivers.ros.publish import CameraPublisher, ImuPublisher, LidarPublisher, MountPublisher, Outlet, Publisher
from drivers.ros.topics import RosBattery, RosCamera, RosLidar, RosPoseSource
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from drivers.topics import COLOR_JPEG, DEPTH_PNG, LIDAR, LIDAR_IMU
from openbelief.observation import Intrinsics
from openbelief.pose import transform

START_NS = 1_700_000_000_000_000_000
K = Intrinsics(64, 48, 60.0, 60.0, 31.5, 23.5)
MOUNT = ("base_link", "camera_color_optical_frame", transform([0.1, 0.0, 1.2], [-0.5, 0.5, -0.5, 0.5]))

FLOOR = ("map", "base_link", np.eye(4))


@dataclass
class Sensor:
    """A Camera and a Lidar that see something new every `period_s` of the clock."""

    clock: SimClock
    period_s: float = 1 / 30
    set_by_ns: int = 0  # its own clock
    fails: Exception | None = None
    imu_ns: int = START_NS

    def stamp_ns(self) -> int:
        if self.fails:
            raise self.fails
        period_ns = round(self.period_s * 1e9)
        return self.clock.now_ns() // period_ns * period_ns + self.set_by_ns

    def frame(self, max_age_s: float) -> CameraFrame:
        stamp_ns = self.stamp_ns()
        color = np.full((48, 64, 3), (200, 40, 30), np.uint8)
        depth = np.linspace(0.0, 4.0, 64 * 48, dtype=np.float32).reshape(48, 64)
        return CameraFrame(stamp_ns, color, depth, K, "camera_color_optical_frame")

    def cloud(self, max_age_s: float) -> LidarCloud:
        points = np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]], np.float32)
        return LidarCloud(self.stamp_ns(), points, "livox_frame")

    def imu(self) -> list[LivoxImuSample]:
        """200 samples a second since the last call."""
        step_ns, now_ns = 5_000_000, self.clock.now_ns()
        stamps = range(self.imu_ns, now_ns, step_ns)
        self.imu_ns = now_ns
        return [LivoxImuSample(ns, np.array([0.1, 0, 0]), np.array([0, 0, 9.8]), ns, TimeType.UPTIME) for ns in stamps]


@dataclass
class Port:
    latest: object


@dataclass
class Publishers:
    """All of a robot's, in turn. sent: how many messages, by topic."""

    each: list[Publisher]
    sent: Counter[str]

    def step(self) -> None:
        for publisher in self.each:
            publisher.step()


@pytest.fixture
def onboard():
    """(clock, sensor, publisher, the workstation's link, the robot's link)."""
    clock = SimClock(START_NS)
    sensor = Sensor(clock)
    with (
        open_router() as endpoint,
        ZenohLink(LinkConfig((endpoint,))) as robot,
        ZenohLink(LinkConfig((endpoint,))) as ours,
    ):
        outlet = Outlet(robot)
        publishers = [
            CameraPublisher(outlet, clock, Port(sensor.frame), rate_hz=10.0),
            LidarPublisher(outlet, clock, Port(sensor.cloud), rate_hz=5.0),
            ImuPublisher(outlet, sensor.imu, "livox_frame"),
            MountPublisher(outlet, clock, [FLOOR, MOUNT]),
        ]
        yield clock, sensor, Publishers(publishers, outlet.sent), ours, robot


def heard(port, publisher, clock, eventually, max_age_s=10.0):
    """The port's first answer; the publisher goes on meanwhile, for a subscription takes a moment to be known."""
    found = []

    def ask() -> bool:
        clock.sleep(0.1)
        publisher.step()
        try:
            found.append(port.latest(max_age_s))
        except StaleData:
            return False
        return True

    eventually(ask)
    return found[0]


def test_a_frame_arrives_as_jpeg_and_lossless_millimetres_with_its_stamp_and_lens(onboard, eventually):
    clock, sensor, publisher, ours, _ = onboard
    camera = RosCamera(ours, clock, color=COLOR_JPEG, depth=DEPTH_PNG)
    camera.start()
    frame = heard(camera, publisher, clock, eventually)
    sent = sensor.frame(1.0)
    assert frame.intrinsics == K and frame.frame_id == sent.frame_id
    assert np.abs(frame.color.astype(int) - sent.color).max() <= 3
    assert np.abs(frame.depth_m - sent.depth_m).max() <= 0.0005


def test_a_cloud_arrives_point_by_point(onboard, eventually):
    clock, sensor, publisher, ours, _ = onboard
    lidar = RosLidar(ours, clock)
    lidar.start()
    cloud = heard(lidar, publisher, clock, eventually)
    np.testing.assert_array_equal(cloud.points, sensor.cloud(1.0).points)
    assert cloud.frame_id == "livox_frame"


def test_mounts_are_repeated_so_that_who_comes_late_has_them(onboard, eventually):
    clock, _, publisher, ours, _ = onboard
    publisher.step()
    poses = RosPoseSource(ours, clock)
    poses.start()

    found = []

    def there() -> bool:
        clock.sleep(0.5)
        publisher.step()
        try:
            found.append(poses.transform_at(clock.now_ns(), MOUNT[1]))
        except PoseUnavailable:
            return False
        return True

    eventually(there)
    np.testing.assert_allclose(found[0], MOUNT[2], atol=1e-12)


def test_rates_are_capped_and_nothing_is_sent_twice(onboard):
    clock, sensor, publisher, _, _ = onboard
    for _ in range(400):
        clock.sleep(0.005)
        publisher.step()
    assert publisher.sent[COLOR_JPEG.name] == pytest.approx(20, abs=1)  # 2 s at 10 Hz, of a camera at 30 Hz
    assert publisher.sent[LIDAR.name] == pytest.approx(10, abs=1)
    sensor.set_by_ns = -3_600_000_000_000
    before = publisher.sent[LIDAR.name]
    clock.sleep(0.5)
    publisher.step()
    assert publisher.sent[LIDAR.name] == before + 1, "a stamp that went back is a new sample"
    sensor.period_s = 1e9  # its stamp stands still
    before = publisher.sent[LIDAR.name]
    for _ in range(100):
        clock.sleep(0.1)
        publisher.step()
    assert publisher.sent[LIDAR.name] <= before + 1


def test_every_sample_of_the_imu_arrives_once_whatever_the_steps(onboard, eventually):
    clock, _, publisher, ours, _ = onboard
    heard: list[int] = []

    def hear(payload: bytes) -> None:
        message = decode(payload, LIDAR_IMU.type_name)
        assert message.header.frame_id == "livox_frame" and message.linear_acceleration.z == 9.8
        heard.append(stamp_to_ns(message.header.stamp))

    ours.subscribe("livox/imu", hear)

    def send() -> bool:
        clock.sleep(0.1)
        publisher.step()
        return bool(heard)

    eventually(send)
    first = heard[0]
    for seconds in (0.005, 0.3, 0.045):
        clock.sleep(seconds)
        publisher.step()
    eventually(lambda: heard[-1] >= clock.now_ns() - 5_000_000)
    assert heard == list(range(first, clock.now_ns(), 5_000_000))


def test_a_sensor_without_data_sends_nothing_and_one_that_failed_is_named(onboard):
    _, sensor, publisher, _, _ = onboard
    sensor.fails = StaleData("nothing yet")
    publisher.step()
    assert publisher.sent[COLOR_JPEG.name] == 0
    sensor.fails = LinkLost("the camera has failed")
    with pytest.raises(LinkLost, match="the camera has failed"):
        publisher.step()


@pytest.fixture
def battery(onboard):
    """(clock, the battery port, put): `put(percentage, stamp_ns)` publishes one message."""
    clock, _, _, ours, robot = onboard
    port = RosBattery(ours, clock)
    port.start()

    def put(percentage: float, stamp_ns: int) -> None:
        robot.put("battery_state", encode(battery_message(stamp_ns, percentage)))

    return clock, port, put


def charge(port, max_age_s: float = 10.0) -> float | None:
    try:
        return round(port.latest(max_age_s).fraction, 3)
    except StaleData:
        return None


def test_the_charge_is_heard_though_all_that_is_not_measured_is_nan_and_an_impossible_one_is_not(battery, eventually):
    clock, port, put = battery
    assert charge(port) is None
    eventually(lambda: put(0.5, clock.now_ns()) or charge(port) == 0.5)
    eventually(lambda: put(50.0, clock.now_ns()) or port._intake.dropped > 0)
    assert charge(port) == 0.5
    clock.sleep(60.0)
    with pytest.raises(StaleData, match=r"60\.0"):
        port.latest(10.0)


def test_a_charge_that_is_not_measured_is_unknown_and_says_so(battery, eventually):
    clock, port, put = battery
    eventually(lambda: put(float("nan"), clock.now_ns()) or port._intake.dropped > 0)
    with pytest.raises(StaleData, match=r"No battery state yet .* its driver does not measure the charge"):
        port.latest(10.0)


def test_a_battery_state_without_a_stamp_is_as_old_as_its_arrival(battery, eventually):
    clock, port, put = battery
    eventually(lambda: put(0.5, 0) or charge(port) == 0.5)
    put(0.7, 0)  # once: no copy of it comes later
    eventually(lambda: charge(port) == 0.7)
    clock.sleep(9.0)
    assert charge(port) == 0.7
    clock.sleep(2.0)
    with pytest.raises(StaleData, match=r"11\.0"):
        port.latest(10.0)
