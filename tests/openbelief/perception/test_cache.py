from __future__ import annotations

import numpy as np
import pytest

from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.perception.cache import CachedPerception
from openbelief.perception.recorded import RecordedPerception, RecordedPerceptionError


class Eyes:
    """Two masks a frame with features that float16 cannot hold, and a count of how often it was asked."""

    def __init__(self, name: str = "eyes") -> None:
        self.id, self.feature_text_aligned, self.asked = name, False, []

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        self.asked.append(frame.stamp_ns)
        feature = np.random.default_rng(frame.stamp_ns).normal(size=5).astype(np.float32)
        pixels = np.arange(12).reshape(3, 4) % 2 == 0
        return [Mask(i, pixels, "cup", 0.3 + 0.1 * i, feature / np.linalg.norm(feature)) for i in range(2)]


def frame(stamp_ns: int) -> RgbdFrame:
    camera = Intrinsics(4, 3, 1, 1, 1, 1)
    return RgbdFrame(0, stamp_ns, np.zeros((3, 4, 3), np.uint8), np.zeros((3, 4)), camera, np.eye(4))


def cached(path, eyes, recording="walk") -> CachedPerception:
    return CachedPerception(eyes, path, recording=recording, text_space="words")


def same(a: list[Mask], b: list[Mask]) -> bool:
    return all(
        (x.index, x.phrase, x.confidence) == (y.index, y.phrase, y.confidence)
        and np.array_equal(x.pixels, y.pixels)
        and np.array_equal(x.feature, y.feature)
        for x, y in zip(a, b, strict=True)
    )


def test_a_frame_is_looked_at_once_ever_and_gives_the_same_bits_again(tmp_path):
    path, eyes = tmp_path / "cache.jsonl", Eyes()
    with cached(path, eyes) as first:
        masks = [first.perceive(frame(stamp)) for stamp in (1, 2)]
    with cached(path, eyes) as second:
        assert all(same(second.perceive(frame(stamp)), masks[stamp - 1]) for stamp in (1, 2))
        second.perceive(frame(3))
    assert eyes.asked == [1, 2, 3]
    assert same(RecordedPerception(path).perceive(frame(1)), masks[0])  # the cache is recorded perception


@pytest.mark.parametrize(("cut", "asked_again"), [(1, [2]), (150, [2]), (700, [1, 2])])
def test_a_frame_cut_off_by_a_kill_is_looked_at_again_and_the_whole_ones_are_not(tmp_path, cut, asked_again):
    path, eyes = tmp_path / "cache.jsonl", Eyes()
    with cached(path, eyes) as first:
        masks = [first.perceive(frame(stamp)) for stamp in (1, 2)]
    path.write_bytes(path.read_bytes()[:-cut])
    with cached(path, eyes) as second:
        assert all(same(second.perceive(frame(stamp)), masks[stamp - 1]) for stamp in (1, 2))
    assert eyes.asked == [1, 2, *asked_again]
    assert RecordedPerception(path).stamps == {1, 2}


def test_a_cache_of_another_perception_or_recording_is_refused(tmp_path):
    path = tmp_path / "cache.jsonl"
    with cached(path, Eyes()) as first:
        first.perceive(frame(1))
    with pytest.raises(RecordedPerceptionError, match=r"holds masks of perception 'eyes', not 'glasses': delete it"):
        cached(path, Eyes("glasses"))
    with pytest.raises(RecordedPerceptionError, match="masks of recording 'walk', not 'other'"):
        cached(path, Eyes(), recording="other")
