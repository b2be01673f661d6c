"""What the robot saw at a candidate: the masks, the place that the map remembers, the three checks, and the verdict."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from drivers.ports import CameraFrame
from logs.trial import records
from logs.trial.journal import Entry
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.phrase import printable
from openbelief.pose import apply, inverse
from openbelief.visibility import in_image
from robot_app.pictures.style import CONFIRMED, FAINT, INK, PAPER, PLACE, REJECTED, label_of, spread, wrapped

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# field of Checks, what it asks, and how its value passes its threshold (as openbelief.verification decides)
Passes = Callable[[float, float], bool]
CHECKS: tuple[tuple[str, str, str, Passes], ...] = (
    ("visibility", "Can the place be seen?", "needs {:.2f}", operator.ge),
    ("semantic", "Is it what was asked for?", "needs more than {:.2f}", operator.gt),
    ("geometric", "Is it at the stored place?", "needs {:.2f}", operator.ge),
)


def arrival_views(entries: Sequence[Entry], memory: ObjectMemory) -> Iterable[Figure]:
    """What the robot saw at each check, with the masks, the three values against their thresholds, and the verdict."""
    frame: CameraFrame | None = None
    segments: records.Segments | None = None
    poses: dict[tuple[int, str], Array] = {}
    for entry in entries:
        record = entry.record
        if isinstance(entry.attached, CameraFrame):
            frame = entry.attached
        elif isinstance(record, records.Transform):
            poses[record.stamp_ns, record.frame_id] = record.matrix()
        elif isinstance(record, records.Segments):
            segments = record
        elif isinstance(record, records.Checks) and frame is not None and segments is not None:
            place = stored_place(memory.objects[record.object_id], frame, poses.get((frame.stamp_ns, frame.frame_id)))
            yield _arrival_view(record, frame, segments, memory.objects[record.object_id], place)


def stored_place(node: ObjectNode, frame: CameraFrame, T_map_camera: Array | None) -> Array:
    """(h, w) bool: where P_i is in the picture, whatever stands before it; empty where the camera's pose is unknown."""
    from scipy.ndimage import binary_closing, binary_dilation

    shown = np.zeros(frame.depth_m.shape, bool)
    if T_map_camera is None:
        return shown
    in_camera = apply(inverse(T_map_camera), node.points.astype(np.float64))
    seen, column, row = in_image(in_camera, frame.intrinsics)
    shown[row[seen], column[seen]] = True
    return binary_closing(np.pad(binary_dilation(shown, iterations=3), 12), iterations=9)[12:-12, 12:-12]


def _arrival_view(
    checks: records.Checks, frame: CameraFrame, segments: records.Segments, node: ObjectNode, place: Array
) -> Figure:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(12, 5.6), layout="constrained")
    axes, beside = figure.subplots(1, 2, width_ratios=[2.1, 1])
    axes.imshow(frame.color)
    axes.set_axis_off()
    colour = CONFIRMED if checks.verdict == "confirmed" else REJECTED
    masks = {segment.index: segment.mask() for segment in segments.masks}
    for index, mask in masks.items():
        if index != checks.mask_index:
            _outline(axes, mask.pixels, PAPER, 1)
    if place.any():
        _outline(axes, place, INK, 3.4)
        _outline(axes, place, PLACE, 2, linestyles="dashed")
    if checks.mask_index in masks:
        _outline(axes, masks[checks.mask_index].pixels, colour, 2.5)
    first = sorted(masks.values(), key=lambda mask: (mask.index != checks.mask_index, -int(mask.pixels.sum())))
    words = [
        _word(axes, mask.phrase, mask.pixels, colour if mask.index == checks.mask_index else None)
        for mask in first
        if mask.phrase and mask.pixels.any()
    ]
    axes.set_title(f"at object {node.id}, mapped as “{label_of(node)}”", color=INK, loc="left", parse_math=False)
    _draw_legend(axes, colour, checks, place)
    _draw_checks(beside, checks)
    spread(axes, words, drop=True)
    return figure


