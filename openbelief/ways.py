"""How far it is to walk to some cells: a search that looks no farther than the ways there could lead."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.walkable import Walkable

STRAIGHT = [(0, 1), (1, 0), (0, -1), (-1, 0)]
DIAGONAL = [(1, 1), (1, -1), (-1, -1), (-1, 1)]  # number i lies between the straight ones i and i + 1
STEPS = np.array(STRAIGHT + DIAGONAL)
LENGTHS = np.hypot(STEPS[:, 0], STEPS[:, 1])[:, None]
NOWHERE = np.nextafter(0, 1)  # the start's own length: adding a step to it gives the step, and 0 stays "not known"
DETOUR, DETOUR_CELLS = 1.25, 80  # the first guess of how long ways are: so many times the direct one, and so much more
GROWTH = 2  # of the guess, where it was too short
EACH = 8  # cells of length: then what leads nowhere is left out, and whether all is found is looked at
LEAST_FLOOD = 20_000  # cells


def ways(walkable: Walkable, start: Array, targets: Array) -> Array:
    """(m,) float64 lengths, in cells, of the shortest ways from a cell (2,) to cells (m, 2); inf where there is none.

    8-connected over free cells, no corner cut. The search grows with the ways, not with the site: what cannot be
    reached ends it as soon as the floor around that, or around the start, has been walked to its ends.
    """
    search = _Search(walkable, start, targets)
    bound = DETOUR * float(octile(targets - start).min()) + DETOUR_CELLS
    while True:
        lengths = search.within(bound)
        beyond = ~(lengths <= bound)
        if search.cut and beyond.any():
            beyond[beyond] = ~search.shut_in(targets[beyond])
        if not (search.cut and beyond.any()):
            return lengths
        bound *= GROWTH


def octile(steps: Array) -> Array:
    """(...) lengths of the shortest ways over open floor by (..., 2) rows and columns."""
    across = np.abs(steps)
    short = across.min(axis=-1)
    length: Array = across.max(axis=-1) + (np.sqrt(2) - 1) * short
    return length


class _Search:
    """Dijkstra's algorithm by whole cells: no step is shorter, so lengths in [k, k + 1) follow from those below k."""

    def __init__(self, walkable: Walkable, start: Array, targets: Array) -> None:
        self._walkable, self._width = walkable, walkable.shape[1]
        self._start, self._targets = walkable.flat(start[None]), walkable.flat(targets)
        self._low, self._high = targets.min(axis=0) + 1, targets.max(axis=0) + 1
        self._steps = (STEPS @ [self._width, 1])[:, None]
        self._lengths = np.zeros(0)
        self.cut = False

    def within(self, bound: float) -> Array:
        """(m,) lengths to the targets, inf where none was found; those up to `bound` are the shortest.

        cut: tells then whether anything was left out for being on no way to them so short.
        """
        self._lengths = np.zeros(self._walkable.cells)
        self._lengths[self._start] = NOWHERE
        number = np.zeros(self._walkable.cells, np.int32)
        number[self._start] = 1
        front, waiting, below, self.cut = self._start, self._start[:0], 1, False
        while len(front) or len(waiting):
            if below % EACH < 2:  # no step is as long as two
                if self._lengths[self._targets].all():
                    break
                front = self._worthwhile(front, bound)
            beside, passable = self._beside(front)
            waiting = np.concatenate((waiting, _first_seen(beside[passable], number)))
            below += 1
            lengths = self._shortest(waiting)
            settled = lengths < below
            front, waiting = waiting[settled], waiting[~settled]
            self._lengths[front] = lengths[settled]
        found = self._lengths[self._targets]
        return np.where(found == 0, np.inf, np.where(found == NOWHERE, 0, found))

    def shut_in(self, targets: Array) -> Array:
        """(m,) bool: targets (m, 2) that no way leads to: the free floor around them has been walked to its ends."""
        left, shut = self._walkable.flat(targets), np.zeros(len(targets), bool)
        budget = max(LEAST_FLOOD, int(np.count_nonzero(self._lengths)))
        places = np.arange(len(left))
        while len(places):
            flooded, closed = self._flooded(left[places[:1]], budget)
            same = flooded[left[places]]
            shut[places[same]] = closed
            places = places[~same]
        return shut

    def _flooded(self, front: Array, budget: int) -> tuple[Array, bool]:
        """(cells,) bool of what is connected with a cell, and whether that is all of it and not the robot's floor."""
        flooded, count = np.zeros(self._walkable.cells, bool), 1
        flooded[front] = True
        while len(front) and count <= budget:
            beside = np.unique(front + self._steps[: len(STRAIGHT)])
            front = beside[self._walkable.free(beside) & ~flooded[beside]]
            flooded[front] = True
            count += len(front)
            if self._lengths[front].any():
                return flooded, False
        return flooded, not len(front)

    def _worthwhile(self, cells: Array, bound: float) -> Array:
        """The settled cells that may lie on a way to the targets' box of at most `bound`."""
        at = np.stack(np.divmod(cells, self._width), axis=1)
        keep = self._lengths[cells] + octile(np.maximum(np.maximum(self._low - at, at - self._high), 0)) <= bound
        self.cut |= not keep.all()
        return cells[keep]

    def _beside(self, cells: Array) -> tuple[Array, Array]:
        """(8, k) the neighbours of (k,) cells, and (8, k) bool where a step leads to one."""
        beside = cells + self._steps
        passable = self._walkable.free(beside)
        sides = passable[: len(STRAIGHT)]
        passable[len(STRAIGHT) :] &= sides & sides[[1, 2, 3, 0]]
        return beside, passable

    def _shortest(self, cells: Array) -> Array:
        """(k,) lengths by way of their settled neighbours."""
        beside, passable = self._beside(cells)
        lengths = self._lengths[beside]
        lengths[(lengths == 0) | ~passable] = np.inf
        lengths += LENGTHS
        shortest: Array = lengths.min(axis=0)
        return shortest


def _first_seen(cells: Array, number: Array) -> Array:
    """The cells that have no number yet, each once; they get one."""
    new = cells[number[cells] == 0]
    numbers = np.arange(1, len(new) + 1, dtype=np.int32)
    number[new] = numbers
    return new[number[new] == numbers]
