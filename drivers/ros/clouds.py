"""sensor_msgs/PointCloud2 to LidarCloud and back."""

from __future__ import annotations

import numpy as np

from drivers.livox.assembler import LivoxCloud
from drivers.ports import LidarCloud
from drivers.ros.messages import Message, WireError, header, make, stamp_to_ns

FLOATS = {7: "f4", 8: "f8"}  # sensor_msgs/PointField datatypes
DATATYPES = {"f4": 7, "f8": 8, "u1": 2}
FIELDS = (("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4"), ("tag", "u1"), ("line", "u1"))
TIMED_FIELDS = (*FIELDS, ("timestamp", "f8"))  # livox_ros_driver2's LivoxPointXyzrtlt, packed: 26 bytes


def cloud_of(message: Message) -> LidarCloud:
    """LidarCloud of a sensor_msgs/PointCloud2; points that are not finite, or exactly at 0, are no-returns."""
    dtype = _point_dtype(message)
    count = message.width * message.height
    if message.row_step != message.width * message.point_step or len(message.data) != count * message.point_step:
        raise WireError(f"A cloud of {count} points of {message.point_step} bytes has {len(message.data)} bytes.")
    raw = np.ascontiguousarray(message.data).view(dtype)
    points = np.column_stack([raw[axis] for axis in "xyz"]).astype(np.float32)
    returned = np.isfinite(points).all(axis=1) & points.any(axis=1)
    return LidarCloud(stamp_to_ns(message.header.stamp), points[returned], message.header.frame_id)


def _point_dtype(message: Message) -> np.dtype:
    fields = {f.name: f for f in message.fields if f.name in ("x", "y", "z")}
    order = ">" if message.is_bigendian else "<"
    if len(fields) != 3 or any(f.datatype not in FLOATS or f.count != 1 for f in fields.values()):
        raise WireError("A cloud should have the fields x, y and z, each one float.")
    formats = [order + FLOATS[f.datatype] for f in fields.values()]
    try:
        return np.dtype(
            {
                "names": list(fields),
                "formats": formats,
                "offsets": [f.offset for f in fields.values()],
                "itemsize": message.point_step,
            }
        )
    except ValueError as error:
        raise WireError(f"The fields of this cloud do not fit its point step of {message.point_step}.") from error


def cloud_message(cloud: LidarCloud) -> Message:
    """sensor_msgs/PointCloud2 with livox_ros_driver2's fields.

    Of a LivoxCloud all of them: intensity is the reflectivity, timestamp each point's time in ns since the epoch (a
    float64 of today holds 0.26 us); line is 0, the packets do not tell it. Another cloud has intensity, tag and line 0,
    and no timestamp.
    """
    fields = TIMED_FIELDS if isinstance(cloud, LivoxCloud) else FIELDS
    points = np.zeros(len(cloud.points), [(name, f"<{kind}") for name, kind in fields])
    for i, axis in enumerate("xyz"):
        points[axis] = cloud.points[:, i]
    if isinstance(cloud, LivoxCloud):
        points["intensity"], points["tag"] = cloud.reflectivity, cloud.tag
        points["timestamp"] = cloud.stamp_ns + cloud.offset_ns
    return make(
        "sensor_msgs/msg/PointCloud2",
        header=header(cloud.stamp_ns, cloud.frame_id),
        height=1,
        width=len(points),
        fields=[_point_field(name, kind, points.dtype) for name, kind in fields],
        point_step=points.itemsize,
        row_step=points.nbytes,
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )


def _point_field(name: str, kind: str, dtype: np.dtype) -> Message:
    offset = dtype.fields[name][1] if dtype.fields else 0
    return make("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=DATATYPES[kind], count=1)
