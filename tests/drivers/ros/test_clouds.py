from __future__ import annotations

import numpy as np
import pytest

from drivers.ros.clouds import cloud_of
from drivers.ros.messages import WireError, decode, encode, make

POINTS = np.arange(1, 19, dtype=np.float32).reshape(6, 3)
XYZ = (("x", 0), ("y", 4), ("z", 8))


def cloud(*, pad=0, row_pad=0, height=1, big_endian=False, fields=XYZ, datatype=7, cut=0, sent_height=None, **changes):
    """The six points with bytes after each and after each row."""
    kind = {7: "f4", 8: "f8", 5: "i4"}[datatype]
    order = ">" if big_endian else "<"
    width, size = len(POINTS) // height, np.dtype(kind).itemsize
    step = 3 * size + pad
    rows = np.zeros((height, width * step + row_pad), np.uint8)
    raw = POINTS.astype(order + kind).view(np.uint8).reshape(height, width, -1)
    for i in range(width):
        rows[:, i * step : i * step + 3 * size] = raw[:, i]
    layout = {
        "height": height if sent_height is None else sent_height,
        "width": width,
        "is_bigendian": big_endian,
        "point_step": step,
        "row_step": rows.shape[1],
        "data": rows.ravel()[: rows.size - cut],
        "fields": [field(name, offset * size // 4, datatype) for name, offset in fields],
    }
    message = make("sensor_msgs/msg/PointCloud2", **(layout | changes))
    return decode(encode(message), "sensor_msgs/msg/PointCloud2")


def field(name, offset, datatype=7, count=1):
    return make("sensor_msgs/msg/PointField", name=name, offset=offset, datatype=datatype, count=count)


@pytest.mark.parametrize(
    "layout",
    [
        {},
        {"row_step": 0},
        {"pad": 5},
        {"height": 2, "row_pad": 7},
        {"height": 2, "row_pad": 7, "cut": 7},  # the last row without its padding
        {"big_endian": True, "pad": 4},
        {"datatype": 8},
        {"fields": (("z", 8), ("x", 0), ("y", 4))},
        {"fields": (*XYZ, ("intensity", 0))},
    ],
    ids=str,
)
def test_every_legal_layout_gives_the_points(layout):
    np.testing.assert_array_equal(cloud_of(cloud(**layout)).points, POINTS)


def test_fields_whose_count_was_left_zero_are_one_float():
    message = cloud(fields=())
    message.fields = [field(name, offset, count=0) for name, offset in XYZ]
    np.testing.assert_array_equal(cloud_of(message).points, POINTS)


def test_an_empty_cloud_is_a_cloud():
    assert cloud_of(cloud(width=0, data=np.zeros(0, np.uint8))).points.shape == (0, 3)


@pytest.mark.parametrize(
    ("layout", "why"),
    [
        ({"row_step": 5}, "has 72 bytes"),
        ({"width": 7, "row_step": 0}, "has 72 bytes"),
        ({"sent_height": 0}, "has 72 bytes"),
        ({"sent_height": 2**31, "width": 2**31, "row_step": 0}, "has 72 bytes"),
        ({"point_step": 0}, "do not fit"),
        ({"point_step": 11}, "do not fit"),
        ({"fields": (("x", 0), ("y", 4), ("z", 2**31 - 4))}, "do not fit"),
        ({"fields": (("x", 0), ("y", 4), ("z", 2**32 - 4))}, "do not fit"),
        ({"fields": (("x", 0), ("y", 4))}, "x of type 7, y of type 7"),
        ({"datatype": 5}, "of type 5"),
    ],
    ids=str,
)
def test_a_layout_that_its_bytes_do_not_hold_is_refused_before_anything_is_read(layout, why):
    with pytest.raises(WireError, match=why):
        cloud_of(cloud(**layout))
