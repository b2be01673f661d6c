"""Frames acquired several at once, each in a process of its own.

Not in threads: acquisition is many short steps of numpy, between which two threads wait for each other; two took as
long as one.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from types import TracebackType
from typing import Any

import cv2
import numpy as np

from openbelief.arrays import Array
from openbelief.mapping import Acquired, SegmentedFrame
from openbelief.observation import Mask
from robot_app.cli import Failure

WAITING = 2  # frames for each worker, the one in hand included: what they take is all the memory that more jobs take
WORTH_FRAMES = 150  # acquired in the second that a worker's start takes, several times over

Work = Callable[[SegmentedFrame], Acquired]


def cores() -> int:
    """That this process may use."""
    return len(os.sched_getaffinity(0))


def jobs_for(frames: int) -> int:
    """As many as there are cores, fewer for a walk that would be over before they have all begun."""
    return max(1, min(cores(), frames // WORTH_FRAMES))


class FrameWorkers:
    """`each` of `map_frames` over so many processes, in the middle of a `with`. took: told each frame's seconds."""

    def __init__(self, jobs: int, took: Callable[[float], None]) -> None:
        self._window, self._took = WAITING * jobs, took
        context = multiprocessing.get_context("forkserver")  # a fork of this process would hold what its threads locked
        context.set_forkserver_preload([__name__])
        self._pool = ProcessPoolExecutor(jobs, context, initializer=_begin)

    def each(self, work: Work, items: Iterable[SegmentedFrame]) -> Iterator[Acquired]:
        """What work gives for each item, in their order; an item's error ends it, after all that came before it.

        So does an error of `items` itself. Raises Failure where a worker was killed.
        """
        under_way: deque[Future[tuple[Acquired, float]]] = deque()
        coming = _Coming(items)
        while True:
            while len(under_way) < self._window and (item := coming.next()) is not None:
                under_way.append(self._pool.submit(_timed, work, _Packed.of(item)))
            if not under_way:
                break
            yield self._of(under_way.popleft())
        if coming.error is not None:
            raise coming.error

    def _of(self, future: Future[tuple[Acquired, float]]) -> Acquired:
        try:
            got, seconds = future.result()
        except BrokenProcessPool as broken:
            raise Failure(
                "A process that acquires frames was killed (is memory short?). What was done is kept: run the same "
                "command again with fewer --jobs to go on."
            ) from broken
        self._took(seconds)
        return got

    def __enter__(self) -> FrameWorkers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)


class _Coming:
    """Items until they end, or until they cannot go on: that waits for its turn."""

    def __init__(self, items: Iterable[SegmentedFrame]) -> None:
        self._items = iter(items)
        self.error: Exception | None = None

    def next(self) -> SegmentedFrame | None:
        """None at the end, and ever after."""
        try:
            return None if self.error else next(self._items, None)
        except Exception as error:  # noqa: BLE001 - raised where its turn comes
            self.error = error
            return None


@dataclass(frozen=True, eq=False)
class _Packed:
    """A frame on its way, its masks as bits."""

    looked: SegmentedFrame
    shapes: list[tuple[int, ...]]

    @classmethod
    def of(cls, looked: SegmentedFrame) -> _Packed:
        pixels = [np.asarray(mask.pixels, dtype=bool) for mask in looked.masks]
        packed = [replace(m, pixels=np.packbits(p)) for m, p in zip(looked.masks, pixels, strict=True)]
        return cls(replace(looked, masks=packed), [p.shape for p in pixels])

    def unpacked(self) -> SegmentedFrame:
        masks = [_with_pixels(m, shape) for m, shape in zip(self.looked.masks, self.shapes, strict=True)]
        return replace(self.looked, masks=masks)


def _with_pixels(mask: Mask, shape: tuple[int, ...]) -> Mask:
    bits: Array = np.unpackbits(mask.pixels, count=int(np.prod(shape)))
    return replace(mask, pixels=bits.view(bool).reshape(shape))


def _timed(work: Work, packed: _Packed) -> tuple[Acquired, float]:
    began = time.perf_counter()
    return work(packed.unpacked()), time.perf_counter() - began


def _begin() -> None:
    """In a worker: Ctrl-C is the parent's to answer, and with the parent, however it ends, ends the worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    cv2.setNumThreads(1)  # the workers are the threads
    threading.Thread(target=_end_with, args=(multiprocessing.parent_process(),), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)