def _outline(axes: Axes, pixels: Array, colour: str, width: float, **more: Any) -> None:
    """Padded, so that what touches the picture's edge is closed there."""
    height, across = pixels.shape
    columns, rows = np.arange(-1, across + 1), np.arange(-1, height + 1)
    edge = np.pad(pixels, 1).astype(float)
    axes.contour(columns, rows, edge, [0.5], colors=[colour], linewidths=width, **more)
    axes.set_xlim(-0.5, across - 0.5)
    axes.set_ylim(height - 0.5, -0.5)


def _word(axes: Axes, phrase: str, pixels: Array, best: str | None) -> Any:
    rows, columns = np.nonzero(pixels)
    return axes.text(
        float(columns.mean()),
        float(rows.mean()),
        printable(phrase, 40),
        color=PAPER,
        fontsize=10 if best else 7,
        ha="center",
        va="center",
        weight="bold" if best else "normal",
        parse_math=False,
        bbox={"boxstyle": "round", "facecolor": best or INK, "edgecolor": "none", "alpha": 0.85 if best else 0.55},
    )


def _draw_legend(axes: Axes, colour: str, checks: records.Checks, place: Array) -> None:
    from matplotlib.lines import Line2D

    place_words = "where the map remembers it" + ("" if place.any() else " (not in view)")
    handles = [Line2D([], [], color=PLACE, linestyle="dashed", linewidth=2, label=place_words)]
    if checks.mask_index is not None:
        handles.append(Line2D([], [], color=colour, linewidth=2.5, label="the mask that was judged"))
    handles.append(Line2D([], [], color=FAINT, linewidth=1, label="other masks"))
    axes.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.01), ncol=3, frameon=False, fontsize=9)


def relative_lines(relative: records.Relative) -> tuple[str, str]:
    """What the relative check held against what."""
    called = "without a name" if relative.called is None else f"called “{printable(relative.called, 30)}”"
    rival = f", like “{printable(relative.looks_like, 30)}” {relative.rival_like:.2f}" if relative.looks_like else ""
    near = f"{called}, like the words {relative.asked_like:.2f}{rival}; contrast {relative.contrast:+.2f}"
    if relative.lead is None:
        return near, "nothing else is left on the map"
    return near, f"{relative.lead:+.2f} over object {relative.rival}, the best of the rest of the map"


def _draw_checks(axes: Axes, checks: records.Checks) -> None:
    for row, (name, asks, needs, passes) in enumerate(CHECKS):
        check: records.Check = getattr(checks, name)
        y = len(CHECKS) - row
        value = check.value if check.value is not None else 0.0
        colour = FAINT if check.value is None else CONFIRMED if passes(value, check.threshold) else REJECTED
        axes.barh(y, 1, height=0.4, color=FAINT, alpha=0.25)
        axes.barh(y, np.clip(value, 0, 1), height=0.4, color=colour)
        axes.plot([check.threshold] * 2, [y - 0.28, y + 0.28], color=INK, linewidth=2)
        measured = "not measured" if check.value is None else f"{value:.2f}, {needs.format(check.threshold)}"
        axes.text(0, y + 0.32, f"{row + 1}. {asks}  {measured}", color=INK, fontsize=9)
        if name == "semantic" and checks.relative is not None:
            told = "\n".join(relative_lines(checks.relative))
            axes.text(0, y - 0.24, told, color=INK, fontsize=7, va="top", parse_math=False)
    axes.set_xlim(0, 1)
    axes.set_ylim(-0.2, len(CHECKS) + 0.7)
    axes.set_axis_off()
    passed = checks.verdict == "confirmed"
    verdict = wrapped(f"{checks.verdict}: {checks.reason}", 46)
    colour = CONFIRMED if passed else REJECTED
    axes.text(0, 0.55, verdict, color=colour, fontsize=10, va="top", parse_math=False)
