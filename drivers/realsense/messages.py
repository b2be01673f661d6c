"""What a RealSense gives, and what its process says about it. No SDK here: both sides of the pipe import this."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from pydantic import AfterValidator
from pydantic.dataclasses import dataclass as settings

from drivers.ports import CameraFrame
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from openbelief.settings import CHECKED, Flag, Whole, in_one_line

DEPTH_SIZE = (848, 480)
COLOR_SIZES = ((848, 480), (1280, 720))
FPS = 30


class TimestampDomain(StrEnum):
    """Whose clock made a stamp."""

    GLOBAL = "global_time"  # the device's clock, fitted to this machine's by librealsense
    SYSTEM = "system_time"  # this machine's, when the image arrived over USB
    HARDWARE = "hardware_clock"  # the device's own


class CameraGone(Exception):
    """This attempt is over; a restart may help. The message is a sentence for the operator."""


class CameraRefused(CameraGone):
    """No restart helps; the operator has to change something."""


def _offered(size: tuple[int, int]) -> tuple[int, int]:
    if size not in COLOR_SIZES:
        raise ValueError(f"the camera offers {' and '.join(map(str, map(list, COLOR_SIZES)))}, not {list(size)}")
    return size


@in_one_line("Camera setting")
@settings(frozen=True, kw_only=True, config=CHECKED)
class RealSenseSettings:
    """serial: None takes the only camera there is. color_size: (width, height), what depth is aligned to as well.

    imu: False leaves the camera's IMU alone. Raises ValueError on a size that the camera does not offer.
    """

    serial: str | None = None
    color_size: Annotated[tuple[Whole, Whole], AfterValidator(_offered)] = (848, 480)
    frame_id: str = "camera_color_optical_frame"
    imu: Flag = True


@dataclass(frozen=True)
class RealSenseInfo:
    """The opened device. T_depth_color: (4, 4) p_depth = T_depth_color @ p_color; T_imu_color likewise.

    T_imu_color is None without an IMU, and in a played recording, which does not hold it.
    intrinsics are those of colour, which aligned depth shares; depth_intrinsics those of the depth imager.
    depth_unit_m: metres per count of depth. imu_trouble: why an IMU that is there could not be opened.
    """

    name: str
    serial: str
    firmware: str
    usb: str
    intrinsics: Intrinsics
    depth_intrinsics: Intrinsics
    depth_unit_m: float
    T_depth_color: Array
    has_imu: bool
    T_imu_color: Array | None
    imu_trouble: str | None = None


@dataclass(frozen=True)
class RealSenseFrame(CameraFrame):
    """A CameraFrame whose stamp is that of its colour image in our clock, with the device's own words beside it."""

    domain: TimestampDomain
    device_stamp_ns: int
    depth_device_stamp_ns: int
    color_number: int
    depth_number: int


@dataclass(frozen=True)
class CameraImuSample:
    """gyro_rad_s, acceleration_m_s2: (3,) float64 in the camera's IMU frame, which looks as an optical frame does.

    One per gyroscope sample; the acceleration is interpolated to it. Stamps as in RealSenseFrame.
    """

    stamp_ns: int
    gyro_rad_s: Array
    acceleration_m_s2: Array
    device_stamp_ns: int
    domain: TimestampDomain


@dataclass(frozen=True)
class Motion:
    """One raw sample of one of the IMU's two sensors. kind: "gyro" or "accel"."""

    kind: str
    device_stamp_ns: int
    domain: TimestampDomain
    value: tuple[float, float, float]


@dataclass(frozen=True)
class ImagePair:
    """Colour and aligned depth as the SDK hands them over. color: (h, w, 3) uint8 RGB. depth: (h, w) uint16 counts."""

    color: Array
    depth: Array
    color_number: int
    depth_number: int
    device_stamp_ns: int
    depth_device_stamp_ns: int
    domain: TimestampDomain


@dataclass(frozen=True)
class StreamCounts:
    """Since this attempt began. lost: numbers that never came. unpaired: colour or depth without its partner.

    frozen: images with an old number, an old stamp or the very pixels of the one before. no_slot: our side was slow.
    """

    frames: int = 0
    lost: int = 0
    unpaired: int = 0
    frozen: int = 0
    no_slot: int = 0


# From the camera's process


@dataclass(frozen=True)
class CameraOpened:
    info: RealSenseInfo


@dataclass(frozen=True)
class ProcessHeartbeat:
    """Alive, whether or not an image came."""

    counts: StreamCounts
    motions: tuple[Motion, ...]


@dataclass(frozen=True)
class FrameReady:
    """Slot `slot` of the shared buffer holds an image until it is handed back."""

    slot: int
    device_stamp_ns: int
    depth_device_stamp_ns: int
    color_number: int
    depth_number: int
    domain: TimestampDomain


@dataclass(frozen=True)
class ProcessEnded:
    """The last message. permanent: a restart cannot help."""

    reason: str
    permanent: bool


# To the camera's process


@dataclass(frozen=True)
class SlotFree:
    slot: int


@dataclass(frozen=True)
class StandStill:
    still: bool


@dataclass(frozen=True)
class StopProcess:
    pass
