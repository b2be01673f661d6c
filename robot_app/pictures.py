"""A trial as pictures: the flat from above with the way, the candidates and the verdicts; what each arrival saw."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from drivers.ports import CameraFrame
from logs import trial_records as records
from logs.journal import Entry
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.traversability import OccupancyGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Kind = TypeVar("Kind", bound=records.Record)

INK, FAINT, PAPER = "#22303c", "#b9c2c9", "#ffffff"
CONFIRMED, REJECTED, ASIDE, OTHER = "#1b8a5a", "#c8372d", "#c98a12", "#5b7c99"
VERDICT_COLOUR = {"confirmed": CONFIRMED, "rejected": REJECTED, "set aside": ASIDE, "candidate": OTHER}
CHECKS = (("visibility", "visible"), ("semantic", "says so"), ("geometric", "stands there"))


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
    for order, (object_id, verdict) in enumerate(verdicts.items(), start=1):
        _draw_candidate(axes, memory.objects[object_id], order, verdict)
    query, end = _last(entries, records.Query), _last(entries, records.Ended)
    title = f"“{query.sentence}”" if query else "trial"
    axes.set_title(_wrapped(f"{title}  {end.end}: {end.reason}" if end else title, 100), color=INK, loc="left")
    axes.set_xlabel("x in the map, m", color=INK)
    axes.set_ylabel("y in the map, m", color=INK)
    axes.set_aspect("equal")
    axes.autoscale_view()
    return figure


def arrival_views(entries: Sequence[Entry], memory: ObjectMemory) -> Iterable[Figure]:
    """What the robot saw at each check, with the masks, the three values against their thresholds, and the verdict."""
    frame: CameraFrame | None = None
    segments: records.Segments | None = None
    for entry in entries:
        if isinstance(entry.attached, CameraFrame):
            frame = entry.attached
        elif isinstance(entry.record, records.Segments):
            segments = entry.record
        elif isinstance(entry.record, records.Checks) and frame is not None and segments is not None:
            yield _arrival_view(entry.record, frame, segments, memory.objects[entry.record.object_id])


def _arrival_view(checks: records.Checks, frame: CameraFrame, segments: records.Segments, node: ObjectNode) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 5.4), layout="constrained")
    axes, beside = figure.subplots(1, 2, width_ratios=[2.1, 1])
    axes.imshow(frame.color)
    for segment in segments.masks:
        best = segment.index == checks.mask_index
        axes.contour(segment.mask().pixels, [0.5], colors=[CONFIRMED if best else PAPER], linewidths=2.5 if best else 1)
    axes.set_axis_off()
    for segment in segments.masks:
        pixels = segment.mask().pixels
        if segment.phrase and pixels.any():
            rows, columns = np.nonzero(pixels)
            best = segment.index == checks.mask_index
            axes.text(
                columns.mean(),
                rows.mean(),
                segment.phrase,
                color=PAPER,
                fontsize=10 if best else 7,
                ha="center",
                weight="bold" if best else "normal",
                bbox={"boxstyle": "round", "facecolor": INK, "edgecolor": "none", "alpha": 0.75 if best else 0.45},
            )
    axes.set_title(f"at object {node.id}, mapped as “{_label(node)}”", color=INK, loc="left")
    _draw_checks(beside, checks)
    return figure


def _draw_checks(axes: Axes, checks: records.Checks) -> None:
    passed = checks.verdict == "confirmed"
    for row, (name, words) in enumerate(CHECKS):
        check: records.Check = getattr(checks, name)
        y = len(CHECKS) - row
        value = check.value if check.value is not None else 0.0
        colour = FAINT if check.value is None else CONFIRMED if value >= check.threshold else REJECTED
        axes.barh(y, np.clip(value, 0, 1), height=0.45, color=colour)
        axes.plot([check.threshold] * 2, [y - 0.32, y + 0.32], color=INK, linewidth=2)
        said = "not measured" if check.value is None else f"{value:.2f} (needs {check.threshold:.2f})"
        axes.text(0, y + 0.34, f"{row + 1}. {words}: {said}", color=INK, fontsize=10)
    axes.set_xlim(0, 1)
    axes.set_ylim(-0.2, len(CHECKS) + 0.7)
    axes.set_axis_off()
    axes.text(
        0,
        0.1,
        _wrapped(f"{checks.verdict}: {checks.reason}", 46),
        color=CONFIRMED if passed else REJECTED,
        fontsize=10,
        va="top",
    )


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
    axes.add_patch(Rectangle(low, *(high - low), facecolor=colour, edgecolor=INK, linewidth=0.4, alpha=alpha))


def _draw_candidate(axes: Axes, node: ObjectNode, order: int, verdict: str) -> None:
    colour = VERDICT_COLOUR[verdict]
    _draw_object(axes, node, colour, 0.9)
    axes.annotate(
        f"{order}. {_label(node)}\n{verdict}",
        xy=(float(node.centroid[0]), float(node.centroid[1])),
        xytext=(14, 16),
        textcoords="offset points",
        color=PAPER,
        fontsize=9,
        bbox={"boxstyle": "round", "facecolor": colour, "edgecolor": "none"},
        arrowprops={"arrowstyle": "-", "color": colour},
        zorder=6,
    )


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


def _label(node: ObjectNode) -> str:
    return max(node.concepts, key=lambda c: c.support).label if node.concepts else "unnamed"


def _last(entries: Sequence[Entry], kind: type[Kind]) -> Kind | None:
    return next((e.record for e in reversed(entries) if isinstance(e.record, kind)), None)


def _wrapped(text: str, width: int) -> str:
    return "\n".join(textwrap.wrap(text, width))


def _canvas(width: float, height: float) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()
