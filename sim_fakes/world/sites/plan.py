"""The navigation map of a site: walls around its rooms, a door from each to the corridor, furniture as obstacles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from openbelief.arrays import Array
from openbelief.traversability import FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from sim_fakes.world.sites.layout import Placed, RoomBox

CELL_M, MARGIN_M = 0.05, 0.5
WALL_M, DOOR_M = 0.1, 0.9


def site_map(rooms: Sequence[RoomBox], placed: Sequence[Placed]) -> OccupancyGrid:
    """As a lidar walked through all rooms draws it; the last room is the corridor, which all others lie at."""
    boxes = np.array([[room.x0, room.y0, room.x1, room.y1] for room in rooms])
    low = np.floor((boxes[:, :2].min(axis=0) - MARGIN_M) / CELL_M) * CELL_M
    columns, rows = np.ceil((boxes[:, 2:].max(axis=0) + MARGIN_M - low) / CELL_M).astype(int)
    grid = OccupancyGrid(np.full((rows, columns), UNKNOWN, np.int8), CELL_M, (float(low[0]), float(low[1])))
    xy = grid.centre(np.argwhere(grid.cells == UNKNOWN)).reshape(rows, columns, 2)
    for box in boxes:
        grid.cells[_within(xy, box, WALL_M / 2) & ~_within(xy, box, -WALL_M / 2)] = OCCUPIED
    for box in boxes:
        grid.cells[_within(xy, box, -WALL_M / 2)] = FREE
    for box in boxes[:-1]:
        grid.cells[_within(xy, _door(box, boxes[-1]), 0.0)] = FREE
    for thing in placed:
        if thing.on is None:
            grid.cells[_within(xy, thing.aabb[:, :2].ravel(), 0.0)] = OCCUPIED
    return grid


def _door(room: Array, corridor: Array) -> Array:
    """x0, y0, x1, y1 of the opening in the middle of the wall between them."""
    middle = (room[0] + room[2]) / 2
    wall = corridor[1] if room[1] < corridor[1] else corridor[3]
    return np.array([middle - DOOR_M / 2, wall - WALL_M, middle + DOOR_M / 2, wall + WALL_M])


def _within(xy: Array, box: Array, margin_m: float) -> Array:
    return np.all((xy > box[:2] - margin_m) & (xy < box[2:] + margin_m), axis=-1)
