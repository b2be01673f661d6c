"""Phrases, masks and features from small networks that run on any CPU: for laptops and Jetsons without a VLM.

Its words are the detector's fixed classes with a colour where the thing has one; its features serve association only.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from openbelief.arrays import Array
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.appearance import MobileNetAppearance
from openbelief.perception.box_mask import SalientBoxMask, whole_pixels
from openbelief.perception.boxes import Boxes
from openbelief.perception.color_word import color_word
from openbelief.perception.nanodet import NanoDet
from openbelief.perception.onnx_session import ModelFileError
from openbelief.perception.stages import Stage, in_turn
from openbelief.perception.yolo_seg import YoloFound, YoloSeg, masks_of

NANODET, BOX_MASK, APPEARANCE = "nanodet_m_416_coco_f16.onnx", "u2netp.onnx", "mobilenetv2_1280.onnx"
SEGMENTERS = "*seg*.onnx"


@dataclass(frozen=True)
class Instance:
    """One thing: its class, the detector's score and box (x0, y0, x1, y1), and its (h, w) bool pixels."""

    label: str
    score: float
    box: Array
    pixels: Array


class InstanceFinder(Protocol):
    """Boxes first, then the pixels of each."""

    @property
    def id(self) -> str: ...

    def find(self, frame: RgbdFrame) -> Any: ...

    def masks(self, frame: RgbdFrame, found: Any) -> list[Instance]:
        """Those of which there are pixels."""
        ...


class BoxesThenMasks:
    """InstanceFinder over a box detector and a box-prompted segmenter."""

    def __init__(self, detector: NanoDet, segmenter: SalientBoxMask) -> None:
        self._detector, self._segmenter = detector, segmenter

    @property
    def id(self) -> str:
        return f"{self._detector.id} | {self._segmenter.id}"

    def find(self, frame: RgbdFrame) -> Boxes:
        return self._detector.detect(frame.color)

    def masks(self, frame: RgbdFrame, found: Boxes) -> list[Instance]:
        masks = (self._segmenter.mask(frame.color, frame.depth_m, box) for box in found.xyxy)
        return _instances(found, self._detector.names, masks)


class OneNetwork:
    """InstanceFinder over an instance-segmentation network."""

    def __init__(self, network: YoloSeg) -> None:
        self._network = network

    @property
    def id(self) -> str:
        return self._network.id

    def find(self, frame: RgbdFrame) -> YoloFound:
        return self._network.detect(frame.color)

    def masks(self, frame: RgbdFrame, found: YoloFound) -> list[Instance]:
        return _instances(found.boxes, self._network.names, masks_of(found, frame.depth_m.shape))


class Detector:
    """Perception port over an InstanceFinder and an appearance feature."""

    feature_text_aligned = False

    def __init__(self, finder: InstanceFinder, appearance: MobileNetAppearance) -> None:
        self._finder, self._appearance = finder, appearance
        self.stages = (
            Stage("boxes", lambda frame, _: finder.find(frame)),
            Stage("masks", finder.masks),
            Stage("features", self._masks),
        )

    @property
    def id(self) -> str:
        return f"detector[{self._finder.id} | {self._appearance.id}]"

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """All stages, one after the other. Raises BadModelOutput naming the network."""
        return in_turn(self.stages, frame)

    def close(self) -> None:
        """Nothing is waited for."""

    def _masks(self, frame: RgbdFrame, found: list[Instance]) -> list[Mask]:
        rows = self._appearance.encode([_crop(frame, instance.box) for instance in found])
        return [
            Mask(index, instance.pixels, _phrase(frame, instance), instance.score, row)
            for index, (instance, row) in enumerate(zip(found, rows, strict=True))
        ]


def open_detector(path: str | os.PathLike[str], *, threads: int | None = None) -> Detector:
    """The detector of a folder: its one *seg*.onnx in the YOLO-seg layout, or else NanoDet and u2netp.

    path: the folder, or the *.onnx to use of several. Raises ModelFileError naming what is missing.
    """
    given = Path(path)
    folder = given.parent if given.suffix == ".onnx" else given
    if not folder.is_dir():
        raise ModelFileError(f"{folder} is not a folder with models: see openbelief models list.")
    segmenter = given if folder != given else _segmenter_in(folder)
    finder: InstanceFinder
    if segmenter is not None:
        finder = OneNetwork(YoloSeg(segmenter, threads=threads))
    else:
        detector = NanoDet(folder / NANODET, threads=threads)
        finder = BoxesThenMasks(detector, SalientBoxMask(folder / BOX_MASK, threads=threads))
    return Detector(finder, MobileNetAppearance(folder / APPEARANCE, threads=threads))


def _segmenter_in(folder: Path) -> Path | None:
    found = sorted(folder.glob(SEGMENTERS))
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise ModelFileError(f"{folder} holds several segmentation networks ({names}): name one, detector:{found[0]}.")
    return found[0] if found else None


def _instances(boxes: Boxes, names: tuple[str, ...], masks: Iterable[Array]) -> list[Instance]:
    found = zip(boxes.classes, boxes.scores, boxes.xyxy, masks, strict=True)
    return [Instance(names[c], min(float(s), 1.0), box, pixels) for c, s, box, pixels in found if pixels.any()]


def _phrase(frame: RgbdFrame, instance: Instance) -> str:
    word = color_word(frame.color, instance.pixels)
    return f"{word} {instance.label}" if word else instance.label


def _crop(frame: RgbdFrame, box: Array) -> Array:
    x0, y0, x1, y1 = whole_pixels(box, frame.intrinsics.width, frame.intrinsics.height)
    return frame.color[y0:y1, x0:x1]
