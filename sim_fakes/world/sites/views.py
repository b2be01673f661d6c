"""What a mapping would hold of a site's things: their surfaces from many sides, and what perception said of them.

The shares of wrong, general and coloured names are those counted in the development recording.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.observation import Observation, Provenance
from openbelief.perception.ports import TextEncoder
from sim_fakes.world.scripted_perception import BACKGROUND, FEATURE_NOISE, LABEL_COSINE, SAME_KIND_COSINE
from sim_fakes.world.sites.catalogue import things
from sim_fakes.world.sites.layout import Placed, RoomBox

WRONG, GENERAL, COLOURED = 0.05, 0.13, 0.2  # shares of the names
VIEWS_BASE, VIEWS_PER_M, VIEWS = 4.0, 8.0, (2, 30)
FRAMES_IN_A_ROOM = 60
FRAME_NS = 300_000_000
VOXEL_M, FINE_M, COARSE_M, LARGE_M = 0.02, 0.02, 0.04, 0.8  # surfaces of large things are sampled coarser
RANGE_NOISE_M = 0.008
CROPPED = 0.5  # of the views of things over half a metre, by the image's border
CONFIDENCE = (0.45, 0.95)
BACKGROUND_VIEWS = 3


class Views:
    """unsaid: by label, the name that only an operator uses."""

    def __init__(self, encoder: TextEncoder, rooms: Sequence[RoomBox], unsaid: Mapping[str, str], seed: int) -> None:
        self._encoder, self._rooms, self._unsaid = encoder, rooms, unsaid
        self._rng = np.random.default_rng([seed, 0x0B5E])
        self._masks: dict[int, int] = {}

    def of(self, placed: Sequence[Placed]) -> Iterator[tuple[Observation, int]]:
        """Each with the id of the thing it is truly of."""
        for thing in placed:
            for observation in self._of_thing(thing):
                yield observation, thing.id

    def of_background(self) -> Iterator[Observation]:
        for number, room in enumerate(self._rooms):
            for instance, names in BACKGROUND.items():
                look = self._look(names[0], str(instance), str(number))
                for _ in range(BACKGROUND_VIEWS):
                    points = self._plane(room, on_floor=names[0] == "floor")
                    yield self._seen(self._frame(number), str(self._rng.choice(names)), points, look)

    def _of_thing(self, placed: Placed) -> Iterator[Observation]:
        room = next(i for i, room in enumerate(self._rooms) if room.name == placed.room)
        longest = float((placed.aabb[1] - placed.aabb[0]).max())
        count = int(np.clip(self._rng.poisson(VIEWS_BASE + VIEWS_PER_M * longest), *VIEWS))
        names = [name for name in placed.thing.names if name != self._unsaid.get(placed.label)]
        shares = self._rng.dirichlet([3.0] + [1.5] * (len(names) - 1))
        look = self._look(placed.label, placed.colour, str(placed.id))
        for frame in self._rng.choice(FRAMES_IN_A_ROOM, size=count, replace=False):
            points = self._surface(placed.aabb)
            if len(points) >= 8:
                said = self._said(placed, names, shares)
                yield self._seen(FRAMES_IN_A_ROOM * room + int(frame), said, points, look)

    def _said(self, placed: Placed, names: Sequence[str], shares: Array) -> str:
        rng = self._rng
        if rng.random() < placed.confusion_rate:
            return placed.thing.taken_for
        if rng.random() < WRONG:
            return str(rng.choice(list(things())))
        if placed.thing.kinds and rng.random() < GENERAL:
            return str(rng.choice(placed.thing.kinds))
        name = str(rng.choice(names, p=shares))
        return f"{placed.colour} {name}" if rng.random() < COLOURED else name

    def _seen(self, frame: int, phrase: str, points: Array, look: Array) -> Observation:
        mask = self._masks[frame] = self._masks.get(frame, -1) + 1
        low, high = CONFIDENCE
        confidence = low + (high - low) * float(self._rng.beta(3, 2))
        noise = normalize(self._rng.standard_normal(len(look)))
        feature = normalize(np.sqrt(1 - FEATURE_NOISE**2) * look + FEATURE_NOISE * noise).astype(np.float32)
        seen = Provenance("site", 10**9 + frame * FRAME_NS, (0, 0, 1, 1), {"size": [1, 1], "counts": [0, 1]}, b"")
        return Observation(frame, mask, phrase, confidence, points, feature, provenance=seen)

    def _frame(self, room: int) -> int:
        return FRAMES_IN_A_ROOM * room + int(self._rng.integers(FRAMES_IN_A_ROOM))

    def _look(self, label: str, colour: str, own: str) -> Array:
        """What a thing looks like from anywhere: its name's direction, its kind's, and its own."""
        text = np.asarray(self._encoder.encode([label])[0], dtype=np.float64)
        kind, individual = (_unit(words, self._encoder.dim) for words in (f"{label} {colour}", f"{label} {own}"))
        rest = normalize(np.sqrt(SAME_KIND_COSINE) * kind + np.sqrt(1 - SAME_KIND_COSINE) * individual)
        rest = normalize(rest - (rest @ text) * text)
        return LABEL_COSINE * text + np.sqrt(1 - LABEL_COSINE**2) * rest

    def _surface(self, box: Array) -> Array:
        """(n, 3) float32 of the sides that one viewpoint sees, now and then cropped."""
        size, centre = box[1] - box[0], box.mean(axis=0)
        step = FINE_M if size.max() < LARGE_M else COARSE_M
        azimuth = self._rng.uniform(0, 2 * np.pi)
        eye = np.array([*(centre[:2] + 2.0 * np.array([np.cos(azimuth), np.sin(azimuth)])), 1.2])
        sides = [_side(box, axis, side, step) for axis in range(3) for side in (0, 1) if _faces(eye, box, axis, side)]
        points = np.concatenate(sides) if sides else np.zeros((0, 3))
        if size.max() > 0.5 and self._rng.random() < CROPPED:
            axis, share = int(self._rng.integers(2)), self._rng.uniform(0.35, 0.85)
            along = (points[:, axis] - box[0, axis]) / size[axis]
            points = points[along < share if self._rng.random() < 0.5 else along > 1.0 - share]
        return _snapped(points + self._rng.normal(0.0, RANGE_NOISE_M, points.shape))

    def _plane(self, room: RoomBox, *, on_floor: bool) -> Array:
        x = self._rng.uniform(room.x0, room.x1, 400)
        if on_floor:
            return _snapped(np.column_stack([x, self._rng.uniform(room.y0, room.y1, 400), np.zeros(400)]))
        return _snapped(np.column_stack([x, np.full(400, room.y1), self._rng.uniform(0.0, 2.4, 400)]))


def _faces(eye: Array, box: Array, axis: int, side: int) -> bool:
    return bool(eye[axis] > box[1, axis]) if side else bool(eye[axis] < box[0, axis])


def _side(box: Array, axis: int, side: int, step: float) -> Array:
    others = [i for i in range(3) if i != axis]
    grid = [np.arange(box[0, i] + 0.005, max(box[1, i], box[0, i] + 0.011), step) for i in others]
    points = np.empty((len(grid[0]) * len(grid[1]), 3))
    points[:, others] = np.stack(np.meshgrid(*grid, indexing="ij"), axis=-1).reshape(-1, 2)
    points[:, axis] = box[side, axis]
    return points


def _snapped(points: Array) -> Array:
    """One point per occupied voxel, as acquisition gives them."""
    return ((np.unique(np.floor(points / VOXEL_M), axis=0) + 0.5) * VOXEL_M).astype(np.float32)


def _unit(words: str, dim: int) -> Array:
    """A direction that follows from words alone."""
    return normalize(np.random.default_rng(list(words.encode())).standard_normal(dim))
