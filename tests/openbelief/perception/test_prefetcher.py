from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest

from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.perception.cache import CachedPerception
from openbelief.perception.ports import FrameUnseen, Perception, PerceptionFailed
from openbelief.perception.prefetcher import Prefetcher
from openbelief.perception.recorded import RecordedPerception
from openbelief.perception.stages import Stage

WAIT_S = 20.0


def frame(index: int) -> RgbdFrame:
    camera = Intrinsics(4, 3, 1, 1, 1, 1)
    return RgbdFrame(index, 100 + index, np.zeros((3, 4, 3), np.uint8), np.zeros((3, 4)), camera, np.eye(4))


class Steps:
    """StagedPerception of three steps, each counted; a test may step in between. The mask says which frame it is of."""

    id, feature_text_aligned = "steps", False

    def __init__(self, before: Callable[[str, int], None] = lambda *_: None, workers: int = 2) -> None:
        self.before, self.taken, self.closed = before, [], threading.Event()
        names = ("phrases", "segments", "features")
        self.stages = tuple(Stage(n, self._step(n), workers if n == "phrases" else 1) for n in names)

    def _step(self, name: str) -> Callable[[RgbdFrame, Any], Any]:
        def run(of: RgbdFrame, value: Any) -> Any:
            self.before(name, of.index)
            self.taken.append((name, of.index))
            if name != "features":
                return [*(value or []), name]
            assert value == ["phrases", "segments"]
            pixels = np.ones((3, 4), bool)
            return [Mask(0, pixels, f"thing {of.index}", 0.5, np.eye(2, dtype=np.float32)[of.index % 2])]

        return run

    def perceive(self, of: RgbdFrame) -> list[Mask]:
        raise NotImplementedError

    def close(self) -> None:
        self.closed.set()


def phrases(ahead: Prefetcher, frames: Iterator[RgbdFrame]) -> list[str | None]:
    return [ahead.perceive(each)[0].phrase for each in ahead.over(frames)]


@pytest.fixture
def look(tmp_path) -> Callable[[Steps], Prefetcher]:
    def make(steps: Steps) -> Prefetcher:
        cache = CachedPerception(steps, tmp_path / "cache.jsonl", recording="walk", text_space=None)
        return Prefetcher(steps, cache, lambda _: nullcontext())

    return make


def test_frames_keep_their_order_and_their_masks_whichever_is_ready_first(look):
    first_is_asked_last = threading.Event()

    def before(name: str, index: int) -> None:
        if name == "phrases" and index == 0:
            assert first_is_asked_last.wait(WAIT_S)
        elif name == "features" and index == 3:
            first_is_asked_last.set()

    with look(Steps(before)) as ahead:
        assert isinstance(ahead, Perception)
        assert phrases(ahead, map(frame, range(10))) == [f"thing {i}" for i in range(10)]


def test_three_frames_are_at_three_stages_at_the_same_time(look):
    meeting = threading.Barrier(3)

    def before(name: str, index: int) -> None:
        if (name, index) in {("phrases", 2), ("segments", 1), ("features", 0)}:
            meeting.wait(WAIT_S)  # raises BrokenBarrierError where the stages take turns

    with look(Steps(before, workers=1)) as ahead:
        assert len(phrases(ahead, map(frame, range(5)))) == 5


def test_one_stage_works_on_as_many_frames_as_it_has_workers(look):
    meeting = threading.Barrier(4)
    with look(Steps(lambda name, i: meeting.wait(WAIT_S) and None if name == "phrases" else None, workers=4)) as ahead:
        assert len(phrases(ahead, map(frame, range(8)))) == 8


def test_decoding_waits_where_nobody_takes_the_frames(look):
    read, last_stage = [], threading.Event()

    def reader() -> Iterator[RgbdFrame]:
        for index in range(100):
            read.append(index)
            yield frame(index)

    with look(Steps(lambda name, i: last_stage.set() if (name, i) == ("features", 5) else None)) as ahead:
        frames = ahead.over(reader())
        next(frames)
        assert last_stage.wait(WAIT_S)  # six frames are through all stages, and only one of them is taken
        assert len(read) < 12


