"""Maps, transforms, poses, IMU and battery as ROS messages and back. What a message cannot mean raises WireError."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.ros.messages import Message, WireError, header, make, stamp_to_ns
from openbelief.arrays import Array
from openbelief.pose import Pose2, quaternion_xyzw, transform
from openbelief.traversability import OccupancyGrid

FAR_M = 1e6
ALIGNED_RAD = 1e-3  # a grid turned by less against the map axes counts as aligned


@dataclass(frozen=True)
class StampedTransform:
    """One geometry_msgs/TransformStamped as it came: `TransformTree.add(**vars(t))` judges whether it is rigid."""

    stamp_ns: int
    parent: str
    child: str
    translation: list[float]
    quaternion_xyzw: list[float]


def imu_message(stamp_ns: int, frame_id: str, gyro_rad_s: Array, acceleration_m_s2: Array) -> Message:
    """sensor_msgs/Imu without an orientation (its first covariance says so: -1)."""
    rates, accelerations = (
        make("geometry_msgs/msg/Vector3", x=float(v[0]), y=float(v[1]), z=float(v[2]))
        for v in (gyro_rad_s, acceleration_m_s2)
    )
    return make(
        "sensor_msgs/msg/Imu",
        header=header(stamp_ns, frame_id),
        orientation_covariance=np.array([-1.0, *[0.0] * 8]),
        angular_velocity=rates,
        linear_acceleration=accelerations,
    )


UNMEASURED = dict.fromkeys(("voltage", "temperature", "current", "charge", "capacity", "design_capacity"), math.nan)


def battery_message(stamp_ns: int, fraction: float) -> Message:
    """sensor_msgs/BatteryState of a charge from 0 to 1; what else it could tell is NaN, as its definition asks."""
    told = {"percentage": fraction, "present": True}
    return make("sensor_msgs/msg/BatteryState", header=header(stamp_ns, ""), **UNMEASURED, **told)


def grid_of(message: Message) -> OccupancyGrid:
    """OccupancyGrid of a nav_msgs/OccupancyGrid whose axes are the map's; another frame or a turned grid is refused."""
    info = message.info
    q = info.origin.orientation
    require_map_frame(message.header.frame_id, "A navigation map")
    if abs(_yaw(q)) > ALIGNED_RAD or abs(q.x) > ALIGNED_RAD or abs(q.y) > ALIGNED_RAD:
        raise WireError("The map's origin is turned against the map axes: save it again without rotation.")
    if not (0 < info.width * info.height == len(message.data)) or not info.resolution > 0:
        raise WireError(
            f"A map of {info.width}x{info.height} cells of {info.resolution} m has {len(message.data)} values."
        )
    if message.data.min() < -1 or message.data.max() > 100:
        raise WireError("The cells of a map should be -1 to 100.")
    origin = (float(info.origin.position.x), float(info.origin.position.y))
    _require_near(*origin)
    cells = message.data.reshape(info.height, info.width).astype(np.int8)
    return OccupancyGrid(cells, float(str(np.float32(info.resolution))), origin, stamp_to_ns(message.header.stamp))


def grid_message(grid: OccupancyGrid) -> Message:
    """nav_msgs/OccupancyGrid, frame `map`."""
    height, width = grid.cells.shape
    head = header(grid.stamp_ns, "map")
    info = make(
        "nav_msgs/msg/MapMetaData",
        map_load_time=head.stamp,
        resolution=grid.resolution_m,
        width=width,
        height=height,
        origin=_pose(transform([*grid.origin_xy, 0.0], [0.0, 0.0, 0.0, 1.0])),
    )
    return make("nav_msgs/msg/OccupancyGrid", header=head, info=info, data=grid.cells.astype(np.int8).ravel())


def transforms_of(message: Message) -> list[StampedTransform]:
    """The transforms of a tf2_msgs/TFMessage."""
    return [
        StampedTransform(
            stamp_to_ns(t.header.stamp),
            t.header.frame_id,
            t.child_frame_id,
            [t.transform.translation.x, t.transform.translation.y, t.transform.translation.z],
            [t.transform.rotation.x, t.transform.rotation.y, t.transform.rotation.z, t.transform.rotation.w],
        )
        for t in message.transforms
    ]


def transforms_message(stamp_ns: int, edges: Sequence[tuple[str, str, Array]]) -> Message:
    """tf2_msgs/TFMessage of (parent, child, (4, 4) T_parent_child)."""
    return make("tf2_msgs/msg/TFMessage", transforms=[_transform_stamped(stamp_ns, *edge) for edge in edges])


def pose_of(message: Message) -> Pose2:
    """Pose2 of a geometry_msgs/PoseStamped in the map frame."""
    require_map_frame(message.header.frame_id, "A pose")
    position = message.pose.position
    _require_near(position.x, position.y)
    return Pose2(float(position.x), float(position.y), _yaw(message.pose.orientation))


def pose_message(pose: Pose2, stamp_ns: int = 0) -> Message:
    """geometry_msgs/PoseStamped, frame `map`; stamp 0 means the latest transform to tf2, whatever the clocks say."""
    return make("geometry_msgs/msg/PoseStamped", header=header(stamp_ns, "map"), pose=_pose(pose.matrix()))


def path_of(message: Message) -> Array:
    """(n, 2) float64, map frame, metres, of a nav_msgs/Path."""
    require_map_frame(message.header.frame_id, "A path")
    points = np.array([[p.pose.position.x, p.pose.position.y] for p in message.poses], dtype=float).reshape(-1, 2)
    _require_near(*points.ravel())
    return points


def path_message(path_xy: Array, stamp_ns: int) -> Message:
    """nav_msgs/Path of (n, 2) points, frame `map`."""
    poses = [pose_message(Pose2(float(x), float(y), 0.0), stamp_ns) for x, y in path_xy]
    return make("nav_msgs/msg/Path", header=header(stamp_ns, "map"), poses=poses)


def _require_near(*metres: float) -> None:
    """Larger coordinates would overflow in sums and squares of them, unnoticed."""
    if max(map(abs, metres), default=0.0) > FAR_M:
        raise WireError(f"A position of {max(map(abs, metres)):g} m is on no map.")


def require_map_frame(frame_id: str, what: str) -> None:
    if frame_id.lstrip("/") != "map":
        raise WireError(f"{what} should be in frame 'map', got {frame_id!r}.")


def _yaw(quaternion: Message) -> float:
    q = [quaternion.x, quaternion.y, quaternion.z, quaternion.w]
    try:
        T = transform([0.0, 0.0, 0.0], q)
    except ValueError as error:
        raise WireError(f"The quaternion {q} is not a rotation.") from error
    return float(np.arctan2(T[1, 0], T[0, 0]))


def _pose(T: Array) -> Message:
    x, y, z = (float(v) for v in T[:3, 3])
    position = make("geometry_msgs/msg/Point", x=x, y=y, z=z)
    return make("geometry_msgs/msg/Pose", position=position, orientation=_quaternion(T))


def _quaternion(T: Array) -> Message:
    x, y, z, w = (float(v) for v in quaternion_xyzw(T))
    return make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def _transform_stamped(stamp_ns: int, parent: str, child: str, T_parent_child: Array) -> Message:
    x, y, z = (float(v) for v in T_parent_child[:3, 3])
    translation = make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
    return make(
        "geometry_msgs/msg/TransformStamped",
        header=header(stamp_ns, parent),
        child_frame_id=child,
        transform=make("geometry_msgs/msg/Transform", translation=translation, rotation=_quaternion(T_parent_child)),
    )
