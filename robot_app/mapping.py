"""One `openbelief map` from beginning to end: plan, open or resume OUT.partial, take the evidence, seal, rename."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from logs.frames.reader import FrameReader, RecordingError, RecordingTopics
from logs.mcap_io.reader import LogError, LogReader
from openbelief.mapping import Taken, build_memory, take_evidence
from openbelief.memory import ObjectMemory
from openbelief.observation import RgbdFrame
from openbelief.parameters import Parameters
from openbelief.perception.cache import CachedPerception
from openbelief.perception.ports import Perception, PerceptionFailed, TextEncoder
from openbelief.perception.prefetcher import Prefetcher
from openbelief.perception.recorded import RecordedPerceptionError
from openbelief.perception.stages import StagedPerception
from openbelief.rooms import Room
from openbelief.store import BeliefFileError, BeliefStore, read_surroundings
from robot_app.cli import Failure, Usage
from robot_app.perceptions import kind_of
from robot_app.stopwatch import Stopwatch


@dataclass(frozen=True)
class MapJob:
    """perceptions: one spec for all recordings, or one for each. seed: of simulated perception. rooms: of the site."""

    recordings: list[Path]
    out: Path
    perceptions: list[str]
    parameters: Parameters = field(default_factory=Parameters)
    topics: RecordingTopics = field(default_factory=RecordingTopics)
    map_frame: str = "map"
    stride: int = 1
    force: bool = False
    seed: int = 0
    rooms: tuple[Room, ...] = ()

    @property
    def partial(self) -> Path:
        return self.out.with_name(self.out.name + ".partial")


class Progress(Protocol):
    """Told how far mapping is; robot_app.progress has one for people."""

    def frames(self, recording: str, done: int, total: int, rates: Mapping[str, float] | None = None) -> None:
        """rates: frames a second of stages that run side by side."""
        ...

    def step(self, sentence: str) -> None: ...


@dataclass(frozen=True)
class MapResult:
    """taken: by all runs that it took. resumed: how many of its frames an earlier, interrupted one had done."""

    memory: ObjectMemory
    readers: list[FrameReader]
    taken: Taken
    resumed: int
    seconds: dict[str, float]


@dataclass(frozen=True)
class _Source:
    """One recording, planned, and the perception that looks at its frames."""

    reader: FrameReader
    recording: str
    perception: Perception
    expensive: bool

    def about(self) -> dict[str, Any]:
        return {
            "recording": self.recording,
            "file": self.reader.path.name,
            "damage": self.reader.damage,
        }


def require_recordings(paths: Iterable[Path]) -> None:
    """The first complaint is of a recording that is not there. Raises Failure."""
    for path in paths:
        if not path.is_file():
            try:
                LogReader(path).topics()
            except LogError as error:  # it knows of an unfinished one beside it
                raise Failure(str(error)) from error


def run_map(job: MapJob, text_encoder: TextEncoder, progress: Progress) -> MapResult:
    """Map the job's recordings into `job.out`. Raises Failure; what was done so far stays in `job.partial`."""
    if job.out.exists() and not job.force:
        raise Failure(f"{job.out} exists: choose another -o, or replace it with --force.")
    try:
        with ExitStack() as opened:
            result = _map(job, text_encoder, progress, opened)
    except PerceptionFailed as error:
        raise Failure(f"{error} What was done is kept: run the same command again to go on.") from error
    except (LogError, RecordingError, RecordedPerceptionError, BeliefFileError) as error:
        raise Failure(str(error)) from error
    job.partial.replace(job.out)
    return replace(result, memory=result.memory.with_surroundings(read_surroundings(job.out)))


def _map(job: MapJob, text_encoder: TextEncoder, progress: Progress, opened: ExitStack) -> MapResult:
    """opened: gets what the perceptions hold open."""
    clock = Stopwatch()
    with clock("read"):
        sources = _plan(job, text_encoder, progress, opened)
    with _open_store(job, sources, text_encoder) as store:
        resumed = Taken.so_far(store).frames
        for source in sources:
            _take(source, job, store, clock, progress)
        taken = Taken.so_far(store)
        _require_evidence(store, sources, taken, job)
        progress.step("building the memory")
        memory = build_memory(store, text_encoder, rooms=job.rooms, stage=clock)
    return MapResult(memory, [s.reader for s in sources], taken, resumed, dict(clock.seconds))


def _plan(job: MapJob, text_encoder: TextEncoder, progress: Progress, opened: ExitStack) -> list[_Source]:
    """Every recording's frames and perception, before anything is written."""
    specs = job.perceptions * len(job.recordings) if len(job.perceptions) == 1 else job.perceptions
    if len(specs) != len(job.recordings):
        raise Usage(f"Give one --perception, or one for each of the {len(job.recordings)} recordings.")
    made: dict[str, Perception] = {}
    sources = []
    for path, spec in zip(job.recordings, specs, strict=True):
        kind, argument = kind_of(spec)
        if spec not in made:
            made[spec] = kind.make(argument, text_encoder, job.seed)
            _close_with(opened, made[spec])
        perception = made[spec]
        _require_text_space(perception, text_encoder)
        progress.step(f"reading {path.name}")
        reader = FrameReader(path, topics=job.topics, map_frame=job.map_frame, stride=job.stride)
        if not reader.plan.frames:
            raise Failure(f"{path} gives no frame: {_counts(reader.skipped) or 'it holds no colour image'}.")
        sources.append(_Source(reader, reader.recording, perception, kind.expensive))
    if len({source.recording for source in sources}) != len(sources):
        raise Failure("The same recording is named twice.")
    if len({source.perception.feature_text_aligned for source in sources}) != 1:
        raise Failure("Recordings with and without text-aligned features cannot be mapped into one memory.")
    return sources