def test_an_error_comes_out_at_its_frame_and_not_before(look):
    def before(name: str, index: int) -> None:
        if (name, index) == ("segments", 3):
            raise PerceptionFailed("out of memory")

    steps = Steps(before)
    with pytest.raises(PerceptionFailed, match="out of memory"), look(steps) as ahead:
        seen: list[str | None] = []
        seen.extend(ahead.perceive(each)[0].phrase for each in ahead.over(map(frame, range(10))))
    assert seen == ["thing 0", "thing 1", "thing 2"]
    assert steps.closed.is_set()


def test_what_has_its_phrases_when_another_frame_fails_is_kept(look, tmp_path):
    failed, known = threading.Event(), threading.Event()

    def before(name: str, index: int) -> None:
        if (name, index) == ("segments", 1):
            assert known.wait(WAIT_S)  # until frames 2 and 3 have their phrases
            failed.set()
            raise PerceptionFailed("gone")
        if (name, index) == ("phrases", 4):
            known.set()
            assert failed.wait(WAIT_S)

    steps = Steps(before, workers=1)
    with pytest.raises(PerceptionFailed), look(steps) as ahead:
        phrases(ahead, map(frame, range(10)))
    assert RecordedPerception(tmp_path / "cache.jsonl").stamps >= {100, 102, 103}
    once = [index for name, index in steps.taken if name == "phrases"]
    again = Steps()
    with look(again) as ahead:
        assert phrases(ahead, map(frame, range(10))) == [f"thing {i}" for i in range(10)]
    twice = set(once) & {index for name, index in again.taken if name == "phrases"}
    assert twice == {1}  # the one that failed


def test_a_frame_that_cannot_be_looked_at_does_not_stop_the_next(look):
    def before(name: str, index: int) -> None:
        if (name, index) == ("phrases", 1):
            raise FrameUnseen("the model said nothing")

    said = []
    with look(Steps(before)) as ahead:
        for each in ahead.over(map(frame, range(4))):
            try:
                said.append(ahead.perceive(each)[0].phrase)
            except FrameUnseen as unseen:
                said.append(str(unseen))
    assert said == ["thing 0", "the model said nothing", "thing 2", "thing 3"]


def test_a_reader_that_fails_is_heard_after_the_frames_before(look):
    def reader() -> Iterator[RgbdFrame]:
        yield from map(frame, range(2))
        raise OSError("the disk is gone")

    seen: list[str | None] = []
    with pytest.raises(OSError, match="the disk is gone"), look(Steps()) as ahead:
        seen.extend(ahead.perceive(each)[0].phrase for each in ahead.over(reader()))
    assert seen == ["thing 0", "thing 1"]


def test_no_thread_stays_behind(look):
    before = set(threading.enumerate())
    with look(Steps()) as ahead:
        phrases(ahead, map(frame, range(3)))
    with pytest.raises(KeyboardInterrupt), look(Steps()) as ahead:
        for each in ahead.over(map(frame, range(50))):
            ahead.perceive(each)
            raise KeyboardInterrupt
    assert set(threading.enumerate()) == before


def test_a_request_that_hangs_does_not_hold_up_the_leaving(look, monkeypatch, tmp_path):
    monkeypatch.setattr("openbelief.perception.prefetcher.LEAVE_S", 0.2)
    hanging = threading.Event()
    with pytest.raises(KeyboardInterrupt), look(Steps(lambda name, i: i == 3 and hanging.wait(WAIT_S))) as ahead:
        for each in ahead.over(map(frame, range(9))):
            if ahead.perceive(each)[0].phrase == "thing 2":
                raise KeyboardInterrupt
    assert not hanging.is_set()
    hanging.set()
    assert RecordedPerception(tmp_path / "cache.jsonl").stamps >= {100, 101, 102}
