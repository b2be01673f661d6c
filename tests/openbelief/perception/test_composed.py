from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pytest

from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.perception.composed import BadModelOutput, ComposedPerception
from openbelief.perception.mask_nms import mask_iou, suppress
from openbelief.perception.ports import Perception, PhraseProposer, SegmentedMask, SegmentEncoder, Segmenter
from openbelief.perception.stages import StagedPerception

SHAPE = (48, 64)
FRAME = RgbdFrame(
    0, 7, np.zeros((*SHAPE, 3), np.uint8), np.ones(SHAPE, np.float32), Intrinsics(64, 48, 50, 50, 31, 23), np.eye(4)
)


def box(x0: int, x1: int) -> np.ndarray:
    pixels = np.zeros(SHAPE, bool)
    pixels[10:20, x0:x1] = True
    return pixels


@dataclass
class Says:
    """PhraseProposer that says what it was given."""

    phrases: list[str]
    id: str = "says==1"

    def propose(self, frame: RgbdFrame) -> list[str]:
        return list(self.phrases)


@dataclass
class Finds:
    """Segmenter over a table phrase -> (score, pixels)."""

    table: dict[str, list[tuple[float, np.ndarray]]]
    id: str = "finds==1"
    asked: list[list[str]] = field(default_factory=list)

    def segment(self, frame: RgbdFrame, phrases: Sequence[str]) -> list[SegmentedMask]:
        self.asked.append(list(phrases))
        return [SegmentedMask(phrase, *found) for phrase in phrases for found in self.table.get(phrase, [])]


@dataclass
class Numbers:
    """SegmentEncoder whose rows are unit vectors by order, or what a test says."""

    id: str = "numbers==1"
    dim: int = 8
    text_space: str | None = "words==1"
    rows: np.ndarray | None = None
    batches: list[int] = field(default_factory=list)

    def encode(self, frame: RgbdFrame, segments: Sequence[SegmentedMask]) -> np.ndarray:
        self.batches.append(len(segments))
        return np.eye(8, dtype=np.float32)[: len(segments)] if self.rows is None else self.rows


def composed(table: dict, phrases: list[str] | None = None, features: Numbers | None = None) -> ComposedPerception:
    return ComposedPerception(Says(phrases or list(table)), Finds(table), features or Numbers())


def test_the_parts_fit_their_ports():
    assert isinstance(Says([]), PhraseProposer) and isinstance(Finds({}), Segmenter)
    assert isinstance(Numbers(), SegmentEncoder) and isinstance(composed({}), Perception)
    assert isinstance(composed({}), StagedPerception)


def test_every_segment_becomes_a_mask_with_its_phrase_its_score_and_its_row():
    parts = {"cup": [(0.9, box(0, 10))], "chair": [(0.6, box(20, 40)), (0.7, box(42, 60))]}
    features = Numbers()
    masks = composed(parts, features=features).perceive(FRAME)
    assert [(mask.index, mask.phrase, mask.confidence) for mask in masks] == [
        (0, "cup", 0.9),
        (1, "chair", 0.6),
        (2, "chair", 0.7),
    ]
    np.testing.assert_array_equal([mask.feature for mask in masks], np.eye(8)[:3])
    assert features.batches == [3]


def test_the_stages_one_by_one_are_perceive():
    perception = composed({"cup": [(0.9, box(0, 10))]})
    assert [stage.name for stage in perception.stages] == ["phrases", "segments", "features"]
    value: list[Mask] | None = None
    for stage in perception.stages:
        value = stage.run(FRAME, value)
    [mask] = value or []
    assert mask.phrase == "cup" and mask.confidence == 0.9


def test_a_double_of_one_phrase_goes_and_a_second_phrase_for_it_stays():
    parts = {"mug": [(0.6, box(0, 10)), (0.9, box(0, 11))], "cup": [(0.5, box(0, 10))]}
    masks = composed(parts).perceive(FRAME)
    assert [(mask.phrase, mask.confidence) for mask in masks] == [("mug", 0.9), ("cup", 0.5)]


def test_suppression_is_by_overlap_over_eight_tenths():
    eight = [SegmentedMask("a", 0.9, box(0, 10)), SegmentedMask("a", 0.8, box(0, 8))]  # IoU 0.8: not over it
    more = [SegmentedMask("a", 0.8, box(0, 9)), SegmentedMask("a", 0.9, box(0, 10))]  # IoU 0.9
    assert len(suppress(eight)) == 2
    assert [segment.score for segment in suppress(more)] == [0.9]
    np.testing.assert_allclose(mask_iou(np.stack([box(0, 10), box(0, 8), box(20, 30)]))[0], [1, 0.8, 0])


def test_a_suppressed_mask_suppresses_nothing():
    chain = [SegmentedMask("a", s, box(x, x + 20)) for s, x in ((0.9, 0), (0.8, 2), (0.7, 4))]  # 0.82, 0.82, then 0.67
    assert [segment.score for segment in suppress(chain)] == [0.9, 0.7]


def test_no_phrase_asks_neither_the_segmenter_nor_the_encoder():
    segmenter, features = Finds({}), Numbers()
    assert ComposedPerception(Says([]), segmenter, features).perceive(FRAME) == []
    assert segmenter.asked == [] and features.batches == []


def test_an_empty_mask_is_nothing_seen():
    assert composed({"cup": [(0.9, np.zeros(SHAPE, bool))]}).perceive(FRAME) == []


@pytest.mark.parametrize("score", [0.0, -0.1, 1.1, float("nan")])
def test_a_score_outside_its_range_is_refused_by_the_networks_name(score: float):
    with pytest.raises(BadModelOutput, match="finds==1: a mask's score"):
        composed({"cup": [(score, box(0, 10))]}).perceive(FRAME)


@pytest.mark.parametrize("pixels", [np.ones((4, 4), bool), np.ones(SHAPE, np.float32)])
def test_a_mask_of_another_shape_or_type_is_refused_by_the_networks_name(pixels: np.ndarray):
    with pytest.raises(BadModelOutput, match="finds==1: a mask should be"):
        composed({"cup": [(0.9, pixels)]}).perceive(FRAME)


@pytest.mark.parametrize("rows", [np.full((1, 8), np.nan), np.ones((2, 8))])
def test_features_that_are_not_finite_or_not_one_each_are_refused(rows: np.ndarray):
    with pytest.raises(BadModelOutput, match="numbers==1 gave"):
        composed({"cup": [(0.9, box(0, 10))]}, features=Numbers(rows=rows)).perceive(FRAME)


def test_the_id_names_every_part_and_alignment_follows_the_features():
    perception = composed({})
    assert perception.id == "paper[says==1 | finds==1 | numbers==1]"
    assert perception.feature_text_aligned and perception.text_space == "words==1"
    assert not composed({}, features=Numbers(text_space=None)).feature_text_aligned
