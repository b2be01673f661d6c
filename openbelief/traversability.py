"""Where the robot can stand, how it gets there, and what it can see from there: a planar grid, as Nav2 has it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from openbelief.arrays import Array

FREE, OCCUPIED, UNKNOWN = 0, 100, -1  # nav_msgs/OccupancyGrid
INSCRIBED = 99  # Nav2: an obstacle is nearer than the robot's radius
STEP_OUT_M = 1.0  # a robot standing inside an obstacle's margin may walk this far to leave it
NEIGHBOURS = ((0, 1), (1, 0), (1, 1), (1, -1))  # half of the eight: edges go both ways


class NoPath(ValueError):
    """There is no way there; the message is a sentence for the operator."""


@dataclass(frozen=True)
class OccupancyGrid:
    """A grid aligned with the map axes. cells: (h, w) int8, row = y, column = x; cell (0, 0) has its corner at origin.

    origin_xy: (x, y) of that corner, map frame, metres. Values as nav_msgs/OccupancyGrid: 0 free, 1-100 cost,
    -1 unknown; 99 and 100 are not free. heights_m: (h, w) float32, metres above the floor of the highest obstacle in a
    cell, NaN where there is none; None where nobody measured, as in a Nav2 map.
    """

    cells: Array
    resolution_m: float
    origin_xy: tuple[float, float]
    stamp_ns: int = 0
    heights_m: Array | None = None

    @property
    def free(self) -> Array:
        """(h, w) bool: known, and not within an obstacle or its margin."""
        return (self.cells >= 0) & (self.cells < INSCRIBED)

    def cell(self, xy: Array) -> Array:
        """(..., 2) int (row, column) of map points (..., 2); may lie outside the grid."""
        column_row = np.floor((np.asarray(xy, np.float64) - self.origin_xy) / self.resolution_m).astype(np.int64)
        return column_row[..., ::-1]

    def centre(self, cell: Array) -> Array:
        """(..., 2) float64 map (x, y) of the centres of cells (..., 2) (row, column)."""
        return (np.asarray(cell)[..., ::-1] + 0.5) * self.resolution_m + np.asarray(self.origin_xy)

    def contains(self, cell: Array) -> Array:
        """(...) bool: the cells (..., 2) lie on the grid."""
        return np.all((np.asarray(cell) >= 0) & (np.asarray(cell) < self.cells.shape), axis=-1)

    def at(self, xy: Array) -> Array:
        """(...) int8 values at map points (..., 2); off the grid is unknown."""
        cell = self.cell(xy)
        row, column = np.moveaxis(np.where(self.contains(cell)[..., None], cell, 0), -1, 0)
        return np.where(self.contains(cell), self.cells[row, column], UNKNOWN)

    def part(self, low: Array, high: Array) -> OccupancyGrid:
        """The cells from (row, column) `low`, on the grid, to before `high`."""
        box = slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))
        corner = np.array(self.origin_xy) + np.asarray(low)[::-1] * self.resolution_m
        heights_m = None if self.heights_m is None else self.heights_m[box]
        origin_xy = (float(corner[0]), float(corner[1]))
        return replace(self, cells=self.cells[box], origin_xy=origin_xy, heights_m=heights_m)

    def inflated(self, radius_m: float) -> OccupancyGrid:
        """The same grid where every known cell within `radius_m` of an obstacle is INSCRIBED (as Nav2 marks it)."""
        from scipy.ndimage import distance_transform_edt

        obstacle = self.cells >= OCCUPIED
        if not obstacle.any():
            return self
        near = distance_transform_edt(~obstacle) * self.resolution_m <= radius_m
        margin = near & ~obstacle & (self.cells != UNKNOWN)
        return replace(self, cells=np.where(margin, np.int8(INSCRIBED), self.cells))


@dataclass(frozen=True)
class Reach:
    """What can be reached from one place. distance_m: (h, w) float64, the way's length, inf where there is none.

    previous: (h * w,) int, the flat cell before each on its way, negative at the start and where there is none.
    """

    grid: OccupancyGrid
    start: tuple[int, int]
    distance_m: Array
    previous: Array

    def path_to(self, xy: Array) -> Array:
        """(n, 2) float64 map points from the start's cell to the goal's; raises NoPath."""
        goal = self.grid.cell(xy)
        if not self.grid.contains(goal) or not self.grid.free[tuple(goal)]:
            raise NoPath(f"The goal ({xy[0]:.2f}, {xy[1]:.2f}) is not free on the map.")
        if not np.isfinite(self.distance_m[tuple(goal)]):
            raise NoPath(f"There is no way over known free floor to the goal ({xy[0]:.2f}, {xy[1]:.2f}).")
        flat = [int(np.ravel_multi_index(tuple(goal), self.distance_m.shape))]
        while self.previous[flat[-1]] >= 0:
            flat.append(int(self.previous[flat[-1]]))
        return self.grid.centre(np.column_stack(np.unravel_index(flat[::-1], self.distance_m.shape)))


def reach(grid: OccupancyGrid, start_xy: Array) -> Reach:
    """Shortest ways over free cells (8-connected, no corner cut) from where the robot stands.

    A robot that stands inside an obstacle's margin or on unknown floor first leaves it by the shortest way that
    touches no obstacle, at most STEP_OUT_M. Raises NoPath where it cannot, or stands off the map.
    """
    start = grid.cell(start_xy)
    if not grid.contains(start):
        raise NoPath(f"The robot at ({start_xy[0]:.2f}, {start_xy[1]:.2f}) is outside the map.")
    cell, walkable = (int(start[0]), int(start[1])), grid.free
    walkable[tuple(way_out(grid, cell).T)] = True
    distance, previous = _dijkstra(walkable, cell, np.inf)
    return Reach(grid, cell, distance * grid.resolution_m, previous)


def path(grid: OccupancyGrid, start: Array, goal: Array) -> Array:
    """(n, 2) float64 map points, n >= 2, from `start` (x, y) to `goal` (x, y), both exactly; raises NoPath.

    grid: inflate it by the robot's radius first.
    """
    way = reach(grid, start).path_to(goal)
    return np.concatenate((np.asarray(start, np.float64)[None, :2], way[1:-1], np.asarray(goal, np.float64)[None, :2]))


def obstructed_m(grid: OccupancyGrid, eyes_xy: Array, eye_m: float, points: Array) -> Array:
    """(m,) metres of obstacle in the line of sight from eyes (m, 2), `eye_m` above the floor, to the points' centroid.

    The cells under the points (n, 3) and their neighbours are the object itself; an obstacle known to end below the
    line is looked over; unknown floor hides nothing.
    """
    centroid = points.mean(axis=0, dtype=np.float64)
    step_m = grid.resolution_m / 2
    away_m = np.linalg.norm(eyes_xy - centroid[:2], axis=1)
    along = np.linspace(0.0, 1.0, int(np.ceil(float(away_m.max()) / step_m)) + 1)
    cells = grid.cell(eyes_xy[:, None, :] * (1 - along[:, None]) + centroid[:2] * along[:, None])
    low = np.maximum(cells.min(axis=(0, 1)), 0)
    part = grid.part(low, cells.max(axis=(0, 1)) + 1)  # what lies elsewhere hides nothing
    inside = grid.contains(cells)
    row, column = np.moveaxis(np.where(inside[..., None], cells - low, 0), -1, 0)
    blocking = (part.cells >= OCCUPIED) & ~_footprint(grid.cell(points[:, :2]) - low, part.cells.shape)
    hit = inside & blocking[row, column]
    if part.heights_m is not None:
        hit &= ~(part.heights_m[row, column] < eye_m + along * (centroid[2] - eye_m))  # NaN, not known, blocks
    return hit.mean(axis=1) * away_m


def _footprint(cells: Array, shape: tuple[int, int]) -> Array:
    """(h, w) bool: cells (n, 2), some perhaps outside, and the cells beside those."""
    from scipy.ndimage import binary_dilation

    under = np.zeros((shape[0] + 2, shape[1] + 2), bool)
    cells = cells[((cells >= -1) & (cells <= shape)).all(axis=1)] + 1
    under[tuple(cells.T)] = True
    return binary_dilation(under, np.ones((3, 3), bool))[1:-1, 1:-1]


def way_out(grid: OccupancyGrid, start: tuple[int, int], inflate_m: float = 0.0) -> Array:
    """(k, 2) cells from a start that is not free to the nearest that is, at most STEP_OUT_M away; k = 0 for a free one.

    The start need not be passable: the robot's own body may be marked there. inflate_m: first inflate the grid, which
    is only done around the start. Raises NoPath.
    """
    margin = int((STEP_OUT_M + inflate_m) / grid.resolution_m) + 2
    low = np.maximum(np.array(start) - margin, 0)
    near = grid.part(low, np.array(start) + margin + 1).inflated(inflate_m)
    begin = (int(start[0] - low[0]), int(start[1] - low[1]))
    if near.free[begin]:
        return np.zeros((0, 2), np.int64)
    passable = near.cells < OCCUPIED
    passable[begin] = True
    distance, previous = _dijkstra(passable, begin, STEP_OUT_M / grid.resolution_m)
    distance = np.where(near.free, distance, np.inf)
    nearest = int(np.argmin(distance))
    if not np.isfinite(distance.flat[nearest]):
        raise NoPath(f"The robot is not on free floor, and there is none within {STEP_OUT_M:.1f} m of it.")
    way = []
    while nearest >= 0:
        way.append(nearest)
        nearest = int(previous[nearest])
    return np.column_stack(np.unravel_index(way, distance.shape)) + low


def _dijkstra(walkable: Array, start: tuple[int, int], limit: float) -> tuple[Array, Array]:
    """((h, w) distances in cells, (h * w,) previous flat cells) over the 8-connected walkable cells."""
    from scipy.sparse.csgraph import dijkstra

    source = int(np.ravel_multi_index(start, walkable.shape))
    distance, previous = dijkstra(
        _adjacency(walkable), directed=False, indices=source, return_predecessors=True, limit=limit
    )
    return distance.reshape(walkable.shape), previous


def _adjacency(walkable: Array) -> Array:
    """Sparse (h * w, h * w) step lengths; a diagonal step needs both cells beside it, or it would cut a corner."""
    from scipy.sparse import coo_array

    flat = np.arange(walkable.size).reshape(walkable.shape)
    ends, lengths = [], []
    for down, right in NEIGHBOURS:
        a = (slice(None, -1 if down else None), slice(None, -1 if right else None) if right >= 0 else slice(1, None))
        b = (slice(down, None), slice(right, None) if right >= 0 else slice(None, -1))
        joined = walkable[a] & walkable[b]
        if down and right:
            joined &= walkable[a[0], b[1]] & walkable[b[0], a[1]]
        ends.append(np.stack((flat[a][joined], flat[b][joined])))
        lengths.append(np.full(int(joined.sum()), float(np.hypot(down, right))))
    rows, columns = np.concatenate(ends, axis=1)
    return coo_array((np.concatenate(lengths), (rows, columns)), shape=(walkable.size,) * 2).tocsr()
