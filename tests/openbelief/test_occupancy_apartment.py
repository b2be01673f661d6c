"""The grid made from the apartment's lidar, against the map that its navigation used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivers.ros.clouds import cloud_of
from drivers.ros.convert import grid_of, transforms_of
from drivers.ros.messages import decode
from drivers.ros.transform_tree import TransformTree
from logs.mcap_io.reader import LogReader
from openbelief.occupancy import floor_height, from_points
from openbelief.pose import apply
from openbelief.traversability import FREE, OCCUPIED, OccupancyGrid

APARTMENT = Path(__file__).resolve().parents[2].parent / "shared" / "recordings" / "apartment.mcap"
pytestmark = [
    pytest.mark.recordings,
    pytest.mark.skipif(not APARTMENT.exists(), reason="shared/recordings/apartment.mcap is not beside the checkout"),
]


@pytest.fixture(scope="module")
def walk() -> tuple[np.ndarray, OccupancyGrid]:
    """((n, 3) lidar hits in the map frame, Nav2's map)."""
    tree, clouds, maps = TransformTree(), [], []
    for message in LogReader(APARTMENT).messages({"/livox/lidar", "/tf", "/tf_static", "/map"}):
        decoded = decode(message.payload, message.type_name)
        if message.topic == "/map":
            maps.append(grid_of(decoded))
        elif message.topic == "/livox/lidar":
            clouds.append(cloud_of(decoded))
        else:
            for transform in transforms_of(decoded):
                tree.add(**vars(transform), static=message.topic == "/tf_static")
    points = [apply(tree.lookup(c.stamp_ns, "map", c.frame_id), c.points) for c in clouds]
    return np.concatenate(points), maps[-1]


def test_the_apartments_floor_is_found_to_a_centimetre(walk: tuple[np.ndarray, OccupancyGrid]) -> None:
    assert floor_height(walk[0]) == pytest.approx(0.0, abs=0.01)


def test_a_grid_from_lidar_agrees_with_the_apartments_own_map(walk: tuple[np.ndarray, OccupancyGrid]) -> None:
    from scipy.ndimage import distance_transform_edt

    points, navigation = walk
    seen = from_points(points).at(navigation.centre(np.argwhere(np.ones(navigation.cells.shape))))
    seen = seen.reshape(navigation.cells.shape)
    to_obstacle_m = distance_transform_edt(navigation.cells < OCCUPIED) * navigation.resolution_m
    assert (to_obstacle_m[seen == OCCUPIED] <= 0.1).mean() > 0.98  # no obstacle is invented
    assert (navigation.cells[seen == FREE] == FREE).mean() > 0.93  # the map counts things from 0.1 m up, we from 0.2 m
    assert (seen[navigation.cells == FREE] == FREE).mean() > 0.5  # what the walk never looked at stays unknown