def _close_with(opened: ExitStack, perception: Perception) -> None:
    if isinstance(perception, StagedPerception):
        opened.callback(perception.close)


def _require_text_space(perception: Perception, text_encoder: TextEncoder) -> None:
    space = getattr(perception, "text_space", None)
    if perception.feature_text_aligned and space not in (None, text_encoder.id):
        raise Failure(
            f"The features of {perception.id} live in the text space of {space}, "
            f"and this memory would be asked with {text_encoder.id}: record them with that encoder."
        )


def _open_store(job: MapJob, sources: list[_Source], text_encoder: TextEncoder) -> BeliefStore:
    """OUT.partial: a new one, or the one that an interrupted run of the same job left."""
    about = {
        "recordings": [s.about() for s in sources],
        "perception": [s.perception.id for s in sources],
        "perception_about": [getattr(s.perception, "about", {}) for s in sources],
        "stride": job.stride,
        "map_frame": job.map_frame,
    }
    if not job.partial.exists():
        return BeliefStore.create(
            job.partial,
            text_encoder_id=text_encoder.id,
            text_dim=text_encoder.dim,
            parameters=job.parameters,
            feature_text_aligned=sources[0].perception.feature_text_aligned,
            about=about,
        )
    store = BeliefStore.resume(job.partial)
    began = {**store.about, "parameters": store.parameters.to_dict(), "text encoder": store.text_encoder_id}
    now = {**about, "parameters": job.parameters.to_dict(), "text encoder": text_encoder.id}
    if differing := [key.replace("_", " ") for key in now if began.get(key) != now[key]]:
        store.close()
        raise Failure(
            f"{job.partial} was begun with other {', '.join(differing)}: "
            "repeat the first command to finish it, or delete it to begin anew."
        )
    return store


def _take(source: _Source, job: MapJob, store: BeliefStore, clock: Stopwatch, progress: Progress) -> None:
    """The evidence of one recording; its skipped images are kept with their reasons."""
    done, total = store.frames_done(source.recording), len(source.reader.plan.frames)
    first = Taken.so_far(store).frames - len(done)
    cache = job.out.with_name(f"{job.out.name}.{source.recording}.perception.jsonl")
    taken_from = {f.stamp_ns for f in store.frames() if f.recording == source.recording and f.skipped is None}
    read = source.reader.frames(without=taken_from)  # what would not decode is tried, and counted, by every run
    frames = _timed((frame for frame in read if frame.stamp_ns not in done), clock)
    with _looking(source, frames, cache, store.text_encoder_id, clock) as (seen, perception):
        take_evidence(
            seen,
            perception,
            store,
            stage=clock,
            on_frame=lambda t: progress.frames(
                source.reader.path.name, min(t.frames - first, total), total, clock.rates()
            ),
        )
    kept = store.frames_done(source.recording)
    for skip in source.reader.skips:
        if skip.stamp_ns not in kept:
            store.add_frame(source.recording, skip.stamp_ns, [], skipped=f"{skip.reason}: {skip.detail}")
            kept.add(skip.stamp_ns)
    for storey_map in source.reader.storey_maps()[0]:
        store.add_map(storey_map)


@contextmanager
def _looking(
    source: _Source, frames: Iterator[RgbdFrame], cache: Path, text_space: str, clock: Stopwatch
) -> Iterator[tuple[Iterator[RgbdFrame], Perception]]:
    """The frames, and what looks at them: cached where it is expensive, ahead of its use where it has stages."""
    if not source.expensive:
        yield frames, source.perception
        return
    with CachedPerception(source.perception, cache, recording=source.recording, text_space=text_space) as cached:
        if not isinstance(source.perception, StagedPerception):
            yield frames, cached
            return
        clock.watch({"read": 1, **{s.name: s.workers for s in source.perception.stages}, "acquire": 1})
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


def _require_evidence(store: BeliefStore, sources: list[_Source], taken: Taken, job: MapJob) -> None:
    """A memory of nothing is no memory: raises Failure, and leaves no partial file to resume."""
    if taken.observations or store.observations():
        return
    store.close()
    job.partial.unlink()
    why = (
        f"no frame could be looked at ({_counts(taken.unseen)})"
        if taken.unseen and not taken.masks
        else f"all {taken.masks} masks were refused ({_counts(taken.refused)})"
        if taken.masks
        else f"{sources[0].perception.id} has no mask for any of its frames; is it of another recording?"
    )
    raise Failure(f"No observation came of {', '.join(s.reader.path.name for s in sources)}: {why}")


def _counts(counter: Counter[str]) -> str:
    return ", ".join(f"{n} x {reason}" for reason, n in counter.most_common())
