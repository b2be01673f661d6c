"""How far it is to walk to some cells: a search that looks no farther than the ways there could lead."""

from __future__ import annotations

import numpy as np

from openbelief.arrays import Array
from openbelief.floor_parts import SIDE, FloorParts
from openbelief.lattice import Lattice, octile
from openbelief.walkable import Walkable

STRIDES = 4, 2, 1  # of the lattices that say about how far it is, the next where places are too narrow for the last
DETOUR, DETOUR_CELLS = 1.15, 120  # looked at first: ways so many times as long as the direct one, and so much more
TILE_WAY = 1.25 * SIDE  # cells of way for each tile that a walk straight there led over
GROWTH = 1.5  # of how far is looked, where that was not far enough
AROUND = 24  # cells around the start and the targets where every cell is walked, to where a lattice begins
ASIDE = 2 * (np.sqrt(2) - 1)  # cells longer is a way, at least, for each that it leads aside
EXACT = 2400  # cells: longer ways are as long as along a lattice


def ways(walkable: Walkable, start: Array, targets: Array) -> Array:
    """(m,) float64 lengths, in cells, of the shortest ways from a cell (2,) to cells (m, 2); inf where there is none.

    8-connected over free cells, no corner cut. Where none is longer than EXACT they are the shortest to the bit; else
    they are ways too, about 1 % longer than the shortest that leads over four cells' width of such floor: one that
    squeezes through less is taken where no other leads there. The search grows with the ways, not with the site; that
    there is no way is known when the floor around the targets, or the start, has been walked to its ends.
    """
    about = _Search(walkable, start, targets).directly()
    missing, tiles = np.isinf(about), np.zeros(len(targets))
    if missing.any():
        tiles[missing] = FloorParts(walkable).tiles_between(start, targets[missing])
        missing &= np.isfinite(tiles)
    if missing.any():
        about[missing] = _Search(walkable, start, targets[missing]).to_the_end(TILE_WAY * float(tiles[missing].max()))
    found = np.isfinite(about)
    if found.any() and about[found].max() <= EXACT:
        about[found] = _Search(walkable, start, targets[found]).exactly(float(about[found].max()))
    return about


class _Search:
    """Ways from a start to the box around targets."""

    def __init__(self, walkable: Walkable, start: Array, targets: Array) -> None:
        self._walkable, self._start, self._targets = walkable, start, targets
        self._low, self._high = targets.min(axis=0), targets.max(axis=0) + 1
        self._away = float(octile(np.maximum(np.maximum(self._low - start, start - self._high), 0)))

    def directly(self) -> Array:
        """(m,) lengths along the coarsest lattice, inf where the ways are much longer than over open floor, or none."""
        return self._along(DETOUR * self._away + DETOUR_CELLS, STRIDES[0])

    def to_the_end(self, guess: float) -> Array:
        """(m,) lengths along lattices, where ways lead to all; finer ones look as much less far as they cost more."""
        about, bound = np.full(len(self._targets), np.inf), guess
        while True:
            for stride in STRIDES:
                reach = bound * stride / STRIDES[0]
                if reach >= self._away:
                    about = np.minimum(about, self._along(reach, stride))
                if np.isfinite(about).all():
                    return about
            bound *= GROWTH

    def exactly(self, longest: float) -> Array:
        """(m,) the shortest lengths, to the bit, where all are known to be at most so long."""
        bound = longest + 1  # sums of steps are rounded
        every = self._lattice(bound, 1)
        every.start(self._start[None], np.zeros(1))
        every.walk(bound, self._low, self._high)
        return every.at(self._targets)

    def _along(self, bound: float, stride: int) -> Array:
        """(m,) lengths of ways that follow a lattice but for the first and the last steps; inf where none does."""
        first = Lattice(self._walkable, self._start - AROUND, self._start + AROUND + 1, 1)
        first.start(self._start[None], np.zeros(1))
        first.walk()
        wide = self._lattice(bound, stride)
        wide.start_from(first)
        wide.walk(bound, self._low, self._high)
        last = Lattice(self._walkable, self._low - AROUND, self._high + AROUND, 1)
        for lattice in (first, wide):
            last.start_from(lattice)
        last.walk()
        return last.at(self._targets)

    def _lattice(self, bound: float, stride: int) -> Lattice:
        """Of all the floor where a way from the start to the box may lead that is no longer than the bound."""
        whole = np.array(self._walkable.shape) - 2
        aside = int(min((bound - self._away) / ASIDE, whole.max())) + 1
        low = np.maximum(np.minimum(self._start, self._low) - aside, 0)
        high = np.minimum(np.maximum(self._start + 1, self._high) + aside, whole)
        return Lattice(self._walkable, low, high, stride)
