"""sensor_msgs/PointCloud2 to LidarCloud and back."""

from __future__ import annotations

import numpy as np

from drivers.ports import LidarCloud
from drivers.ros_messages import Message, WireError, header, make, stamp_to_ns

FLOATS = {7: "f4", 8: "f8"}  # sensor_msgs/PointField datatypes
LIVOX_FIELDS = [("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4"), ("tag", "u1"), ("line", "u1")]
LIVOX_DATATYPES = {"f4": 7, "u1": 2}
LIVOX_POINT = np.dtype([(name, f"<{kind}") for name, kind in LIVOX_FIELDS])  # livox_ros_driver2, packed: 18 bytes


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
    """sensor_msgs/PointCloud2 with livox_ros_driver2's fields (intensity, tag and line 0)."""
    points = np.zeros(len(cloud.points), LIVOX_POINT)
    for i, axis in enumerate("xyz"):
        points[axis] = cloud.points[:, i]
    offsets = np.cumsum([0, *(LIVOX_POINT[name].itemsize for name, _ in LIVOX_FIELDS)])
    fields = [
        make("sensor_msgs/msg/PointField", name=name, offset=int(offset), datatype=LIVOX_DATATYPES[kind], count=1)
        for (name, kind), offset in zip(LIVOX_FIELDS, offsets, strict=False)
    ]
    return make(
        "sensor_msgs/msg/PointCloud2",
        header=header(cloud.stamp_ns, cloud.frame_id),
        height=1,
        width=len(points),
        fields=fields,
        point_step=LIVOX_POINT.itemsize,
        row_step=points.nbytes,
        data=points.view(np.uint8).ravel(),
        is_dense=True,
    )
