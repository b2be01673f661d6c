"""What a recording knows of free space: the navigation map and the lidar's clouds, posed in the map frame."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from drivers.ports import LidarCloud, PoseUnavailable
from drivers.ros_clouds import cloud_of
from drivers.ros_convert import grid_of
from drivers.ros_messages import WireError, decode
from logs.frame_plan import RecordingError, scan
from logs.reader import LogReader
from openbelief.arrays import Array
from openbelief.traversability import OccupancyGrid

GRID, CLOUD = "nav_msgs/msg/OccupancyGrid", "sensor_msgs/msg/PointCloud2"


def navigation_map(path: str | os.PathLike[str], topic: str = "/map") -> OccupancyGrid:
    """The newest map of a topic, raises RecordingError where there is none and WireError where it cannot be used."""
    newest = None
    for message in LogReader(Path(path), prefix=True).messages({topic}):
        if message.type_name == GRID:
            newest = message
    if newest is None:
        raise RecordingError(f"{Path(path).name} holds no navigation map on {topic}.")
    return grid_of(decode(newest.payload, GRID))


def lidar_clouds(
    path: str | os.PathLike[str], *, map_frame: str = "map", max_tf_gap_s: float = 0.25
) -> Iterator[tuple[LidarCloud, Array]]:
    """Every cloud with its (4, 4) T_map_lidar; clouds that are unreadable or have no transform are left out."""
    log = LogReader(Path(path), prefix=True)
    tree = scan(log, max_tf_gap_s).tree
    for message in log:
        if message.type_name != CLOUD or message.encoding != "cdr":
            continue
        try:
            cloud = cloud_of(decode(message.payload, CLOUD))
            yield cloud, tree.lookup(cloud.stamp_ns, map_frame, cloud.frame_id)
        except (WireError, PoseUnavailable):
            continue  # thousands follow; a gap in the lidar leaves cells unknown, which are never driven through
