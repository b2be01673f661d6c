"""Storeys: the heights of their floors, from the histogram of what cameras measured below them; a grid for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from openbelief.arrays import Array
from openbelief.backprojection import depth_points
from openbelief.occupancy import TooWide, floor_height, from_points
from openbelief.pose import apply
from openbelief.surroundings import CameraView, StoreyMap, Surroundings
from openbelief.traversability import OCCUPIED, OccupancyGrid

BIN_M = 0.05
BELOW_CAMERA_M = 0.5  # floors and table tops are below it; what it sees of ceilings is not
STOREY_MIN_M = 1.8  # floors are at least so far apart
# A floor's peak, of the site's highest and of its own storey's: nothing lies below a floor, so the lowest peak is it,
# however much more a camera at a table saw of the table; weaker ones are reflections.
PEAK_SHARE, OF_STOREY_SHARE = 0.05, 0.1
WALKED_M = (0.3, 2.2)  # a camera was carried so high above a floor that was walked on
UNDER_FLOOR_M = 0.3  # what stands on a floor may seem so much below it
HEADROOM_M = 2.0
BEYOND_M = 1000.0
SAME_HEIGHT_M = 1.0  # a map drawn at this distance from a floor is that floor's
AGREES_FREE, AGREES_WALLS, WALL_SLACK_M = 0.9, 0.7, 0.15
PLACE_M = 0.5  # views from so near each other show the same floor
HEIGHTS, MAX_POINTS = 500_000, 4_000_000  # for the histogram and for a grid: of a long walk, fewer pixels of each view
DEPTH_MAX_M = 6.0  # stereo depth is no more than a guess beyond


@dataclass(frozen=True)
class Floor:
    """One storey. height_m: z of its floor, map frame. heights_m: of what stands on it; the lowest and the highest one
    have no end, so that everything stands on a floor. grid: where there are walls and floor, None where unknown."""

    id: int
    height_m: float
    heights_m: tuple[float, float]
    grid: OccupancyGrid | None

    def holds(self, z: float) -> bool:
        """Does what is at this height stand on this floor?"""
        return self.heights_m[0] <= z < self.heights_m[1]

    def room_heights_m(self) -> tuple[float, float]:
        """`heights_m` as a room keeps them: with ends, far below and above whatever stands on it."""
        (low, high), ends = self.heights_m, (min(0.0, self.height_m) - BEYOND_M, max(0.0, self.height_m) + BEYOND_M)
        return max(low, ends[0]), min(high, ends[1])


class _Seen:
    """What cameras measured. z: (n,) heights of points, map frame; camera_z: (n,) of the camera that saw each; both of
    the views that look down most from where they are. cameras: (m,) heights of all cameras."""

    def __init__(self, surroundings: Surroundings) -> None:
        self._surroundings = surroundings
        self.cameras = np.array([view.T_map_camera[2, 3] for view in surroundings.views])
        views = _looking_down(surroundings.views)
        seen = [
            self._of(view, HEIGHTS / len(views)) @ view.T_map_camera[2, :3] + view.T_map_camera[2, 3] for view in views
        ]
        self.z = np.concatenate([np.empty(0), *seen])
        self.camera_z = np.repeat([view.T_map_camera[2, 3] for view in views], [len(z) for z in seen])

    def points(self, low_z: float, high_z: float) -> Array:
        """(n, 3) map frame: of the cameras between two heights."""
        views = [view for view in self._surroundings.views if low_z <= view.T_map_camera[2, 3] < high_z]
        seen = (apply(view.T_map_camera, self._of(view, MAX_POINTS / len(self.cameras))) for view in views)
        return np.concatenate([np.empty((0, 3)), *seen])

    def _of(self, view: CameraView, most: float) -> Array:
        """(n, 3) of one view, optical frame; of a large one, fewer pixels are taken."""
        depth_m, camera = self._surroundings.depth_m(view)
        stride = max(1, int(np.ceil(np.sqrt(depth_m.size / most))))
        return depth_points(depth_m, camera, stride, DEPTH_MAX_M)


def _looking_down(views: Sequence[CameraView]) -> list[CameraView]:
    """Of the views from one place the one whose optical axis points down most: it shows the floor, if any does."""
    chosen: dict[tuple[int, ...], CameraView] = {}
    for view in sorted(views, key=lambda view: float(view.T_map_camera[2, 2])):
        chosen.setdefault(tuple(np.floor(view.T_map_camera[:3, 3] / PLACE_M).astype(int).tolist()), view)
    return list(chosen.values())


def floors_of(surroundings: Surroundings, clouds: Sequence[Array]) -> tuple[Floor, ...]:
    """The site's storeys, lowest first; at least one. clouds: the objects' points, for a file without keyframes."""
    seen = _Seen(surroundings)
    heights = floor_heights(seen.z, seen.camera_z, seen.cameras)
    if not heights:
        heights = [floor_height(np.concatenate(clouds)) if clouds else 0.0]
    edges = [-np.inf, *(height - UNDER_FLOOR_M for height in heights[1:]), np.inf]
    ranges = list(pairwise(edges))
    return tuple(
        Floor(i, round(height, 3), ranges[i], _grid_of(surroundings.maps, seen, height, ranges[i]))
        for i, height in enumerate(heights)
    )


def floor_heights(z: Array, camera_z: Array, cameras: Array) -> list[float]:
    """Heights of the floors that were walked on, lowest first.

    z, camera_z: (n,) heights of measured points and of the cameras that saw them. cameras: (m,) all cameras' heights.
    """
    below = z[z < camera_z - BELOW_CAMERA_M]
    if not len(below):
        return []
    below = below[np.abs(below - np.median(below)) < BEYOND_M]  # a wild pose is no storey, and no bins lead to it
    low = np.floor(below.min() / BIN_M) * BIN_M
    counts = np.bincount(((below - low) / BIN_M).astype(np.int64)).astype(np.float64)
    smooth = np.convolve(np.pad(counts, 1), [0.25, 0.5, 0.25], mode="same")
    peaks = np.flatnonzero((smooth[1:-1] >= smooth[:-2]) & (smooth[1:-1] > smooth[2:]))
    peaks = peaks[smooth[peaks + 1] >= PEAK_SHARE * smooth.max()]
    heights: list[float] = []
    while len(peaks):
        storey = peaks[(peaks - peaks[0]) * BIN_M < STOREY_MIN_M]
        strong = storey[smooth[storey + 1] >= OF_STOREY_SHARE * smooth[storey + 1].max()]
        height = _exact(below, low + (strong[0] + 0.5) * BIN_M)
        above = cameras - height
        if ((above > WALKED_M[0]) & (above < WALKED_M[1])).any():
            heights.append(height)
            peaks = peaks[(peaks - strong[0]) * BIN_M >= STOREY_MIN_M]
        else:
            peaks = peaks[peaks > strong[0]]
    return heights


def _exact(z: Array, near: float) -> float:
    return float(np.median(z[np.abs(z - near) <= BIN_M]))


def _of_storey(seen: _Seen, height: float, heights_m: tuple[float, float]) -> Array:
    """(n, 3) points that cameras of this storey saw of it."""
    points = seen.points(heights_m[0] + WALKED_M[0], heights_m[1] + WALKED_M[0])
    z = points[:, 2]
    return points[(z > height - UNDER_FLOOR_M) & (z < min(height + HEADROOM_M, heights_m[1]))]


def _grid_of(
    maps: Sequence[StoreyMap], seen: _Seen, height: float, heights_m: tuple[float, float]
) -> OccupancyGrid | None:
    """The navigation map of this floor; else one that agrees with what was seen of it; else one made of that."""
    if own := [m for m in maps if abs(m.height_m - height) < SAME_HEIGHT_M]:
        return _largest(own)
    points = _of_storey(seen, height, heights_m)
    made = _made_of(points)
    agreeing = [m for m in maps if made is not None and _agrees(m.grid, made)]
    return _largest(agreeing) if agreeing else made


def _made_of(points: Array) -> OccupancyGrid | None:
    """None where no grid holds them all: a walk across a campus, or one pose that is wild."""
    try:
        return from_points(points) if len(points) else None
    except TooWide:
        return None


def _largest(maps: Sequence[StoreyMap]) -> OccupancyGrid:
    return max(maps, key=lambda m: int((m.grid.cells >= 0).sum())).grid


def _agrees(grid: OccupancyGrid, seen: OccupancyGrid) -> bool:
    """Is floor that was seen free on the map, and what stood there occupied?"""
    free, walls = (seen.centre(np.argwhere(where)) for where in (seen.cells == 0, seen.cells >= OCCUPIED))
    if not len(free) or not len(walls):
        return False
    near_walls = grid.inflated(WALL_SLACK_M)
    return bool(
        (grid.at(free) >= 0).mean() >= AGREES_FREE
        and (grid.at(free) < OCCUPIED).mean() >= AGREES_FREE
        and (near_walls.at(walls) > 0).mean() >= AGREES_WALLS
    )
