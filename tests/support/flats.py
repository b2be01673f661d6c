"""Floor plans drawn by lot: rooms, doors and furniture as a grid, and what a mapping would hold of the furniture."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from openbelief.polygon import inside
from openbelief.traversability import OccupancyGrid

CELL_M, MARGIN_M = 0.05, 0.4
WALL_M = (0.1, 0.15, 0.2)
PIECES = ((1.6, 2.0, 0.9), (2.0, 0.6, 1.8), (0.5, 0.5, 0.6), (1.0, 0.5, 0.9), (1.3, 0.8, 0.75), (0.45, 0.45, 0.9))


@dataclass(frozen=True)
class Thing:
    """points: (n, 3), what was mapped of it; None where it was not."""

    room: int
    points: np.ndarray | None
    box: tuple[float, float, float, float]


@dataclass(frozen=True)
class Flat:
    """rooms: (x0, y0, x1, y1) each. turned_rad: of the map against the rooms."""

    grid: OccupancyGrid
    rooms: list[tuple[float, float, float, float]]
    things: list[Thing]
    turned_rad: float = 0.0

    @property
    def clouds(self) -> list[np.ndarray]:
        return [thing.points for thing in self.things if thing.points is not None]

    def share_in_right_room(self, labels: np.ndarray) -> float:
        """Of the mapped things, by a (h, w) image of found rooms, matched one to one with the true ones."""
        from scipy.optimize import linear_sum_assignment

        placed = [t for t in self.things if t.points is not None]
        found = [int(labels[tuple(self.grid.cell(t.points.mean(axis=0)[:2]))]) for t in placed]
        table = np.zeros((int(labels.max()) + 1, len(self.rooms)))
        for label, thing in zip(found, placed, strict=True):
            table[label, thing.room] += label > 0
        return float(table[linear_sum_assignment(-table)].sum() / len(placed))

    def turned(self, angle_rad: float) -> Flat:
        """The same flat in a map frame turned by an angle."""
        c, s = np.cos(angle_rad), np.sin(angle_rad)
        R = np.array([[c, -s], [s, c]])
        height, width = self.grid.cells.shape
        corners = np.array([[0, 0], [width, 0], [width, height], [0, height]]) * CELL_M + self.grid.origin_xy
        low = np.floor(((corners @ R.T).min(axis=0) - 0.1) / CELL_M) * CELL_M
        columns, rows = np.ceil(((corners @ R.T).max(axis=0) + 0.1 - low) / CELL_M).astype(int)
        blank = OccupancyGrid(np.full((rows, columns), -1, np.int8), CELL_M, (float(low[0]), float(low[1])))
        centres = blank.centre(np.argwhere(blank.cells < 0))
        grid = replace(blank, cells=self.grid.at(centres @ R).reshape(rows, columns).astype(np.int8))
        T = np.eye(3)
        T[:2, :2] = R
        things = [replace(t, points=None if t.points is None else t.points @ T.T) for t in self.things]
        return Flat(grid, self.rooms, things, angle_rad)


def flat(seed: int) -> Flat:
    """Even seeds divide a rectangle again and again; odd ones have rooms on both sides of a corridor."""
    rng = np.random.default_rng(seed)
    rooms = _corridor(rng) if seed % 2 else _divided(rng, (0.0, 0.0, _snapped(rng, 7, 12), _snapped(rng, 6, 10)))
    doors = _doors(rng, rooms, first=0 if seed % 2 else None)
    boxes = [(i, box) for i, room in enumerate(rooms) for box in _furniture(rng, room, doors)]
    grid = _grid(rooms, doors, [box for _, box in boxes], float(rng.choice(WALL_M)))
    return Flat(grid, rooms, [Thing(i, _mapped(rng, box, rooms[i]), box) for i, box in boxes])


def _snapped(rng, low, high):
    return round(rng.uniform(low, high) / CELL_M) * CELL_M


def _divided(rng, room):
    x0, y0, x1, y1 = room
    least = rng.uniform(2.0, 2.6)
    width, height = x1 - x0, y1 - y0
    if max(width, height) < 2 * least or (width * height < 14 and rng.random() < 0.6):
        return [room]
    if width > height:
        cut = _snapped(rng, x0 + least, x1 - least)
        return _divided(rng, (x0, y0, cut, y1)) + _divided(rng, (cut, y0, x1, y1))
    cut = _snapped(rng, y0 + least, y1 - least)
    return _divided(rng, (x0, y0, x1, cut)) + _divided(rng, (x0, cut, x1, y1))


def _corridor(rng):
    width, length = _snapped(rng, 1.0, 1.9), _snapped(rng, 8, 14)
    low, high = _snapped(rng, 2.8, 4.6), _snapped(rng, 2.8, 4.6)
    rooms = [(0.0, low, length, low + width)]
    for y0, y1 in ((0.0, low), (low + width, low + width + high)):
        x = 0.0
        while x < length - 0.01:
            wide = _snapped(rng, 2.2, 5.0)
            end = length if length - (x + wide) < 2.2 else x + wide
            rooms.append((x, y0, end, y1))
            x = end
    return rooms


def _doors(rng, rooms, first):
    """(axis, at, middle, width): openings that join all rooms; axis 0 in a wall of constant x."""
    shared = []
    for j in range(len(rooms)):
        for i in range(j):
            for axis in (0, 1):
                a, b, other = rooms[i], rooms[j], 1 - axis
                for at in {a[axis], a[axis + 2]} & {b[axis], b[axis + 2]}:
                    low, high = max(a[other], b[other]), min(a[other + 2], b[other + 2])
                    if high - low > 1.5:
                        shared.append((i, j, axis, at, low, high))
    rng.shuffle(shared)
    shared = sorted(shared, key=lambda wall: first not in wall[:2]) if first is not None else shared
    group = list(range(len(rooms)))
    doors = []
    for i, j, axis, at, low, high in shared:
        i, j = int(i), int(j)
        if group[i] != group[j] or rng.random() < 0.1:
            group = [group[i] if g == group[j] else g for g in group]
            width = _snapped(rng, 0.75, 1.2)
            aside = 0.12 if rng.random() < 0.3 else 0.35
            low, high = low + width / 2 + 0.12, high - width / 2 - 0.12
            middle = low if aside < 0.2 else rng.uniform(min(low + 0.2, (low + high) / 2), high)
            doors.append((int(axis), float(at), float(middle), width))
    return doors


def _furniture(rng, room, doors):
    x0, y0, x1, y1 = room
    placed = []
    for width, depth, _ in PIECES:
        for _ in range(20):
            w, d = (width, depth) if rng.random() < 0.5 else (depth, width)
            if x1 - x0 < w + 0.4 or y1 - y0 < d + 0.4:
                continue
            x, y = rng.uniform(x0 + 0.1, x1 - w - 0.1), rng.uniform(y0 + 0.1, y1 - d - 0.1)
            if rng.random() < 0.8:  # against a wall
                x, y = [(x0 + 0.1, y), (x1 - w - 0.1, y), (x, y0 + 0.1), (x, y1 - d - 0.1)][rng.integers(4)]
            box = (x, y, x + w, y + d)
            if not any(_meet(box, other, 0.05) for other in placed) and not any(_meet(box, z, 0) for z in _ways(doors)):
                placed.append(box)
                break
    return placed


def _ways(doors):
    for axis, at, middle, width in doors:
        low, high = (at - 0.9, middle - width / 2 - 0.1), (at + 0.9, middle + width / 2 + 0.1)
        yield (*low, *high) if axis == 0 else (low[1], low[0], high[1], high[0])


def _meet(a, b, gap):
    return a[0] < b[2] + gap and b[0] < a[2] + gap and a[1] < b[3] + gap and b[1] < a[3] + gap


def _grid(rooms, doors, boxes, wall_m):
    corners = np.array(rooms)
    low = corners[:, :2].min(axis=0) - MARGIN_M
    columns, rows = np.ceil((corners[:, 2:].max(axis=0) + MARGIN_M - low) / CELL_M).astype(int)
    grid = OccupancyGrid(np.full((rows, columns), -1, np.int8), CELL_M, (float(low[0]), float(low[1])))
    x, y = np.moveaxis(grid.centre(np.stack(np.mgrid[0:rows, 0:columns], axis=-1)), -1, 0)
    cells, h = grid.cells, wall_m / 2
    for x0, y0, x1, y1 in rooms:
        cells[(x > x0) & (x < x1) & (y > y0) & (y < y1)] = 0
    for x0, y0, x1, y1 in rooms:
        outer = (x > x0 - h) & (x < x1 + h) & (y > y0 - h) & (y < y1 + h)
        cells[outer & ~((x > x0 + h) & (x < x1 - h) & (y > y0 + h) & (y < y1 - h))] = 100
    for axis, at, middle, width in doors:
        across, along = (x, y) if axis == 0 else (y, x)
        cells[(np.abs(across - at) < h + 0.03) & (np.abs(along - middle) < width / 2)] = 0
    for x0, y0, x1, y1 in boxes:
        cells[(x > x0) & (x < x1) & (y > y0) & (y < y1)] = 100
    return grid


def _mapped(rng, box, room):
    """A fifth of the furniture was not mapped; of the rest the side towards the middle of the room."""
    if rng.random() < 0.2:
        return None
    x, y = np.meshgrid(np.arange(box[0], box[2], 0.04), np.arange(box[1], box[3], 0.04))
    points = np.column_stack((x.ravel(), y.ravel(), np.full(x.size, 0.5)))
    middle = np.array([(room[0] + room[2]) / 2, (room[1] + room[3]) / 2])
    near = (points[:, :2] - points[:, :2].mean(axis=0)) @ (middle - points[:, :2].mean(axis=0))
    return points[near >= np.quantile(near, rng.uniform(0, 0.5))]


def true_room(point, rooms):
    """The index of the room around a point, None where there is none."""
    corners = [[(a, b), (c, b), (c, d), (a, d)] for a, b, c, d in rooms]
    return next((i for i, polygon in enumerate(corners) if inside(point, polygon)[0]), None)
