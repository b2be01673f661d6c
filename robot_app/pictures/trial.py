"""A trial as pictures: the flat from above with the way, the candidates and the verdicts; what each arrival saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from logs.trial import records
from logs.trial.journal import Entry
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.traversability import OccupancyGrid
from robot_app.pictures.arrival import arrival_views
from robot_app.pictures.style import ASIDE, CONFIRMED, INK, OTHER, PAPER, REJECTED, label_of, spread, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

Kind = TypeVar("Kind", bound=records.Record)

VERDICT_COLOUR = {"confirmed": CONFIRMED, "rejected": REJECTED, "set aside": ASIDE, "candidate": OTHER}


@dataclass(frozen=True)
class Backdrop:
    """A picture from above to draw on: (h, w, 3) uint8 RGB, its corners in the map frame, metres."""

    image: Array
    low_xy: tuple[float, float]
    high_xy: tuple[float, float]


def write_pictures(
    entries: Sequence[Entry], memory: ObjectMemory, folder: Path, backdrop: Backdrop | None = None
) -> list[Path]:
    """`top_view.png` and one `arrival_K.png` for each look at a candidate; the files written, in that order."""
    folder.mkdir(parents=True, exist_ok=True)
    figures = {"top_view.png": top_view(entries, memory, backdrop)}
    figures |= {f"arrival_{k}.png": view for k, view in enumerate(arrival_views(entries, memory), start=1)}
    for name, figure in figures.items():
        figure.savefig(folder / name, dpi=110, facecolor=PAPER)
    return [folder / name for name in figures]


def top_view(entries: Sequence[Entry], memory: ObjectMemory, backdrop: Backdrop | None = None) -> Figure:
    """The map with every object, the driven way, the goals, and the candidates in the colour of their verdict."""
    figure, axes = _canvas(10, 9)
    grid = next((e.attached for e in entries if isinstance(e.attached, OccupancyGrid)), None)
    if backdrop is not None:
        (x0, y0), (x1, y1) = backdrop.low_xy, backdrop.high_xy
        axes.imshow(backdrop.image, extent=(x0, x1, y0, y1))
    elif grid is not None:
        _draw_grid(axes, grid)
    verdicts = _verdicts(entries)
    for node in memory.objects:
        if node.id not in verdicts and not node.background:
            _draw_object(axes, node, "none", 0.7)
    _draw_way(axes, entries)
    numbered = enumerate(verdicts.items(), start=1)
    labels = [_draw_candidate(axes, memory.objects[i], order, verdict) for order, (i, verdict) in numbered]
    _draw_legend(axes)
    query, end = _last(entries, records.Query), _last(entries, records.Ended)
    title = f"“{query.sentence}”" if query else "trial"
    words = wrapped(f"{title} {end.end}: {end.reason}" if end else title, 100)
    axes.set_title(words, color=INK, loc="left", parse_math=False)
    axes.set_xlabel("x in the map, m", color=INK)
    axes.set_ylabel("y in the map, m", color=INK)
    axes.set_aspect("equal")
    axes.autoscale_view()
    spread(axes, labels, drop=False)
    return figure


def _draw_grid(axes: Axes, grid: OccupancyGrid) -> None:
    height, width = grid.cells.shape
    x, y = grid.origin_xy
    image = np.full((height, width, 3), 0.94)
    image[grid.cells == 0] = 1.0
    image[grid.cells > 0] = (0.78, 0.81, 0.84)
    extent = (x, x + width * grid.resolution_m, y, y + height * grid.resolution_m)
    axes.imshow(image, origin="lower", extent=extent, interpolation="nearest")


def _draw_object(axes: Axes, node: ObjectNode, colour: str, alpha: float) -> None:
    from matplotlib.patches import Rectangle

    low, high = np.asarray(node.aabb)[:, :2]
    axes.add_patch(Rectangle(low, *(high - low), facecolor=colour, edgecolor=INK, linewidth=0.6, alpha=alpha))


def _draw_candidate(axes: Axes, node: ObjectNode, order: int, verdict: str) -> Text:
    colour = VERDICT_COLOUR[verdict]
    _draw_object(axes, node, colour, 0.9)
    x, y = (float(v) for v in node.centroid[:2])
    return axes.annotate(
        f"{order}. {label_of(node)}\n{verdict}",
        xy=(x, y),
        xytext=(x + 0.25, y + 0.25),
        textcoords="data",
        parse_math=False,
        color=PAPER,
        fontsize=9,
        bbox={"boxstyle": "round", "facecolor": colour, "edgecolor": "none"},
        arrowprops={"arrowstyle": "-", "color": colour},
        zorder=6,
    )


def _draw_legend(axes: Axes) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles = [
        Line2D([], [], color=OTHER, linewidth=1.8, marker="o", markerfacecolor=INK, label="the way, from its start"),
        Line2D([], [], color=INK, linewidth=0, marker=">", markersize=9, label="where it stood to look"),
        Patch(facecolor="none", edgecolor=INK, linewidth=0.6, label="other objects of the map, as boxes"),
    ]
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.06), ncol=3, frameon=False, fontsize=9)


def _draw_way(axes: Axes, entries: Sequence[Entry]) -> None:
    way = [
        (e.record.pose.x, e.record.pose.y)
        for e in entries
        if isinstance(e.record, records.Feedback | records.RobotPose)
    ]
    if way:
        x, y = np.array(way).T
        axes.plot(x, y, color=OTHER, linewidth=1.8, zorder=4)
        axes.plot(x[0], y[0], marker="o", color=INK, markersize=7, zorder=5)
    for entry in entries:
        if isinstance(entry.record, records.Goal) and entry.record.pose is not None:
            pose = entry.record.pose
            axes.arrow(pose.x, pose.y, 0.3 * np.cos(pose.yaw), 0.3 * np.sin(pose.yaw), width=0.03, color=INK, zorder=5)


def _verdicts(entries: Sequence[Entry]) -> dict[int, str]:
    """Object id -> how it ended, in the order in which candidates were chosen."""
    verdicts: dict[int, str] = {}
    for entry in entries:
        if isinstance(entry.record, records.Chosen):
            verdicts[entry.record.object_id] = "candidate"
        elif isinstance(entry.record, records.Exclusion):
            verdicts[entry.record.object_id] = entry.record.where
        elif isinstance(entry.record, records.Ended) and entry.record.object_id is not None:
            verdicts[entry.record.object_id] = "confirmed"
    return verdicts


def _last(entries: Sequence[Entry], kind: type[Kind]) -> Kind | None:
    return next((e.record for e in reversed(entries) if isinstance(e.record, kind)), None)


def _canvas(width: float, height: float) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()
