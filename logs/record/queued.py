"""Between a network thread and the disk: messages are taken without waiting, one thread converts and writes them."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType

from drivers.ports import Clock
from drivers.topics import TRANSFORMS
from logs.record.recorder import McapRecorder
from logs.record.streams import RecordedStream

DRAIN_S = 60.0
MAX_BYTES = 256 << 20  # five seconds of raw 640x480 RGB-D at 30 Hz


@dataclass(frozen=True)
class Cdr:
    """One message as it goes into the file."""

    topic: str
    type_name: str
    stamp_ns: int
    payload: bytes

    def __post_init__(self) -> None:
        if not 0 <= self.stamp_ns < 1 << 64:
            raise ValueError(f"a stamp of {self.stamp_ns} ns is none")


@dataclass(frozen=True)
class _Waiting:
    stream: RecordedStream
    size: int
    taken_ns: int
    make: Callable[[], Cdr]


class QueuedRecorder:
    """`with QueuedRecorder(recorder, clock) as queue: queue.offer(...)`; the end waits until all is written.

    Holds `max_bytes` of payloads at most; what comes when it is full is dropped and counted in `streams`.
    """

    def __init__(
        self,
        recorder: McapRecorder,
        clock: Clock,
        *,
        max_bytes: int = MAX_BYTES,
        watch: Callable[[Cdr], None] | None = None,
    ) -> None:
        """watch: sees each message that was written, on the writer's thread."""
        self._watch = watch
        self.streams: dict[str, RecordedStream] = {}
        self._recorder, self._clock, self._max_bytes = recorder, clock, max_bytes
        self._waiting: deque[_Waiting] = deque()
        self._bytes, self._busy, self._closed = 0, False, False
        self._failure: Exception | None = None
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._write_all, name="recording", daemon=True)

    def __enter__(self) -> QueuedRecorder:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()
        if error is None:
            self.check()

    @property
    def backlog_bytes(self) -> int:
        return self._bytes

    def stream(self, topic: str) -> RecordedStream:
        """The counts of a topic, also before its first message."""
        return self.streams.setdefault(topic, RecordedStream())

    def offer(self, topic: str, size: int, make: Callable[[], Cdr]) -> None:
        """Take a message of `size` bytes; never waits. `make` runs on the writer's thread; a ValueError drops it."""
        taken_ns = self._clock.now_ns()
        with self._changed:
            stream = self.stream(topic)
            stream.taken, stream.taken_ns = stream.taken + 1, taken_ns
            if self._closed or self._bytes + size > self._max_bytes:
                stream.drop("the recording was over" if self._closed else "the disk did not keep up")
                return
            self._waiting.append(_Waiting(stream, size, taken_ns, make))
            self._bytes += size
            self._changed.notify_all()

    def drain(self) -> None:
        """Wait until all that was taken is written; for simulations, whose time can wait for the disk."""
        with self._changed:
            if not self._changed.wait_for(lambda: not (self._waiting or self._busy), DRAIN_S):
                raise OSError(f"the disk did not take {self._bytes} bytes within {DRAIN_S:.0f} s")
        self.check()

    def check(self) -> None:
        """Raise what the writer's thread failed with: a fault of this program, not of a message or of the disk."""
        if self._failure is not None:
            raise RuntimeError(f"The recording's writer failed: {self._failure}") from self._failure

    def _write_all(self) -> None:
        while (next_one := self._next()) is not None:
            try:
                self._write(next_one)
            except Exception as error:  # noqa: BLE001 - kept, and raised by check()
                self._failure = self._failure or error
                next_one.stream.drop(str(error))

    def _next(self) -> _Waiting | None:
        with self._changed:
            self._busy = False
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if not self._waiting:
                return None
            taken = self._waiting.popleft()
            self._bytes, self._busy = self._bytes - taken.size, True
            return taken

    def _write(self, taken: _Waiting) -> None:
        lost = self._recorder.dropped
        try:
            cdr = taken.make()
            self._recorder.write_cdr(cdr.topic, cdr.type_name, cdr.stamp_ns, cdr.payload, log_time_ns=taken.taken_ns)
        except ValueError as error:  # no image, no known type, too large for any reader
            taken.stream.drop(str(error))
            return
        if self._recorder.dropped > lost:
            taken.stream.drop(self._recorder.failure or "the recorder is closed")
        else:
            taken.stream.written += 1
            taken.stream.bytes += len(cdr.payload)
            self._look_at(taken.stream, cdr)

    def _look_at(self, stream: RecordedStream, cdr: Cdr) -> None:
        """Transforms come from several nodes, whose stamps are in no order."""
        if cdr.type_name != TRANSFORMS:
            stream.pace.see(cdr.stamp_ns)
        if self._watch is not None:
            self._watch(cdr)
