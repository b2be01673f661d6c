from __future__ import annotations

import base64
import json

import numpy as np
import pytest

from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.ports import Perception
from openbelief.perception.recorded import RecordedPerception, RecordedPerceptionError

HEADER = {"format": "openbelief.perception/1", "feature_dim": 3, "text_space": "words"}
FEATURE = np.array([0.6, 0.8, 0.0], "<f2")
LINE = {
    "stamp_ns": 5,
    "mask_index": 0,
    "phrase": "red cup",
    "confidence": 0.9,
    "bbox": [0.5, 0, 2, 1.5],
    "rle": {"size": [2, 3], "counts": [1, 2, 3]},
    "feature": base64.b64encode(FEATURE.tobytes()).decode(),
}


def write(tmp_path, *lines, header=HEADER):
    path = tmp_path / "walk.perception.jsonl"
    path.write_text("".join((line if isinstance(line, str) else json.dumps(line)) + "\n" for line in (header, *lines)))
    return path


def frame(stamp_ns: int) -> RgbdFrame:
    camera = Intrinsics(3, 2, 1, 1, 1, 1)
    return RgbdFrame(0, stamp_ns, np.zeros((2, 3, 3), np.uint8), np.zeros((2, 3)), camera, np.eye(4))


def test_masks_come_back_by_stamp_and_frames_without_a_line_have_none(tmp_path):
    other = LINE | {"mask_index": 1, "phrase": None}
    recorded = RecordedPerception(write(tmp_path, LINE, LINE | {"stamp_ns": 6}, other))
    assert isinstance(recorded, Perception) and recorded.feature_text_aligned and recorded.text_space == "words"
    first, second = recorded.perceive(frame(5))
    assert (first.index, first.phrase, first.confidence, second.phrase) == (0, "red cup", 0.9, None)
    assert first.pixels.tolist() == [[False, True, False], [True, False, False]]  # column by column
    np.testing.assert_allclose(first.feature, [0.6, 0.8, 0], atol=1e-3)
    assert recorded.perceive(frame(7)) == [] and recorded.stamps == {5, 6}


def test_features_that_are_not_in_a_text_space_say_so(tmp_path):
    assert not RecordedPerception(write(tmp_path, header=HEADER | {"feature_text_aligned": False})).feature_text_aligned


def test_the_id_changes_with_the_content(tmp_path):
    first = RecordedPerception(write(tmp_path, LINE)).id
    assert RecordedPerception(write(tmp_path, LINE)).id == first
    assert RecordedPerception(write(tmp_path, LINE | {"phrase": "cup"})).id != first


def encoded(*values) -> str:
    return base64.b64encode(np.array(values, "<f2").tobytes()).decode()


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("{not json", "Invalid JSON"),
        ("[]", "should be an object"),
        ({k: v for k, v in LINE.items() if k != "confidence"}, "confidence: Field required"),
        (LINE | {"confidence": 0}, "confidence: .*greater than 0"),
        (LINE | {"confidence": 1.5}, "confidence: .*less than or equal to 1"),
        (json.dumps(LINE).replace("0.9", "NaN"), "confidence|JSON"),
        (LINE | {"stamp_ns": "5"}, "stamp_ns: .*integer"),
        (LINE | {"stamp_ns": -1}, "stamp_ns: .*greater"),
        (LINE | {"phrase": 7}, "phrase: .*string"),
        (LINE | {"bbox": [1, 2, 3]}, "bbox: .*4 items"),
        (LINE | {"rle": {"size": [2, 3], "counts": [1, 2]}}, "should fill 2x3 pixels"),
        (LINE | {"rle": {"size": [2, 3], "counts": [9, -3]}}, r"rle.counts.1"),
        (LINE | {"rle": {"size": [10**9, 3], "counts": [1]}}, r"rle.size.0"),
        (LINE | {"feature": "%%%"}, "not base64"),
        (LINE | {"feature": encoded(1, 0)}, r"3 float16 \(6 bytes\), got 4"),
        (LINE | {"feature": encoded(1, 1, 1)}, "unit length"),
        (LINE | {"feature": encoded(np.nan, 1, 0)}, "finite"),
        (LINE, "mask 0 of stamp 5 is on line 2 too"),
    ],
)
def test_a_bad_line_is_refused_by_its_number_and_what_is_wrong_with_it(tmp_path, line, what):
    with pytest.raises(RecordedPerceptionError, match=what) as refused:
        RecordedPerception(write(tmp_path, LINE, line))
    assert " line 3: " in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "header",
    ["", "{}", HEADER | {"format": "other/1"}, HEADER | {"feature_dim": 0}, HEADER | {"feature_dtype": "f4"}, LINE],
)
def test_a_file_without_its_header_is_refused(tmp_path, header):
    with pytest.raises(RecordedPerceptionError, match=r"line 1 is not the header of a openbelief.perception/1 file"):
        RecordedPerception(write(tmp_path, header=header))


def test_a_missing_file_is_refused_in_one_line(tmp_path):
    with pytest.raises(RecordedPerceptionError, match="cannot be read: No such file"):
        RecordedPerception(tmp_path / "nothing.jsonl")
