"""The ROS messages that hold what a record is about, losslessly: images, points and grids, there and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivers.ports import CameraFrame, LidarCloud
from drivers.ros.clouds import cloud_message, cloud_of
from drivers.ros.convert import grid_message
from drivers.ros.image_messages import color_message
from drivers.ros.messages import Message, header, make
from logs.trial.records import Cloud, Frame, MapUsed
from openbelief.arrays import Array
from openbelief.traversability import OccupancyGrid

COLOR, DEPTH = "/trial/frame/color", "/trial/frame/depth"
GRID, HEIGHTS, POINTS = "/trial/map/grid", "/trial/map/heights", "/trial/cloud/points"
TOPICS = (COLOR, DEPTH, GRID, HEIGHTS, POINTS)
CLOUD = "sensor_msgs/msg/PointCloud2"
IMAGE, OCCUPANCY = "sensor_msgs/msg/Image", "nav_msgs/msg/OccupancyGrid"

Pictures = dict[str, Message]  # topic -> the newest message there, until its record takes it
Written = tuple[str, str, int, Message]  # topic, type, stamp_ns, message


def frame_messages(frame: CameraFrame) -> Iterator[Written]:
    stamp_ns, frame_id = frame.stamp_ns, frame.frame_id
    yield COLOR, IMAGE, stamp_ns, color_message(stamp_ns, frame_id, frame.color)
    yield DEPTH, IMAGE, stamp_ns, _float_image(stamp_ns, frame_id, frame.depth_m)


def frame_of(record: Frame, pictures: Pictures) -> CameraFrame:
    color, depth = pictures.pop(COLOR), pictures.pop(DEPTH)
    pixels = np.frombuffer(color.data, np.uint8).reshape(color.height, color.width, 3)
    return CameraFrame(record.stamp_ns, pixels, _floats(depth), record.intrinsics.intrinsics(), record.frame_id)


def cloud_messages(cloud: LidarCloud) -> Iterator[Written]:
    yield POINTS, CLOUD, cloud.stamp_ns, cloud_message(cloud)


def lidar_cloud_of(record: Cloud, pictures: Pictures) -> LidarCloud:
    """Raises ValueError where the points are not those that the record names."""
    cloud = cloud_of(pictures.pop(POINTS))
    if len(cloud.points) != record.count:
        raise ValueError(f"the cloud has {len(cloud.points)} points, its record names {record.count}")
    return cloud


def grid_messages(grid: OccupancyGrid) -> Iterator[Written]:
    if grid.heights_m is not None:
        yield HEIGHTS, IMAGE, grid.stamp_ns, _float_image(grid.stamp_ns, "map", grid.heights_m)
    yield GRID, OCCUPANCY, grid.stamp_ns, grid_message(grid)


def grid_of(record: MapUsed, pictures: Pictures) -> OccupancyGrid:
    """The grid exactly as it was: its resolution is the record's, for the message's is a float32.

    Raises ValueError where it is not the one that the record names.
    """
    cells = np.asarray(pictures.pop(GRID).data, dtype=np.int8).reshape(record.shape)
    heights = _floats(pictures.pop(HEIGHTS)) if record.has_heights else None
    grid = OccupancyGrid(cells, record.resolution_m, record.origin_xy, record.stamp_ns, heights)
    if MapUsed.of(grid).sha256 != record.sha256:
        raise ValueError("the grid is not the one that the record names")
    return grid


def _float_image(stamp_ns: int, frame_id: str, values: Array) -> Message:
    """sensor_msgs/Image 32FC1: lossless."""
    pixels = np.ascontiguousarray(values, dtype="<f4")
    return make(
        IMAGE,
        header=header(stamp_ns, frame_id),
        height=pixels.shape[0],
        width=pixels.shape[1],
        encoding="32FC1",
        step=4 * pixels.shape[1],
        data=pixels.view(np.uint8).ravel(),
    )


def _floats(image: Message) -> Array:
    """(h, w) float32."""
    return np.frombuffer(np.ascontiguousarray(image.data), "<f4").reshape(image.height, image.width)
