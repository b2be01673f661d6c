"""Lidar checks before a goal is sent and at arrival: obstacles on the path's first metres that the map lacks."""

from __future__ import annotations

import numpy as np

from behaviors.arrival import patiently, robot_pose
from behaviors.policy import MissionPolicy
from drivers.ports import Lidar, Ports
from openbelief.arrays import Array
from openbelief.clearance import crowded, goal_blocked, unmapped, way_blocked
from openbelief.pose import Pose2, apply

PathPrefix = tuple[tuple[float, float], ...]


def way_is_blocked(goal: Pose2, path_prefix: PathPrefix, ports: Ports, policy: MissionPolicy) -> str | None:
    """Why the goal, or the first metres of the way to it, cannot be taken now; None where they can, or without a lidar.

    Raises StaleData or PoseUnavailable where two seconds of asking bring no cloud.
    """
    if ports.lidar is None:
        return None
    found = _obstacles(ports.lidar, ports, policy)
    return goal_blocked(found, goal) or way_blocked(found, np.reshape(path_prefix, (-1, 2)))


def is_crowded(ports: Ports, policy: MissionPolicy) -> str | None:
    """Why the robot has no room where it arrived; None where it has, or without a lidar."""
    if ports.lidar is None:
        return None
    return crowded(_obstacles(ports.lidar, ports, policy), robot_pose(ports, policy))


def _obstacles(lidar: Lidar, ports: Ports, policy: MissionPolicy) -> Array:
    """(m, 2), map frame."""

    def posed() -> Array:
        cloud = lidar.latest(policy.cloud_max_age_s)
        return apply(ports.poses.transform_at(cloud.stamp_ns, cloud.frame_id), cloud.points)

    points = patiently(ports, posed)
    return unmapped(points, ports.map.latest(), robot_pose(ports, policy))
