"""All recordings of a mapping as one stream of frames, and the perception that looks at the frame in hand."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path

from logs.frames.reasons import explained
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.cache import CachedPerception
from openbelief.perception.ports import Perception
from openbelief.perception.prefetcher import Prefetcher
from openbelief.perception.stages import StagedPerception
from robot_app.cli import Failure
from robot_app.mapping.job import MapJob, Progress
from robot_app.mapping.sources import Source, reasons
from robot_app.mapping.stopwatch import Stopwatch
from robot_app.mapping.watch import Steps, WatchedStore


class Walks:
    """Perception port for the frames that `frames` yields."""

    def __init__(
        self, sources: list[Source], job: MapJob, store: WatchedStore, clock: Stopwatch, progress: Progress, jobs: int
    ) -> None:
        """jobs: how many frames are acquired at once; with one, what follows perceiving is acquiring."""
        self._sources, self._job, self._store, self._jobs = sources, job, store, jobs
        self._clock, self._steps, self._progress = clock, Steps(clock), progress
        store.watched_by(self._steps, self._tell, self._finish)
        self._looking = sources[0].perception
        self._done = {source.recording: len(store.frames_done(source.recording)) for source in sources}
        self.id, self.feature_text_aligned = self._looking.id, self._looking.feature_text_aligned

    def frames(self) -> Generator[RgbdFrame]:
        """Every recording's, in turn, but those that are mapped."""
        for source in self._sources:
            yield from self._of(source)

    def perceive(self, frame: RgbdFrame) -> list[Mask]:
        self._steps.begin("perceive")
        try:
            return self._looking.perceive(frame)
        finally:
            self._steps.begin("acquire" if self._jobs == 1 else None)

    def _of(self, source: Source) -> Iterator[RgbdFrame]:
        cache = self._job.out.with_name(f"{self._job.out.name}.{source.recording}.perception.jsonl")
        frames = _timed(source.reader.frames(without=self._store.frames_done(source.recording)), self._clock)
        looking = _looking(source, frames, cache, self._store.text_encoder_id, self._clock, self._jobs)
        with looking as (seen, self._looking):
            yield from seen

    def _tell(self, recording: str) -> None:
        self._done[recording] += 1
        reader = next(source.reader for source in self._sources if source.recording == recording)
        total = len(reader.plan.frames)
        self._progress.frames(reader.path.name, min(self._done[recording], total), total, self._clock.rates())

    def _finish(self) -> None:
        """All frames are kept: images that gave none are noted with their reasons, and the maps.

        Raises Failure where no frame of any recording gave an observation.
        """
        for source in self._sources:
            for skip in source.reader.skips:
                self._store.leave_out(source.recording, skip.stamp_ns, f"{skip.reason}: {skip.detail}")
            for storey_map in source.reader.storey_maps()[0]:
                self._store.add_map(storey_map)
        self._require_evidence()
        self._progress.step("building the memory")

    def _require_evidence(self) -> None:
        """A memory of nothing is no memory: raises Failure, and leaves no partial file to resume."""
        taken = self._store.taken
        if taken.observations:
            return
        self._store.close()
        self._job.partial.unlink()
        readers = [source.reader for source in self._sources]
        why = (
            f"no frame could be decoded: {'; '.join(reader.why_nothing() for reader in readers)}"
            if all(reader.gave_nothing for reader in readers)
            else f"no frame could be looked at ({reasons(taken.unseen)})"
            if taken.unseen and not taken.masks
            else f"all {taken.masks} masks were refused ({reasons(taken.refused)})"
            if taken.masks
            else f"{self._sources[0].perception.id} has no mask for any of its frames; is it of another recording?"
        )
        if not taken.masks and any(reader.skips for reader in readers) and "decoded" not in why:
            why += f" ({'; '.join(explained(reader.skips) for reader in readers if reader.skips)})"
        names = ", ".join(reader.path.name for reader in readers)
        raise Failure(f"No observation came of {names}: {why}")


@contextmanager
def _looking(
    source: Source, frames: Iterator[RgbdFrame], cache: Path, text_space: str, clock: Stopwatch, jobs: int
) -> Iterator[tuple[Iterator[RgbdFrame], Perception]]:
    """The frames, and what looks at them: cached where it is expensive, ahead of its use where it has stages."""
    if not source.expensive:
        yield frames, source.perception
        return
    with CachedPerception(source.perception, cache, recording=source.recording, text_space=text_space) as cached:
        if not isinstance(source.perception, StagedPerception):
            yield frames, cached
            return
        clock.watch({"read": 1, **{s.name: s.workers for s in source.perception.stages}, "acquire": jobs})
        with Prefetcher(source.perception, cached, clock) as ahead:
            yield ahead.over(frames), ahead


def _timed(frames: Iterator[RgbdFrame], clock: Stopwatch) -> Iterator[RgbdFrame]:
    """The same frames; decoding them counts as reading."""
    while True:
        with clock("read"):
            frame = next(frames, None)
        if frame is None:
            return
        yield frame
