"""Frames under way at once: while one is segmented, the next is asked about. The slowest stage sets the pace.

Each stage has its own threads; at most `window` frames are between decoding and use. Frames come out in the order in
which they went in, each with what `perceive` would have given, so that the memory does not depend on timing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from queue import SimpleQueue
from threading import Event, Semaphore, Thread
from types import TracebackType
from typing import Any

from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.cache import CachedPerception
from openbelief.perception.retry import RetryStopped
from openbelief.perception.stages import Stage, StagedPerception

LEAVE_S = 5.0  # for frames that have their phrases already; a request to a server may hang for a minute


@dataclass
class _Job:
    """One frame on its way; `done` once value or error is final."""

    frame: RgbdFrame
    value: Any = None
    error: BaseException | None = None
    done: Event = field(default_factory=Event)


class Prefetcher:
    """Perception port for the frames that `over` yields, in the middle of a `with`.

    Left by an exception, frames that already have their phrases are still brought into the cache; others are dropped.
    timed: a context manager per stage; it is entered by many threads.
    """

    def __init__(
        self, perception: StagedPerception, cache: CachedPerception, timed: Callable[[str], AbstractContextManager[Any]]
    ) -> None:
        self.id, self.feature_text_aligned = perception.id, perception.feature_text_aligned
        self._perception, self._cache, self._timed = perception, cache, timed
        self._stages = (*perception.stages, Stage("cache", cache.keep))
        self._inboxes: list[SimpleQueue[_Job | None]] = [SimpleQueue() for _ in self._stages]
        self._order: SimpleQueue[_Job | None] = SimpleQueue()
        # Every worker busy, and a frame waiting in front of every stage.
        self._window = Semaphore(sum(stage.workers for stage in self._stages) + len(self._stages))
        self._leaving = Event()
        self._feeder: Thread | None = None
        self._feed_error: BaseException | None = None
        self._current: _Job | None = None
        self._workers = [
            [Thread(target=self._work, args=(number,), name=stage.name, daemon=True) for _ in range(stage.workers)]
            for number, stage in enumerate(self._stages)
        ]

    def over(self, frames: Iterable[RgbdFrame]) -> Iterator[RgbdFrame]:
        """The same frames; a thread reads them ahead."""
        self._feeder = Thread(target=self._feed, args=(frames,), name="read", daemon=True)
        self._feeder.start()
        while (job := self._order.get()) is not None:
            self._current = job
            yield job.frame
            self._window.release()
        if self._feed_error is not None:
            raise self._feed_error

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        """Wait for the frame that `over` yielded last. Raises what its stages raised."""
        job = self._current
        if job is None or job.frame is not frame:
            raise ValueError("Prefetcher perceives the frame that it yielded last.")
        job.done.wait()
        if job.error is not None:
            raise job.error
        return list(job.value)

    def __enter__(self) -> Prefetcher:
        for worker in (worker for workers in self._workers for worker in workers):
            worker.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._leaving.set()
        if kind is not None:
            self._perception.close()
        self._window.release()  # the feeder may stand at the window
        farewell = Thread(target=self._see_off, daemon=True)
        farewell.start()
        farewell.join(LEAVE_S)

    def _see_off(self) -> None:
        """Stage by stage, so that what one still has in hand reaches the next."""
        if self._feeder is not None:
            self._feeder.join()
        for inbox, workers in zip(self._inboxes, self._workers, strict=True):
            for _ in workers:
                inbox.put(None)
            for worker in workers:
                worker.join()

    def _feed(self, frames: Iterable[RgbdFrame]) -> None:
        try:
            for frame in frames:
                self._window.acquire()
                if self._leaving.is_set():
                    return
                self._submit(_Job(frame))
        except BaseException as error:  # noqa: BLE001 - raised where the frames are used
            self._feed_error = error
        finally:
            self._order.put(None)

    def _submit(self, job: _Job) -> None:
        job.value = self._cache.known(job.frame)
        self._order.put(job)
        if job.value is None:
            self._inboxes[0].put(job)
        else:
            job.done.set()

    def _work(self, number: int) -> None:
        last = number + 1 == len(self._stages)
        while (job := self._inboxes[number].get()) is not None:
            self._run(number, job)
            if last or job.error is not None:
                job.done.set()
            else:
                self._inboxes[number + 1].put(job)

    def _run(self, number: int, job: _Job) -> None:
        stage = self._stages[number]
        try:
            if number == 0 and self._leaving.is_set():
                raise RetryStopped("The mapping ended before this frame was looked at.")
            with self._timed(stage.name):
                job.value = stage.run(job.frame, job.value)
        except BaseException as error:  # noqa: BLE001 - raised where the frame is used
            job.error = error
