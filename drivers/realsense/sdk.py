"""librealsense, the only driver module that imports it: find the device, set it up, stream aligned RGB-D and IMU.

Sensors and a syncer rather than a pipeline: the same path then serves a camera, a recording and a software device.
Everything here may hang with the SDK, so it runs in a process that can be killed (process.py).
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from drivers.realsense.libusb import ensure_libusb
from drivers.realsense.messages import (
    DEPTH_SIZE,
    FPS,
    CameraGone,
    CameraRefused,
    ImagePair,
    Motion,
    RealSenseInfo,
    RealSenseSettings,
    TimestampDomain,
)
from openbelief.arrays import Array
from openbelief.observation import Intrinsics

ensure_libusb()

import pyrealsense2 as rs  # noqa: E402 - needs libusb

RANGE_M = (0.2, 6.0)  # nearer the D435i cannot match at 848x480; farther its noise passes 5 cm
MAX_SKEW_NS = 17_000_000  # half a frame between colour and depth
MAX_MODEL_ERROR_PX = 0.5
IMU_QUEUE = 2048  # three seconds of both sensors
IMU_MAX_HZ = 250
IMU_STREAMS = (rs.stream.accel, rs.stream.gyro)
DOMAINS = {
    rs.timestamp_domain.global_time: TimestampDomain.GLOBAL,
    rs.timestamp_domain.system_time: TimestampDomain.SYSTEM,
    rs.timestamp_domain.hardware_clock: TimestampDomain.HARDWARE,
}
# Stream -> options set on its sensor where it has them. Auto-exposure must not halve the colour rate in the dark.
OPTIONS = {
    rs.stream.depth: (
        (rs.option.emitter_enabled, 1.0),
        (rs.option.enable_auto_exposure, 1.0),
        (rs.option.global_time_enabled, 1.0),
    ),
    rs.stream.color: (
        (rs.option.enable_auto_exposure, 1.0),
        (rs.option.auto_exposure_priority, 0.0),
        (rs.option.global_time_enabled, 1.0),
    ),
    rs.stream.gyro: ((rs.option.global_time_enabled, 1.0),),
}
MODELS_AS_OPENCV = (rs.distortion.brown_conrady, rs.distortion.inverse_brown_conrady)


class UsbBus:
    """This machine's USB (drivers.realsense.bus.Bus)."""

    def __init__(self) -> None:
        self._context = rs.context()

    def devices(self) -> list[tuple[str, Any]]:
        found = []
        for device in self._context.query_devices():
            with suppress(RuntimeError):  # a device that leaves the bus while we ask is not there
                found.append((_info(device, rs.camera_info.serial_number), device))
        return found


def open_recording(path: Path) -> Any:
    """A recording made by librealsense (.db3 or .bag) as a device that plays as fast as it is read."""
    if not path.is_file():
        raise CameraRefused(f"There is no RealSense recording {path}.")
    try:
        device = rs.context().load_device(str(path))
    except RuntimeError as error:
        raise CameraRefused(f"{path} cannot be played by librealsense {rs.__version__}: {error}") from error
    device.set_real_time(False)
    return device


def _info(device: Any, key: Any) -> str:
    return str(device.get_info(key)) if device.supports(key) else "unknown"


def refuse_slow_usb(device: Any) -> str:
    """The USB version, e.g. "3.2". Raises CameraRefused on USB 2 and older."""
    usb = _info(device, rs.camera_info.usb_type_descriptor)
    if usb.split(".")[0] in ("1", "2"):
        raise CameraRefused(
            f"The camera is connected with USB {usb}, too slow for depth and colour at {FPS} images/s: use a USB 3 "
            "port (blue or marked SS) and a USB 3 cable, pushed in fully, without a hub."
        )
    return usb


def intrinsics_of(profile: Any) -> Intrinsics:
    """Per-profile intrinsics in OpenCV's terms, checked against librealsense's own geometry.

    librealsense calls OpenCV's model Brown-Conrady; its "inverse" one differs by a tangential term of the second order.
    Raises CameraRefused where the two differ by more than MAX_MODEL_ERROR_PX anywhere in the image.
    """
    raw = profile.as_video_stream_profile().get_intrinsics()
    coefficients = tuple(float(c) for c in raw.coeffs) if raw.model in MODELS_AS_OPENCV else ()
    ours = Intrinsics(
        raw.width, raw.height, raw.fx, raw.fy, raw.ppx, raw.ppy, coefficients if any(coefficients) else ()
    )
    error_px = _model_error_px(raw, ours)
    if not error_px <= MAX_MODEL_ERROR_PX:
        raise CameraRefused(
            f"The lens model {str(raw.model).split('.')[-1]} with coefficients {list(raw.coeffs)} has no OpenCV "
            f"equivalent (off by {error_px:.1f} px): recalibrate the camera."
        )
    return ours


