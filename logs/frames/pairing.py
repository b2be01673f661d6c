"""What belongs to a colour image: the depth image of its moment, its calibration, and where the camera was."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np

from drivers.ports import PoseUnavailable
from drivers.ros.calibration import is_rectified
from drivers.ros.messages import Message
from drivers.ros.refusals import ImageRefused
from drivers.ros.transform_edge import TransformMissing
from drivers.ros.transform_tree import TransformTree
from logs.frames.calibrations import Calibrations
from logs.frames.reasons import TRANSFORM_REASONS, FrameReason, SkipFrame
from logs.frames.scan import ImageHead, Scan
from logs.frames.topics import RecordingTopics, base
from openbelief.arrays import Array
from openbelief.observation import Intrinsics


@dataclass(frozen=True)
class PlanOptions:
    """How to read: as `logs.frames.reader.FrameReader` says."""

    topics: RecordingTopics
    map_frame: str
    stride: int
    pair_tolerance_s: float
    depth_offset_s: float = 0.0
    depth_is_aligned: bool = False


@dataclass(frozen=True)
class PlannedFrame:
    """A frame whose pictures are still to be decoded. index: the colour image's rank in the recording.

    color, depth: where the pictures are. info: the camera_info that `intrinsics` is of; depth_info: the depth's own,
    where the recording has it.
    """

    index: int
    stamp_ns: int
    color: ImageHead
    depth: ImageHead
    intrinsics: Intrinsics
    info: Message
    depth_info: Intrinsics | None
    T_map_camera: Array


class Pairing:
    """Finds what belongs to a colour image, or raises SkipFrame."""

    def __init__(self, found: Scan, topics: RecordingTopics, options: PlanOptions) -> None:
        color, depth, info = str(topics.color), str(topics.depth), str(topics.camera_info)
        self._trees, self._options = found.trees, options
        self._tolerance_ns = round(options.pair_tolerance_s * 1e9)
        self._color_epochs = found.epochs.of_stream(color)
        self._depths = _by_epoch(
            found.images[depth], found.epochs.of_stream(depth), round(options.depth_offset_s * 1e9)
        )
        self._calibrations = Calibrations(found.infos[info], rectified=is_rectified(color))
        beside = found.infos.get(base(depth).rpartition("/")[0] + "/camera_info", [])
        self._depth_calibrations = Calibrations(beside, rectified=is_rectified(depth)) if beside else None
        self._apart_s = self._usual_distance_s(found.images[color])

    def frame(self, index: int, color: ImageHead) -> PlannedFrame:
        tree = self._trees[self._color_epochs[color.mark.order]]
        stamp_ns, frame_id = color.mark.stamp_ns, color.frame_id
        depth = self._depth_of(color)
        self._require_aligned(tree, stamp_ns, frame_id, depth.frame_id)
        try:
            camera, info = self._calibrations.of(color.mark)
        except ImageRefused as refused:
            raise SkipFrame(refused.reason, str(refused)) from refused
        try:
            T_map_camera = tree.lookup(stamp_ns, self._options.map_frame, frame_id)
        except PoseUnavailable as error:
            raise SkipFrame(TRANSFORM_REASONS[type(error)], str(error)) from error
        return PlannedFrame(index, stamp_ns, color, depth, camera, info, self._depth_camera(depth), T_map_camera)

    def _depth_camera(self, depth: ImageHead) -> Intrinsics | None:
        try:
            return self._depth_calibrations.of(depth.mark)[0] if self._depth_calibrations else None
        except ImageRefused:
            return None  # it is only compared with the colour camera's

    def _depth_of(self, color: ImageHead) -> ImageHead:
        nearest = self._nearest(color)
        stamp_ns = color.mark.stamp_ns
        if nearest is None:
            raise SkipFrame(FrameReason.NO_DEPTH, f"No depth image at all around {stamp_ns}.")
        away_ns, depth = nearest
        if abs(away_ns) > self._tolerance_ns:
            usual = "" if self._apart_s is None else f", as usual here {1e3 * self._apart_s:+.1f} ms"
            raise SkipFrame(
                FrameReason.NO_DEPTH,
                f"No depth image within {self._tolerance_ns / 1e6:g} ms of {stamp_ns}: the nearest is "
                f"{away_ns / 1e6:+.1f} ms away{usual}.",
            )
        return depth

    def _nearest(self, color: ImageHead) -> tuple[int, ImageHead] | None:
        """(its stamp after the colour's, once its clock is shifted, nanoseconds; the depth image)."""
        stamps, heads = self._depths[self._color_epochs[color.mark.order]]
        at = bisect_left(stamps, color.mark.stamp_ns)
        around = range(max(at - 1, 0), min(at + 1, len(stamps)))
        i = min(around, key=lambda i: abs(stamps[i] - color.mark.stamp_ns), default=None)
        return None if i is None else (stamps[i] - color.mark.stamp_ns, heads[i])

    def _usual_distance_s(self, colors: Sequence[ImageHead]) -> float | None:
        """Between colour and the nearest depth, signed: what --depth-offset-s would take away."""
        away = [found[0] for head in colors[:: max(len(colors) // 100, 1)] if (found := self._nearest(head))]
        return median(away) / 1e9 if away else None

    def _require_aligned(self, tree: TransformTree, stamp_ns: int, color_frame: str, depth_frame: str) -> None:
        """Depth in another frame than colour is used only where /tf says that the two are one, or a person does."""
        if self._options.depth_is_aligned or depth_frame.lstrip("/") == color_frame.lstrip("/"):
            return
        said = f"Depth is in {depth_frame!r}, colour in {color_frame!r}"
        try:
            aligned = np.allclose(tree.lookup(stamp_ns, color_frame, depth_frame), np.eye(4))
        except TransformMissing as error:
            raise SkipFrame(FrameReason.NOT_ALIGNED, f"{said}, and no transform joins the two.") from error
        except PoseUnavailable as error:
            raise SkipFrame(TRANSFORM_REASONS[type(error)], str(error)) from error
        if not aligned:
            raise SkipFrame(FrameReason.NOT_ALIGNED, f"{said}, which is elsewhere.")


def _by_epoch(
    heads: Sequence[ImageHead], epochs: dict[int, int], offset_ns: int
) -> dict[int, tuple[list[int], list[ImageHead]]]:
    """Epoch -> (stamps on the colour's clock, the images), in the order of stamps; the first of a repeated stamp."""
    parts: dict[int, dict[int, ImageHead]] = defaultdict(dict)
    for head in heads:
        parts[epochs[head.mark.order]].setdefault(head.mark.stamp_ns - offset_ns, head)
    found = {epoch: (sorted(part), [part[stamp] for stamp in sorted(part)]) for epoch, part in parts.items()}
    return defaultdict(lambda: ([], []), found)
