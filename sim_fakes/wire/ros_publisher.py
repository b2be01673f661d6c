"""The robot's topics as the bridge forwards them: /tf, /tf_static, /map, camera and lidar of a SimRobot."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from drivers.clock import SimClock
from drivers.ports import LidarCloud
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import battery_message, grid_message, imu_message, transforms_message
from drivers.ros.image_messages import camera_info_message, color_message, depth_message
from drivers.ros.messages import Message, encode
from drivers.topics import BATTERY, CAMERA_IMU, CAMERA_INFO, COLOR, DEPTH, LIDAR, LIDAR_IMU, MAP, TF, TF_STATIC, Topic
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from openbelief.pose import T_CAMERA_LINK_OPTICAL, Pose2, inverse, wrap_angle
from openbelief.traversability import OccupancyGrid
from sim_fakes.wire.faults import SensorFaults
from sim_fakes.wire.sim_bridge import SimBridge

CAMERA_FRAME, LIDAR_FRAME = "camera_color_optical_frame", "livox_frame"
TF_RATE_HZ = 20.0  # each sample costs a fence
IMU_PER_TF = 10  # 200 Hz
BATTERY_RATE_HZ = 1.0
GRAVITY_M_S2 = 9.81


class Body(Protocol):
    """What the topics tell of the robot."""

    T_base_camera: Array
    T_base_lidar: Array

    @property
    def intrinsics(self) -> Intrinsics: ...

    @property
    def pose(self) -> Pose2: ...

    @property
    def believed_pose(self) -> Pose2: ...

    @property
    def moving(self) -> bool: ...


class Eyes(Protocol):
    """What the sensors see from where the robot stands."""

    def image(self, T_map_camera: Array, stamp_ns: int) -> tuple[Array, Array]:
        """(h, w, 3) uint8 RGB and (h, w) metres."""
        ...

    def cloud(self, T_map_lidar: Array, stamp_ns: int) -> LidarCloud: ...


class SimRosPublisher:
    """Publishes by the clock, each batch followed by the bridge's fences.

    Rendering costs 0.1 s of wall time and more, so images come at `camera_rate_hz` of simulated time and whenever the
    robot has just come to a stop; with None only when `look` asks for one.
    """

    def __init__(
        self,
        bridge: SimBridge,
        clock: SimClock,
        robot: Body,
        grid: OccupancyGrid,
        eyes: Eyes | None = None,
        faults: SensorFaults | None = None,
        *,
        camera_rate_hz: float | None = 1.0,
        lidar_rate_hz: float = 2.0,
    ) -> None:
        self._bridge, self._clock, self._robot, self._grid, self._eyes = bridge, clock, robot, grid, eyes
        self.faults = faults or SensorFaults()
        self._camera_rate_hz, self._lidar_rate_hz = camera_rate_hz, lidar_rate_hz
        self._was_moving = False

    def start(self) -> None:
        """Publish what is latched and a first sample of everything, then go on by the clock."""
        self._send(TF_STATIC, transforms_message(self._stamp_ns(), self._mounts()))
        self._send(MAP, grid_message(replace(self._grid, stamp_ns=self._stamp_ns())))
        self._clock.every(1.0 / TF_RATE_HZ, self._tf)
        if self._eyes is not None:
            if self._camera_rate_hz is not None:
                self._clock.every(1.0 / self._camera_rate_hz, self.look)
                self._clock.every(1.0 / TF_RATE_HZ, self._camera_at_stop)
            self._clock.every(1.0 / self._lidar_rate_hz, self._lidar)
            self._send_lidar()
            self._send_camera()
        self._tf()

    def start_imu(self) -> None:
        """The lidar's and the camera's IMU too, ten samples at a time; missions read neither, recordings keep both."""
        yaws = [self._robot.pose.yaw]

        def send() -> None:
            yaw = self._robot.pose.yaw
            self._send_imu(wrap_angle(yaw - yaws[0]) * TF_RATE_HZ)
            yaws[0] = yaw
            self._bridge.flush()

        self._clock.every(1.0 / TF_RATE_HZ, send)

    def start_lidar(self, eyes: Eyes) -> None:
        """Clouds as a topic, where no sensor sends them."""
        self._eyes = eyes
        self._clock.every(1.0 / self._lidar_rate_hz, self._lidar)

    def start_battery(self, fraction: float) -> None:
        """The charge, 0 to 1, once a second; a simulated battery never runs down."""

        def send() -> None:
            self._send(BATTERY, battery_message(self._stamp_ns(), fraction))
            self._bridge.flush()

        self._clock.every(1.0 / BATTERY_RATE_HZ, send)

    def _send_imu(self, turn_rad_s: float) -> None:
        """What the base feels, turned into each sensor's frame; the stamps are spread over the time since the last."""
        step_ns = round(1e9 / TF_RATE_HZ / IMU_PER_TF)
        for topic, frame_id, T_base_sensor in (
            (LIDAR_IMU, LIDAR_FRAME, self._robot.T_base_lidar),
            (CAMERA_IMU, CAMERA_FRAME, self._robot.T_base_camera),
        ):
            R_sensor_base = T_base_sensor[:3, :3].T
            gyro, acceleration = R_sensor_base @ [0.0, 0.0, turn_rad_s], R_sensor_base @ [0.0, 0.0, GRAVITY_M_S2]
            for back in reversed(range(IMU_PER_TF)):
                self._send(topic, imu_message(self._stamp_ns() - back * step_ns, frame_id, gyro, acceleration))

    def _mounts(self) -> list[tuple[str, str, Array]]:
        T_base_link = self._robot.T_base_camera @ inverse(T_CAMERA_LINK_OPTICAL)
        return [
            ("base_link", "camera_link", T_base_link),
            ("camera_link", CAMERA_FRAME, T_CAMERA_LINK_OPTICAL),
            ("base_link", LIDAR_FRAME, self._robot.T_base_lidar),
        ]

    def _tf(self) -> None:
        self._send_tf()
        self._bridge.flush()

    def _send_tf(self) -> None:
        """odom -> base_link is the true motion, map -> odom is what localisation makes of it."""
        T_odom_base, T_map_base = self._robot.pose.matrix(), self._robot.believed_pose.matrix()
        edges = [("map", "odom", T_map_base @ inverse(T_odom_base)), ("odom", "base_link", T_odom_base)]
        self._send(TF, transforms_message(self._stamp_ns(), edges))

    def _camera_at_stop(self) -> None:
        stopped, self._was_moving = self._was_moving and not self._robot.moving, self._robot.moving
        if stopped:
            self.look()

    def look(self) -> None:
        """Publish an image now, whatever the rate."""
        self._send_camera()
        self._bridge.flush()

    def _send_camera(self) -> None:
        """The image and, at the very same stamp, where the robot was."""
        assert self._eyes is not None
        stamp_ns, robot = self._stamp_ns(), self._robot
        color, depth_m = self._eyes.image(robot.pose.matrix() @ robot.T_base_camera, stamp_ns)
        self._send_tf()
        self.send_image(stamp_ns, color, depth_m)

    def send_image(self, stamp_ns: int, color: Array, depth_m: Array) -> None:
        """An image made elsewhere, of the robot at that stamp; from any thread."""
        self._send(COLOR, color_message(stamp_ns, CAMERA_FRAME, color))
        self._send(DEPTH, depth_message(stamp_ns, CAMERA_FRAME, depth_m))
        self._send(CAMERA_INFO, camera_info_message(stamp_ns, CAMERA_FRAME, self._robot.intrinsics))

    def _lidar(self) -> None:
        self._send_lidar()
        self._bridge.flush()

    def _send_lidar(self) -> None:
        assert self._eyes is not None
        stamp_ns = self._stamp_ns()
        cloud = self._eyes.cloud(self._robot.pose.matrix() @ self._robot.T_base_lidar, stamp_ns)
        self._send(LIDAR, cloud_message(replace(cloud, frame_id=LIDAR_FRAME)))

    def _send(self, topic: Topic, message: Message) -> None:
        if topic.name in self.faults.muted:
            return
        payload = encode(message)
        spoil = self.faults.spoiled.get(topic.name)
        self._bridge.publish(topic, spoil(payload) if spoil else payload)

    def _stamp_ns(self) -> int:
        return self._clock.now_ns() if self.faults.frozen_ns is None else self.faults.frozen_ns
