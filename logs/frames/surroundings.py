"""What a recording knows of free space: the navigation map and the lidar's clouds, posed in the map frame."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drivers.ports import LidarCloud, PoseUnavailable
from drivers.ros.clouds import cloud_of
from drivers.ros.messages import WireError, decode
from logs.containers.recording import Recording
from logs.frames.clock_steps import Mark
from logs.frames.reader import MAX_TF_GAP_S, FrameReader, RecordingError
from logs.frames.scan import scan
from openbelief.arrays import Array
from openbelief.backprojection import backproject
from openbelief.observation import RgbdFrame
from openbelief.occupancy import from_points
from openbelief.parameters import Parameters
from openbelief.pose import apply
from openbelief.traversability import OccupancyGrid

MAP_FRAME = "map"
DEPTH_STEP_PX = 8  # the floor is flat: a sixty-fourth of the pixels shows it, and 100 frames stay below a second
GRID, CLOUD = "nav_msgs/msg/OccupancyGrid", "sensor_msgs/msg/PointCloud2"


def grid_from_what_was_seen(path: str | os.PathLike[str]) -> OccupancyGrid:
    """A grid for a recording without a navigation map, from every lidar hit and every eighth row and column of depth.

    Raises RecordingError where the recording holds neither with its transforms.
    """
    hits = [apply(T_map_lidar, cloud.points) for cloud, T_map_lidar in lidar_clouds(path)]
    try:
        hits += [_depth_hits(frame) for frame in FrameReader(path)]
    except RecordingError:
        if not hits:
            raise  # neither lidar nor camera; it says what is missing
    if not sum(len(points) for points in hits):
        raise RecordingError(
            f"{Path(path).name} holds no navigation map, and neither lidar nor depth to make one from."
        )
    return from_points(np.concatenate(hits))


def _depth_hits(frame: RgbdFrame) -> Array:
    """(n, 3), map frame: a sixty-fourth of a frame's depth."""
    sparse = np.zeros(frame.depth_m.shape, dtype=bool)
    sparse[::DEPTH_STEP_PX, ::DEPTH_STEP_PX] = True
    return backproject(sparse, frame, Parameters())


def lidar_clouds(path: str | os.PathLike[str]) -> Iterator[tuple[LidarCloud, Array]]:
    """Every cloud with its (4, 4) T_map_lidar; clouds that are unreadable or have no transform are left out."""
    log = Recording(path)
    found = scan(log, MAX_TF_GAP_S)
    for order, message in enumerate(log):
        if message.type_name != CLOUD or message.encoding != "cdr":
            continue
        try:
            cloud = cloud_of(decode(message.payload, CLOUD))
            epoch = found.epochs.of_mark(Mark(order, message.log_time_ns, cloud.stamp_ns))
            yield cloud, found.trees[epoch].lookup(cloud.stamp_ns, MAP_FRAME, cloud.frame_id)
        except (WireError, PoseUnavailable):
            continue  # thousands follow; a gap in the lidar leaves cells unknown, which are never driven through
