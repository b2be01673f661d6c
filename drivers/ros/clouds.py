"""sensor_msgs/PointCloud2 to LidarCloud and back."""

from __future__ import annotations

import numpy as np

from drivers.livox.assembler import LivoxCloud
from drivers.ports import LidarCloud
from drivers.ros.messages import Message, WireError, codec, header, make, stamp_to_ns
from openbelief.arrays import Array

FLOATS = {7: "f4", 8: "f8"}  # sensor_msgs/PointField datatypes
DATATYPES = {"f4": 7, "f8": 8, "u1": 2}
FIELDS = (("x", "f4"), ("y", "f4"), ("z", "f4"), ("intensity", "f4"), ("tag", "u1"), ("line", "u1"))
TIMED_FIELDS = (*FIELDS, ("timestamp", "f8"))  # livox_ros_driver2's LivoxPointXyzrtlt, packed: 26 bytes

CUSTOM_MSG = "livox_ros_driver2/msg/CustomMsg"


class CloudDecoder:
    """A decoder of clouds that knows Livox's own message when one comes in a cloud's place."""

    def __init__(self) -> None:
        self._shapes = codec()

    def decode(self, payload: bytes, type_name: str) -> Message:
        """Raises WireError; its text names CustomMsg where it is one."""
        try:
            return self._shapes.decode(payload, type_name)
        except WireError as error:
            try:
                self._shapes.decode(payload, CUSTOM_MSG)
            except WireError:
                raise error from None
            raise WireError(
                "This is a livox CustomMsg, not a PointCloud2: set xfer_format to 0 in the livox driver's launch file, "
                "and start it again."
            ) from error


def cloud_of(message: Message) -> LidarCloud:
    """LidarCloud of a sensor_msgs/PointCloud2; points that are not finite, or exactly at 0, are no-returns.

    Rows may have padding, row_step may be left 0, a field's count too. Raises WireError.
    """
    points = np.column_stack([_packed(message)[axis].ravel() for axis in "xyz"]).astype(np.float32)
    returned = np.isfinite(points).all(axis=1) & points.any(axis=1)
    return LidarCloud(stamp_to_ns(message.header.stamp), points[returned], message.header.frame_id)


def _packed(message: Message) -> Array:
    """(height, width) records with x, y and z, a view of the message's bytes: every size is checked against them."""
    dtype = _point_dtype(message)
    width, height, step = int(message.width), int(message.height), int(message.point_step)
    row = int(message.row_step) or width * step
    needed = (height - 1) * row + width * step if height else 0
    data = np.ascontiguousarray(message.data).view(np.uint8)
    if row < width * step or needed > data.nbytes or (data.nbytes and not width * height):
        raise WireError(
            f"A cloud of {height} rows of {width} points of {step} bytes, {row} a row, has {data.nbytes} bytes."
        )
    if not width * height:
        return np.zeros((0, 0), dtype)
    return np.ndarray((height, width), dtype, data, strides=(row, step))


def _point_dtype(message: Message) -> np.dtype:
    fields = {f.name: f for f in message.fields if f.name in ("x", "y", "z")}
    order = ">" if message.is_bigendian else "<"
    if len(fields) != 3 or any(f.datatype not in FLOATS or f.count > 1 for f in fields.values()):
        kinds = ", ".join(f"{f.name} of type {f.datatype}" for f in message.fields) or "none"
        raise WireError(f"A cloud should have the fields x, y and z, each one float; it has: {kinds}.")
    formats = {name: np.dtype(order + FLOATS[f.datatype]) for name, f in fields.items()}
    # Not left to numpy: an offset near 2^31 overflows there and kills the process
    if any(f.offset + formats[name].itemsize > message.point_step for name, f in fields.items()):
        raise WireError(f"The fields of this cloud do not fit its point step of {message.point_step}.")
    return np.dtype(
        {
            "names": list(fields),
            "formats": list(formats.values()),
            "offsets": [int(f.offset) for f in fields.values()],
            "itemsize": int(message.point_step),
        }
    )


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
