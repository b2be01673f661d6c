"""The simulated twin of the D435i: a software device inside the real librealsense, with faults on demand."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from drivers.realsense.libusb import ensure_libusb
from drivers.realsense.messages import DEPTH_SIZE, FPS, TimestampDomain
from drivers.realsense.sdk import DOMAINS
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from sim_fakes.sensors.realsense_faults import Fault, TwinState
from sim_fakes.sensors.realsense_scene import BoxScene

ensure_libusb()

import pyrealsense2 as rs  # noqa: E402 - needs libusb

DEPTH_UNIT_M = 0.001
PERIOD_NS = round(1e9 / FPS)
GYRO_HZ, ACCEL_HZ = 200, 250
LATE_NS = 50_000_000
COLOR_LENS = Intrinsics(848, 480, 615.0, 615.0, 423.5, 239.5)
DEPTH_LENS = Intrinsics(*DEPTH_SIZE, 425.0, 425.0, 423.5, 239.5)
GRAVITY = (0.0, -9.80665, 0.0)  # of a level camera, whose y points down
TURN = (0.0, 0.1, 0.0)

# stamp_ns -> color (h, w, 3) uint8 RGB as the colour imager sees it, depth_m (480, 848) as the depth imager does
Images = Callable[[int], tuple[Array, Array]]


@dataclass(frozen=True, kw_only=True)
class TwinSpec:
    """How the twin is built. distortion: of the colour lens, with librealsense's name of its model."""

    serial: str = "000000000435"
    usb: str = "3.2"
    color: Intrinsics = COLOR_LENS
    color_model: str = "inverse_brown_conrady"
    depth: Intrinsics = DEPTH_LENS
    T_depth_color: Array = field(default_factory=lambda: _shifted(0.015))
    domain: TimestampDomain = TimestampDomain.GLOBAL
    has_imu: bool = True


class RealSenseTwin:
    """`device` is what a bus would give; `feed` sends one moment's images and the IMU samples since the last."""

    def __init__(self, images: Images, spec: TwinSpec | None = None, state: TwinState | None = None) -> None:
        self._images, self.spec, self.state = images, spec or TwinSpec(), state or TwinState()
        self.device = rs.software_device()
        for key, value in (
            (rs.camera_info.name, "Simulated RealSense D435I"),
            (rs.camera_info.serial_number, self.spec.serial),
            (rs.camera_info.usb_type_descriptor, self.spec.usb),
            (rs.camera_info.firmware_version, "5.16.0.1"),
        ):
            self.device.register_info(key, value)
        self._add_sensors()
        self.device.create_matcher(rs.matchers.dlr_c)
        self._domain = next(theirs for theirs, ours in DOMAINS.items() if ours is self.spec.domain)
        self._noise = np.random.default_rng(0xD435).integers(0, 2, 1 << 22, dtype=np.uint8)
        self._number = 0
        self._last: tuple[int, Array, Array] | None = None
        self._held: deque[tuple[int, int, Array]] = deque()
        self._motion_ns = {rs.stream.gyro: 0, rs.stream.accel: 0}

    def feed(self, stamp_ns: int) -> None:
        """One moment, with the fault of the moment. The device counts its images even where it loses them."""
        fault = self.state.fault
        self._send_held(stamp_ns)
        if fault in (Fault.SILENT, Fault.UNPLUGGED):
            return
        self._send_motions(stamp_ns)
        if fault is Fault.REPEATED and self._last is not None:
            stamp_ns, color, depth = self._last
        else:
            self._number += 1
            stamp_ns, color, depth = self._moment(fault, stamp_ns)
        self._send(self._depth, self._depth_profile, self._number, stamp_ns, depth)
        if fault is Fault.LATE:
            self._held.append((self._number, stamp_ns, color))
        elif fault is not Fault.DROPPED or self._number % 3:
            self._send(self._color, self._color_profile, self._number, stamp_ns, color)

    def _moment(self, fault: Fault, stamp_ns: int) -> tuple[int, Array, Array]:
        """Stamp, colour and depth counts, a sensor's noise in the last bit of every pixel."""
        if fault is Fault.PIXELS_FROZEN and self._last is not None:
            _, color, depth = self._last
        else:
            color, depth_m = self._images(stamp_ns)
            depth = np.round(depth_m / DEPTH_UNIT_M).astype(np.uint16)
            color, depth = color ^ self._flicker(color.shape), depth ^ (self._flicker(depth.shape) * (depth > 0))
        if fault is Fault.STAMP_FROZEN and self._last is not None:
            stamp_ns = self._last[0]
        self._last = (stamp_ns, color, depth)
        return self._last

    def _flicker(self, shape: tuple[int, ...]) -> Array:
        size = int(np.prod(shape))
        start = self._number * 7919 % (len(self._noise) - size)
        return self._noise[start : start + size].reshape(shape)

    def _send_held(self, stamp_ns: int) -> None:
        while self._held and stamp_ns - self._held[0][1] >= LATE_NS:
            number, held_ns, color = self._held.popleft()
            self._send(self._color, self._color_profile, number, held_ns, color)

    def _send(self, sensor: Any, profile: Any, number: int, stamp_ns: int, pixels: Array) -> None:
        frame = rs.software_video_frame()
        frame.pixels = np.ascontiguousarray(pixels)
        frame.bpp = pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
        frame.stride = pixels.shape[1] * frame.bpp
        frame.timestamp, frame.domain, frame.frame_number = stamp_ns / 1e6, self._domain, number
        frame.profile = profile.as_video_stream_profile()
        if pixels.ndim == 2:
            frame.depth_units = DEPTH_UNIT_M
        sensor.on_video_frame(frame)

    def _send_motions(self, stamp_ns: int) -> None:
        if not self.spec.has_imu:
            return
        for profile, rate, value in ((self._gyro_profile, GYRO_HZ, TURN), (self._accel_profile, ACCEL_HZ, GRAVITY)):
            stream, period_ns = profile.stream_type(), round(1e9 / rate)
            at_ns = max(self._motion_ns[stream] + period_ns, stamp_ns - PERIOD_NS)
            for due_ns in range(at_ns, stamp_ns + 1, period_ns):
                self._send_motion(profile, due_ns, value)
                self._motion_ns[stream] = due_ns

    def _send_motion(self, profile: Any, stamp_ns: int, value: tuple[float, float, float]) -> None:
        frame, data = rs.software_motion_frame(), rs.vector()
        data.x, data.y, data.z = value
        frame.data, frame.timestamp, frame.domain = data, stamp_ns / 1e6, self._domain
        frame.profile = profile.as_motion_stream_profile()
        self._motion.on_motion_frame(frame)

    def _add_sensors(self) -> None:
        spec = self.spec
        self._depth, self._color = self.device.add_sensor("Stereo Module"), self.device.add_sensor("RGB Camera")
        self._depth_profile = self._depth.add_video_stream(
            _video_stream(1, rs.stream.depth, rs.format.z16, 2, spec.depth, "brown_conrady")
        )
        self._color_profile = self._color.add_video_stream(
            _video_stream(2, rs.stream.color, rs.format.rgb8, 3, spec.color, spec.color_model)
        )
        self._depth.add_read_only_option(rs.option.depth_units, DEPTH_UNIT_M)
        self._depth.add_read_only_option(rs.option.stereo_baseline, 50.0)  # mm; disparity needs it
        for sensor, options in (
            (self._depth, (rs.option.emitter_enabled, rs.option.enable_auto_exposure, rs.option.global_time_enabled)),
            (self._color, (rs.option.enable_auto_exposure, rs.option.auto_exposure_priority)),
        ):
            for option in options:
                sensor.add_option(option, _switch(), True)
        self._depth_profile.register_extrinsics_to(self._color_profile, _extrinsics(np.linalg.inv(spec.T_depth_color)))
        if spec.has_imu:
            self._add_imu()

    def _add_imu(self) -> None:
        self._motion = self.device.add_sensor("Motion Module")
        self._accel_profile = self._motion.add_motion_stream(_motion_stream(3, rs.stream.accel, ACCEL_HZ))
        self._gyro_profile = self._motion.add_motion_stream(_motion_stream(4, rs.stream.gyro, GYRO_HZ))
        T_depth_imu = _shifted(-0.0055)
        for profile in (self._accel_profile, self._gyro_profile):
            profile.register_extrinsics_to(self._depth_profile, _extrinsics(T_depth_imu))


