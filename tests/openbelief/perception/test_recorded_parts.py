from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.composed import ComposedPerception
from openbelief.perception.ports import PerceptionFailed, SegmentedMask, SegmentEncoder, Segmenter
from openbelief.perception.recorded import RecordedPerception
from openbelief.perception.recorded_parts import RecordedFeatures, RecordedSegmenter


@pytest.fixture
def recorded(make_walk, tmp_path: Path) -> RecordedPerception:
    made = make_walk(2)
    made.masks[0]["phrase"] = "Red  Box"
    return RecordedPerception(made.write_perception(tmp_path / "walk.perception.jsonl"))


@pytest.fixture
def frame(recorded: RecordedPerception) -> RgbdFrame:
    camera = Intrinsics(160, 120, 120.0, 120.0, 79.5, 59.5)
    return RgbdFrame(0, min(recorded.stamps), np.zeros((120, 160, 3), np.uint8), np.ones((120, 160)), camera, np.eye(4))


def test_only_what_is_asked_for_is_found_however_it_is_written(recorded, frame):
    segmenter = RecordedSegmenter(recorded)
    assert isinstance(segmenter, Segmenter)
    [segment] = segmenter.segment(frame, ["stove", "red box"])
    whole = recorded.perceive(frame)[0]
    assert (segment.phrase, segment.score) == ("red box", whole.confidence)
    np.testing.assert_array_equal(segment.pixels, whole.pixels)


def test_segments_come_with_the_features_that_were_recorded(recorded, frame):
    features = RecordedFeatures(recorded)
    assert isinstance(features, SegmentEncoder) and features.dim == 4 and features.text_space is None
    segments = RecordedSegmenter(recorded).segment(frame, ["green box", "red box"])
    np.testing.assert_array_equal(features.encode(frame, segments), np.eye(4)[[1, 0]])


def test_a_mask_from_elsewhere_has_no_feature_and_is_refused(recorded, frame):
    stranger = SegmentedMask("red box", 0.5, np.ones((120, 160), bool))
    with pytest.raises(PerceptionFailed, match="name the same file as segmenter"):
        RecordedFeatures(recorded).encode(frame, [stranger])


def test_a_proposer_that_says_all_phrases_gives_all_masks_back(recorded, frame):
    class Says:
        id = "says"

        def propose(self, _: RgbdFrame) -> list[str]:
            return ["red box", "green box", "blue box"]

    parts = ComposedPerception(Says(), RecordedSegmenter(recorded), RecordedFeatures(recorded)).perceive(frame)
    assert {m.pixels.tobytes() for m in parts} == {m.pixels.tobytes() for m in recorded.perceive(frame)}
