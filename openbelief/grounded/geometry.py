"""How near boxes are to each other, in the ways that people say it: on, under, in, next to, in front of, left of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.table import MapTable
from openbelief.request.words import RelationKind

AROUND_M = 3.0  # what stands within it says where the free side of a thing is


@dataclass(frozen=True, slots=True)
class Viewer:
    """Where the one who asks stands and looks: map frame, metres, radians counter-clockwise from x."""

    x: float
    y: float
    yaw: float

    @property
    def xy(self) -> Array:
        return np.array([self.x, self.y])


@dataclass(frozen=True, eq=False)
class ObjectBoxes:
    """low, high, middle: (n, 3), map frame, metres. free: (n,) bool, what counts as standing around."""

    low: Array
    high: Array
    middle: Array
    free: Array

    @classmethod
    def of(cls, table: MapTable) -> ObjectBoxes:
        low, high = np.asfortranarray(table.low), np.asfortranarray(table.high)  # an axis at a time is read faster
        return cls(low, high, (low + high) / 2, ~table.background)


@dataclass(frozen=True, eq=False)
class Gaps:
    """Of every box to one other, metres, 0 where they meet: whole distance, seen from above, and heights."""

    distance: Array
    level: Array


def gaps(boxes: ObjectBoxes, anchor: int) -> Gaps:
    apart = np.maximum(np.maximum(boxes.low - boxes.high[anchor], boxes.low[anchor] - boxes.high), 0.0)
    return Gaps(np.linalg.norm(apart, axis=1), np.hypot(apart[:, 0], apart[:, 1]))


def nearness(
    boxes: ObjectBoxes, kind: RelationKind, anchor: int, held: bool, viewer: Viewer | None, options: GroundedOptions
) -> Array:
    """(n,) in [0, 1]: how well each box stands to the anchor. held: how well the anchor stands to each box."""
    if kind in DIRECTIONS:
        return _towards(boxes, kind, anchor, held, viewer, options)
    return MEASURES[kind](boxes, anchor, held, options)


def _near(boxes: ObjectBoxes, anchor: int, _: bool, options: GroundedOptions) -> Array:
    return np.exp(-gaps(boxes, anchor).distance / options.near_m)


def _nearest(boxes: ObjectBoxes, anchor: int, _: bool, options: GroundedOptions) -> Array:
    return np.exp(-gaps(boxes, anchor).distance / options.nearest_m)


def _farthest(boxes: ObjectBoxes, anchor: int, _: bool, options: GroundedOptions) -> Array:
    distance = gaps(boxes, anchor).distance
    return np.exp((distance - distance.max(initial=0.0)) / options.nearest_m)


def _on(boxes: ObjectBoxes, anchor: int, held: bool, options: GroundedOptions) -> Array:
    """The one's bottom at the other's top; on a shelf it stands inside the other's box, off its bottom."""
    above, below = (anchor, slice(None)) if held else (slice(None), anchor)
    level = gaps(boxes, anchor).level
    bottom, top, floor = boxes.low[above, 2], boxes.high[below, 2], boxes.low[below, 2]
    surface = np.exp(-np.abs(bottom - top) / options.height_m)
    shelf = 0.5 * ((bottom > floor + options.height_m) & (bottom < top))
    return np.exp(-level / options.touch_m) * np.maximum(surface, shelf)


def _under(boxes: ObjectBoxes, anchor: int, held: bool, options: GroundedOptions) -> Array:
    lower, upper = (anchor, slice(None)) if held else (slice(None), anchor)
    short = np.maximum(boxes.high[lower, 2] - boxes.high[upper, 2] + options.touch_m, 0.0)
    return np.exp(-gaps(boxes, anchor).level / options.touch_m) * np.exp(-short / options.height_m)


def _above(boxes: ObjectBoxes, anchor: int, held: bool, options: GroundedOptions) -> Array:
    return _under(boxes, anchor, not held, options)


def _in(boxes: ObjectBoxes, anchor: int, held: bool, options: GroundedOptions) -> Array:
    """The share of the one's box that lies in the other's, grown by `touch_m`."""
    inner, outer = (anchor, slice(None)) if held else (slice(None), anchor)
    common = np.minimum(boxes.high[inner], boxes.high[outer] + options.touch_m) - np.maximum(
        boxes.low[inner], boxes.low[outer] - options.touch_m
    )
    size = np.maximum(boxes.high[inner] - boxes.low[inner], 1e-3)
    return (np.clip(common, 0.0, None) / size).clip(0.0, 1.0).prod(axis=-1)


def _with(boxes: ObjectBoxes, anchor: int, _: bool, options: GroundedOptions) -> Array:
    """Whatever way: what is with a thing stands on it, in it, or close by."""
    on, within = (way(boxes, anchor, True, options) for way in (_on, _in))
    return np.maximum(np.maximum(on, within), _near(boxes, anchor, False, options))


def _towards(
    boxes: ObjectBoxes, kind: RelationKind, anchor: int, held: bool, viewer: Viewer | None, options: GroundedOptions
) -> Array:
    """Near, and on the side that is meant: seen by the viewer, else from the free side of the anchor."""
    ahead = _facing(boxes, anchor, viewer)
    side = DIRECTIONS[kind](ahead) * (-1.0 if held else 1.0)
    away = boxes.middle[:, :2] - boxes.middle[anchor, :2]
    cosine = away @ side / np.maximum(np.linalg.norm(away, axis=1), 1e-6)
    distance = gaps(boxes, anchor).distance
    return np.exp(-np.maximum(distance - options.near_m, 0.0) / options.nearest_m) * np.clip(cosine, 0.0, 1.0)


def _facing(boxes: ObjectBoxes, anchor: int, viewer: Viewer | None) -> Array:
    """(2,) unit: from the one who looks to the anchor; nobody known looks from the middle of what stands around."""
    middle = boxes.middle[anchor, :2]
    near = boxes.free & (np.linalg.norm(boxes.middle[:, :2] - middle, axis=1) < AROUND_M)
    near[anchor] = False
    eye = viewer.xy if viewer else (boxes.middle[near, :2].mean(axis=0) if near.any() else middle - [1.0, 0.0])
    to_anchor = middle - eye
    length = float(np.linalg.norm(to_anchor))
    return to_anchor / length if length > 1e-6 else np.array([1.0, 0.0])


MEASURES: dict[RelationKind, Callable[[ObjectBoxes, int, bool, GroundedOptions], Array]] = {
    "next to": _near,
    "nearest to": _nearest,
    "farthest from": _farthest,
    "on": _on,
    "above": _above,
    "under": _under,
    "in": _in,
    "with": _with,
}
# Which way from the anchor, by the direction in which one looks at it.
DIRECTIONS: dict[RelationKind, Callable[[Array], Array]] = {
    "in front of": lambda ahead: -ahead,
    "behind": lambda ahead: ahead,
    "left of": lambda ahead: np.array([-ahead[1], ahead[0]]),
    "right of": lambda ahead: np.array([ahead[1], -ahead[0]]),
}
