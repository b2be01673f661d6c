"""What the camera sees where the robot stands now, and from where (paper: the arrival RGB-D observation)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from behaviors.policy import MissionPolicy
from drivers.ports import CameraFrame, Ports, PoseUnavailable, StaleData
from openbelief.arrays import Array
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.pose import Pose2, inverse

BASE_FRAME = "base_link"
SETTLE_S = 0.5  # a humanoid sways after its last step
TRIES, BETWEEN_TRIES_S = 20, 0.1  # a frame and its transform arrive on separate streams, some late
FIRST_FRAME = 150, 0.02  # as often, the first one at 15 Hz is not waited for longer than it takes

Answer = TypeVar("Answer")


@dataclass(frozen=True)
class CameraMount:
    """Where the camera sits on the robot, and what it can see; the base is planar, on the map's floor (z = 0)."""

    T_base_camera: Array
    intrinsics: Intrinsics


def arrival_frame(index: int, stood_ns: int | None, ports: Ports, policy: MissionPolicy) -> RgbdFrame:
    """The first frame stamped after the robot was seen to stand still, with its pose at the frame's own stamp.

    stood_ns: that moment, by the robot's clock; None in old trials, which waited a while instead.
    Raises StaleData or PoseUnavailable where three seconds of asking bring none.
    """
    if stood_ns is None:
        ports.clock.sleep(SETTLE_S + policy.camera_max_age_s)
        frame, T_map_camera = patiently(ports, lambda: _posed_frame(ports, policy.camera_max_age_s))
    else:
        frame, T_map_camera = patiently(ports, lambda: _frame_since(stood_ns, ports, policy), *FIRST_FRAME)
    return RgbdFrame(index, frame.stamp_ns, frame.color, frame.depth_m, frame.intrinsics, T_map_camera)


def camera_mount(ports: Ports, policy: MissionPolicy) -> CameraMount:
    """Measured from a frame and the transforms at its stamp, never assumed."""
    return patiently(ports, lambda: _measured(ports, policy))


def robot_pose(ports: Ports, policy: MissionPolicy) -> Pose2:
    """Where the robot is now; raises StaleData where two seconds of asking bring nothing fresh."""
    return patiently(ports, lambda: ports.poses.robot_pose(policy.pose_max_age_s))


def patiently(
    ports: Ports, ask: Callable[[], Answer], tries: int = TRIES, between_s: float = BETWEEN_TRIES_S
) -> Answer:
    """Ask again, within bounds, while data is late; the last refusal is raised."""
    for _ in range(tries - 1):
        try:
            return ask()
        except (StaleData, PoseUnavailable):
            ports.clock.sleep(between_s)
    return ask()


def _measured(ports: Ports, policy: MissionPolicy) -> CameraMount:
    frame, T_map_camera = _posed_frame(ports, policy.camera_max_age_s)
    base = Pose2.from_matrix(ports.poses.transform_at(frame.stamp_ns, BASE_FRAME))
    return CameraMount(inverse(base.matrix()) @ T_map_camera, frame.intrinsics)


def _frame_since(stood_ns: int, ports: Ports, policy: MissionPolicy) -> tuple[CameraFrame, Array]:
    """By its age: what is as old as the moment at which the robot stood was not taken after it."""
    since_s = (ports.clock.now_ns() - stood_ns) / 1e9
    return _posed_frame(ports, min(since_s, policy.camera_max_age_s))


def _posed_frame(ports: Ports, max_age_s: float) -> tuple[CameraFrame, Array]:
    frame = ports.camera.latest(max_age_s)
    return frame, ports.poses.transform_at(frame.stamp_ns, frame.frame_id)
