"""Shared style of a trial's pictures: colours, texts, and placing labels on the page without overlap."""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from openbelief.node import ObjectNode
from openbelief.phrase import printable

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.text import Text

INK, FAINT, PAPER = "#22303c", "#b9c2c9", "#ffffff"
CONFIRMED, REJECTED, ASIDE, OTHER, PLACE = "#1b8a5a", "#c8372d", "#c98a12", "#5b7c99", "#ffd23f"
Box = tuple[float, float, float, float]  # x0, y0, x1, y1 in the figure's pixels


def label_of(node: ObjectNode) -> str:
    return printable(node.label, 40) if node.label else "unnamed"


def wrapped(text: str, width: int) -> str:
    return "\n".join(textwrap.wrap(printable(text, 400), width))


@contextmanager
def boxes_for_unknown_letters() -> Iterator[None]:
    """A letter that the font lacks is drawn as a box, which shows: no warning for each of them."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Glyph .* missing")
        yield


def spread(axes: Axes, labels: Sequence[Text], *, drop: bool) -> None:
    """Move labels, the first ones first, to where they lie inside the axes and on no earlier one.

    drop: one that has no free place goes; else it stays inside and covers another.
    """
    figure = axes.figure
    for label in labels:
        label.set_in_layout(False)
    with boxes_for_unknown_letters():
        figure.draw_without_rendering()  # type: ignore[union-attr]
    page = _box(axes)
    taken: list[Box] = []
    for label in labels:
        box = _box(label.get_bbox_patch() or label)
        places = [_inside(each, page) for each in _around(box)]
        free = next((each for each in places if not any(_meet(each, other) for other in taken)), None)
        if free is None and drop:
            label.remove()
            continue
        chosen = free or places[0]
        x, y = label.get_transform().transform(label.get_position())
        moved = (x + chosen[0] - box[0], y + chosen[1] - box[1])
        label.set_position(tuple(label.get_transform().inverted().transform(moved)))
        taken.append(chosen)


def _box(artist: Artist) -> Box:
    x0, y0, x1, y1 = artist.get_window_extent().extents
    return x0, y0, x1, y1


def _around(box: Box) -> Iterator[Box]:
    """The box where it is, then one and two steps above, below and beside."""
    x0, y0, x1, y1 = box
    width, height = x1 - x0 + 2, y1 - y0 + 2
    for across, up in (
        (0, 0),
        (0, 1),
        (0, -1),
        (0.6, 0),
        (-0.6, 0),
        (0.6, 1),
        (-0.6, 1),
        (0.6, -1),
        (-0.6, -1),
        (0, 2),
        (0, -2),
    ):
        yield (x0 + across * width, y0 + up * height, x1 + across * width, y1 + up * height)


def _inside(box: Box, page: Box) -> Box:
    x0, y0, x1, y1 = box
    right = min(0.0, page[2] - x1 - 2) or max(0.0, page[0] + 2 - x0)
    up = min(0.0, page[3] - y1 - 2) or max(0.0, page[1] + 2 - y0)
    return (x0 + right, y0 + up, x1 + right, y1 + up)


def _meet(one: Box, other: Box) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