def _model_error_px(raw: Any, ours: Intrinsics) -> float:
    """The largest distance, over a grid, between where the SDK and where we see the same ray."""
    pixels = [[u, v] for u in np.linspace(0, raw.width - 1, 9) for v in np.linspace(0, raw.height - 1, 7)]
    rays = np.array([rs.rs2_deproject_pixel_to_point(raw, pixel, 1.0) for pixel in pixels])
    theirs = np.array([rs.rs2_project_point_to_pixel(raw, list(ray)) for ray in rays])
    seen = ours.project(rays)
    return float(max(np.abs(seen - pixels).max(), np.abs(seen - theirs).max()))


def _transform(source: Any, target: Any) -> Array:
    """(4, 4) p_target = T @ p_source."""
    extrinsics = source.get_extrinsics_to(target)
    T = np.eye(4)
    T[:3, :3] = np.reshape(extrinsics.rotation, (3, 3), order="F")
    T[:3, 3] = extrinsics.translation
    return T


class DepthFilters:
    """Range, then noise: in disparity, where the D435i's noise is even; no hole is filled."""

    def __init__(self) -> None:
        self._range = rs.threshold_filter(*RANGE_M)
        self._to_disparity, self._to_depth = rs.disparity_transform(True), rs.disparity_transform(False)
        self._spatial = rs.spatial_filter()
        self._temporal: Any | None = None
        self._align = rs.align(rs.stream.color)

    def stand_still(self, still: bool) -> None:
        """Average over time only while nothing moves; each standstill begins without memory."""
        self._temporal = rs.temporal_filter() if still else None

    def aligned(self, frames: Any) -> Any:
        """rs.composite_frame in, the same with filtered depth in the colour image's pixels out."""
        temporal = [] if self._temporal is None else [self._temporal]
        for step in (self._range, self._to_disparity, self._spatial, *temporal, self._to_depth, self._align):
            frames = step.process(frames).as_frameset()
        return frames