def box_images(spec: TwinSpec) -> Images:
    """A box before a wall, as the spec's two imagers see it."""
    scene = BoxScene()
    color, _ = scene.seen(spec.color, np.eye(4))
    _, depth_m = scene.seen(spec.depth, np.linalg.inv(spec.T_depth_color))
    return lambda _stamp_ns: (color, depth_m)


def _shifted(x_m: float) -> Array:
    T = np.eye(4)
    T[0, 3] = x_m
    return T


def _extrinsics(T: Array) -> Any:
    extrinsics = rs.extrinsics()
    extrinsics.rotation = T[:3, :3].ravel(order="F").tolist()
    extrinsics.translation = T[:3, 3].tolist()
    return extrinsics


def _video_stream(uid: int, stream: Any, kind: Any, bpp: int, intrinsics: Intrinsics, model: str) -> Any:
    lens = rs.intrinsics()
    lens.width, lens.height = intrinsics.width, intrinsics.height
    lens.fx, lens.fy, lens.ppx, lens.ppy = intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy
    lens.model = getattr(rs.distortion, model)
    lens.coeffs = [*intrinsics.distortion, 0.0, 0.0, 0.0, 0.0, 0.0][:5]
    video = rs.video_stream()
    video.type, video.index, video.uid, video.fmt, video.bpp = stream, 0, uid, kind, bpp
    video.width, video.height, video.fps, video.intrinsics = intrinsics.width, intrinsics.height, FPS, lens
    return video


def _motion_stream(uid: int, stream: Any, rate: int) -> Any:
    motion = rs.motion_stream()
    motion.type, motion.index, motion.uid, motion.fps = stream, 0, uid, rate
    motion.fmt, motion.intrinsics = rs.format.motion_xyz32f, rs.motion_device_intrinsic()
    return motion


def _switch() -> Any:
    switch = rs.option_range()
    switch.min, switch.max, switch.step, switch.default = 0.0, 1.0, 1.0, 0.0
    return switch
