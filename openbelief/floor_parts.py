"""Which floor is connected with which: parts of square tiles, joined where a robot can step from one to the next.

Steps are to the four sides; a diagonal one that cuts no corner joins nothing else. What is asked is walked from both
ends in turn, so that two floors without a way between them cost as much as the smaller one has tiles.
"""

from __future__ import annotations

from collections.abc import Iterator
from heapq import heappop, heappush

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.walkable import Walkable

SIDE = 512  # cells of a tile
Part = tuple[int, int, int]  # tile's row and column, and a number from 1


class FloorParts:
    """Of one floor; a tile is taken apart when the first way leads there, and kept."""

    def __init__(self, walkable: Walkable) -> None:
        self._walkable = walkable
        self._tiles = -(-walkable.shape[0] // SIDE), -(-walkable.shape[1] // SIDE)
        self._numbers: dict[tuple[int, int], Array] = {}

    def tiles_between(self, start: Array, cells: Array) -> Array:
        """(m,) float64: over how many tiles some way from a cell (2,) to cells (m, 2) leads; inf where there is none.

        All cells are free. It tells how far the cells are about: the way is that of a walk which goes straight there.
        """
        begin, parts = self._parts(start[None])[0], self._parts(cells)
        tiles = {part: self._between(begin, part) for part in dict.fromkeys(parts)}
        return np.array([tiles[part] for part in parts])

    def _parts(self, cells: Array) -> list[Part]:
        parts = []
        for row, column in cells.tolist():
            tile = row // SIDE, column // SIDE
            parts.append((*tile, int(self._numbered(tile)[row % SIDE, column % SIDE])))
        return parts

    def _between(self, one: Part, other: Part) -> float:
        """Both ends walk on in turn, each the tile first that is nearest to the other's beginning."""
        steps = ({one: 0}, {other: 0})
        waiting: tuple[list[tuple[int, Part]], list[tuple[int, Part]]] = ([(0, one)], [(0, other)])
        if one == other:
            return 1.0
        while True:
            for side, aim in ((1, one), (0, other)):  # what is asked for is more often shut in than the robot
                if not (waiting[0] and waiting[1]):
                    return np.inf
                _, part = heappop(waiting[side])
                for beside in self._beside(part):
                    if beside in steps[1 - side]:
                        return steps[side][part] + steps[1 - side][beside] + 2.0
                    if beside not in steps[side]:
                        steps[side][beside] = steps[side][part] + 1
                        heappush(waiting[side], (abs(beside[0] - aim[0]) + abs(beside[1] - aim[1]), beside))

    def _beside(self, part: Part) -> Iterator[Part]:
        """Parts of the four tiles around that a step leads to."""
        row, column, number = part
        mine = self._numbered((row, column))
        for down, right, edge, facing in SIDES:
            tile, along = (row + down, column + right), mine[edge] == number
            if along.any() and 0 <= tile[0] < self._tiles[0] and 0 <= tile[1] < self._tiles[1]:
                theirs = self._numbered(tile)[facing][along]
                yield from ((*tile, found) for found in np.unique(theirs[theirs > 0]).tolist())

    def _numbered(self, tile: tuple[int, int]) -> Array:
        """(SIDE, SIDE) int32 the part of each cell of a tile, 0 where it is not free."""
        if tile not in self._numbers:
            low = np.array(tile) * SIDE
            free = self._walkable.window(low, low + SIDE).view(np.uint8)
            self._numbers[tile] = cv2.connectedComponents(free, connectivity=4, ltype=cv2.CV_32S)[1]
        return self._numbers[tile]


# Down and right to the tile, the cells of this one along it, and those of that one.
ALL = slice(None)
SIDES = (
    (-1, 0, (0, ALL), (-1, ALL)),
    (1, 0, (-1, ALL), (0, ALL)),
    (0, -1, (ALL, 0), (ALL, -1)),
    (0, 1, (ALL, -1), (ALL, 0)),
)