class SdkStream:
    """One opened device. `pair` and `motions` are polled; whatever the SDK throws comes out as CameraGone."""

    def __init__(self, device: Any, settings: RealSenseSettings) -> None:
        self._device = device
        self._usb = refuse_slow_usb(device)
        self._imu_trouble: str | None = None
        self._profiles = self._chosen_profiles(settings)
        self._filters = DepthFilters()
        self._syncer, self._imu = rs.syncer(), rs.frame_queue(IMU_QUEUE, keep_frames=True)
        self._running: list[Any] = []
        self.unpaired = 0  # images whose partner did not come

    def start(self) -> RealSenseInfo:
        """Set the options and start every sensor. `close` also after a failure."""
        try:
            for sensor, streams in list(self._sensors()):
                self._start_sensor(sensor, streams)
            return self._describe()
        except RuntimeError as error:
            raise CameraGone(f"librealsense could not start it ({error})") from error

    def _start_sensor(self, sensor: Any, streams: list[Any]) -> None:
        """An IMU that cannot be started is left out: it may not take the camera down."""
        is_imu = not set(streams) - set(IMU_STREAMS)
        try:
            _set_options(sensor, streams)
            sensor.open([self._profiles[stream] for stream in streams])
            self._running.append(sensor)
            sensor.start(self._imu if is_imu else self._syncer)
        except RuntimeError as error:
            if not is_imu:
                raise
            self._leave_out_imu(error)
            if sensor in self._running:
                self._running.remove(sensor)
                with suppress(RuntimeError):
                    sensor.close()

    def _leave_out_imu(self, error: RuntimeError) -> None:
        self._imu_trouble = str(error)
        for stream in IMU_STREAMS:
            self._profiles.pop(stream, None)

    def close(self) -> None:
        while self._running:
            sensor = self._running.pop()
            with suppress(RuntimeError):  # a device that is gone cannot be stopped
                sensor.stop()
                sensor.close()

    def stand_still(self, still: bool) -> None:
        self._filters.stand_still(still)

    def pair(self, timeout_s: float) -> ImagePair | None:
        """Colour and depth of one moment; None where nothing, or only one of them, came in time."""
        try:
            arrived, frames = self._syncer.try_wait_for_frames(round(timeout_s * 1e3))
            if not arrived:
                self._refuse_the_end()
                return None
            return self._pair(frames)
        except RuntimeError as error:
            raise CameraGone(f"librealsense failed ({error})") from error

    def motions(self) -> list[Motion]:
        """The IMU samples since the last call."""
        return [_motion(frame) for frame in _drained(self._imu)]

    def _pair(self, frames: Any) -> ImagePair | None:
        depth, color = frames.get_depth_frame(), frames.get_color_frame()
        if not _one_moment(depth, color):
            self.unpaired += 1
            return None
        aligned = self._filters.aligned(frames)
        return ImagePair(
            color=np.asanyarray(color.get_data()),
            depth=np.asanyarray(aligned.get_depth_frame().get_data()),
            color_number=color.get_frame_number(),
            depth_number=depth.get_frame_number(),
            device_stamp_ns=_stamp_ns(color),
            depth_device_stamp_ns=_stamp_ns(depth),
            domain=_domain(color),
        )

    def _refuse_the_end(self) -> None:
        if self._device.is_playback() and self._device.as_playback().current_status() == rs.playback_status.stopped:
            raise CameraRefused("The recording is over.")
        if not self._device.is_connected():
            raise CameraGone("it was disconnected")

    def _describe(self) -> RealSenseInfo:
        color, depth = self._profiles[rs.stream.color], self._profiles[rs.stream.depth]
        unit_m = next(s for s, streams in self._sensors() if rs.stream.depth in streams).get_option(
            rs.option.depth_units
        )
        return RealSenseInfo(
            name=_info(self._device, rs.camera_info.name),
            serial=_info(self._device, rs.camera_info.serial_number),
            firmware=_info(self._device, rs.camera_info.firmware_version),
            usb=self._usb,
            intrinsics=intrinsics_of(color),
            depth_intrinsics=intrinsics_of(depth),
            depth_unit_m=round(unit_m, 9),  # librealsense's float32 0.001 is 0.0010000000475
            T_depth_color=_transform(color, depth),
            has_imu=all(stream in self._profiles for stream in IMU_STREAMS),
            T_imu_color=self._imu_extrinsics(color),
            imu_trouble=self._imu_trouble,
        )

    def _imu_extrinsics(self, color: Any) -> Array | None:
        """(4, 4) T_imu_color; None without an IMU, or where its calibration is not to be had."""
        gyro = self._profiles.get(rs.stream.gyro)
        if gyro is None or self._device.is_playback():  # 2.59's recorder leaves it out
            return None
        try:
            return _transform(color, gyro)
        except RuntimeError as error:
            self._imu_trouble = f"its place is not known ({error})"
            return None

    def _sensors(self) -> Iterator[tuple[Any, list[Any]]]:
        """(sensor, the streams that we take of it)."""
        for sensor in self._device.query_sensors():
            offered = {profile.stream_type() for profile in self._offered(sensor)}
            streams = [stream for stream in self._profiles if stream in offered]
            if streams:
                yield sensor, streams

    def _offered(self, sensor: Any) -> list[Any]:
        """A sensor's profiles. A motion module that cannot even tell them is left out."""
        try:
            return list(sensor.get_stream_profiles())
        except RuntimeError as error:
            if not sensor.is_motion_sensor():
                raise
            self._imu_trouble = str(error)
            return []

    def _chosen_profiles(self, settings: RealSenseSettings) -> dict[Any, Any]:
        """stream -> profile. Raises CameraRefused where colour or depth is not offered; an IMU may be missing."""
        try:
            offered = [profile for sensor in self._device.query_sensors() for profile in self._offered(sensor)]
        except RuntimeError as error:
            raise CameraGone(f"librealsense could not ask it what it offers ({error})") from error
        wanted = {
            rs.stream.depth: (DEPTH_SIZE, rs.format.z16),
            rs.stream.color: (settings.color_size, rs.format.rgb8),
        }
        chosen = {stream: _video(offered, stream, size, kind) for stream, (size, kind) in wanted.items()}
        for stream in IMU_STREAMS if settings.imu else ():
            rates = [p for p in offered if p.stream_type() == stream and p.fps() <= IMU_MAX_HZ]
            if rates:
                chosen[stream] = max(rates, key=lambda profile: profile.fps())
        return chosen


def _video(offered: list[Any], stream: Any, size: tuple[int, int], kind: Any) -> Any:
    for profile in offered:
        if (profile.stream_type(), profile.format(), profile.fps()) == (stream, kind, FPS):
            video = profile.as_video_stream_profile()
            if (video.width(), video.height()) == size:
                return profile
    raise CameraRefused(
        f"The camera offers no {stream.name} of {size[0]}x{size[1]} at {FPS} images/s: is it a D435i on USB 3?"
    )


def _set_options(sensor: Any, streams: list[Any]) -> None:
    for stream in streams:
        for option, value in OPTIONS.get(stream, ()):
            if sensor.supports(option) and not sensor.is_option_read_only(option):
                sensor.set_option(option, value)


def _one_moment(depth: Any, color: Any) -> bool:
    """Whether both are there and belong together; a missing frame is false."""
    if not depth or not color or _domain(depth) != _domain(color):
        return False
    return abs(_stamp_ns(depth) - _stamp_ns(color)) <= MAX_SKEW_NS


def _domain(frame: Any) -> TimestampDomain:
    return DOMAINS[frame.get_frame_timestamp_domain()]


def _stamp_ns(frame: Any) -> int:
    """Milliseconds as a double hold 0.3 us at today's epoch."""
    return round(frame.get_timestamp() * 1e6)


def _drained(queue: Any) -> Iterator[Any]:
    while frame := queue.poll_for_frame():
        yield frame


def _motion(frame: Any) -> Motion:
    data = frame.as_motion_frame().get_motion_data()
    kind = "gyro" if frame.get_profile().stream_type() == rs.stream.gyro else "accel"
    return Motion(kind, _stamp_ns(frame), _domain(frame), (data.x, data.y, data.z))
