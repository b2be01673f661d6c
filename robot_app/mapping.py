"""One `openbelief map` from beginning to end: plan, open or resume OUT.partial, take the evidence, seal, rename."""

from __future__ import annotations

import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from logs.frames import FrameReader, RecordingError, Topics
from logs.reader import LogError
from openbelief.mapping import Taken, build_memory, take_evidence
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.cache import CachedPerception
from openbelief.perception.ports import Perception, TextEncoder
from openbelief.perception.recorded import RecordedPerceptionError
from openbelief.store import BeliefFileError, BeliefStore
from robot_app.cli import Failure
from robot_app.perceptions import kind_of


@dataclass(frozen=True)
class MapJob:
    """perceptions: one spec for all recordings, or one for each. seed: of simulated perception."""

    recordings: list[Path]
    out: Path
    perceptions: list[str]
    parameters: Parameters = field(default_factory=Parameters)
    topics: Topics = field(default_factory=Topics)
    map_frame: str = "map"
    stride: int = 1
    force: bool = False
    seed: int = 0

    @property
    def partial(self) -> Path:
        return self.out.with_name(self.out.name + ".partial")


class Progress(Protocol):
    """Told how far mapping is; robot_app.progress has one for people."""

    def frames(self, recording: str, done: int, total: int) -> None: ...

    def step(self, sentence: str) -> None: ...


@dataclass
class Stopwatch:
    """Seconds of wall time per stage."""

    seconds: dict[str, float] = field(default_factory=lambda: defaultdict(float))

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] += time.perf_counter() - start


@dataclass(frozen=True)
class MapResult:
    """resumed: frames that an earlier, interrupted run had done."""

    memory: ObjectMemory
    readers: list[FrameReader]
    taken: list[Taken]
    resumed: int
    seconds: dict[str, float]

    @property
    def refused(self) -> Counter[str]:
        return sum((taken.refused for taken in self.taken), Counter())


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


def run_map(job: MapJob, text_encoder: TextEncoder, progress: Progress) -> MapResult:
    """Map the job's recordings into `job.out`. Raises Failure; what was done so far stays in `job.partial`."""
    if job.out.exists() and not job.force:
        raise Failure(f"{job.out} exists: choose another -o, or replace it with --force.")
    clock = Stopwatch()
    try:
        with clock("read"):
            sources = _plan(job, text_encoder, progress)
        with _open_store(job, sources, text_encoder) as store:
            resumed = sum(len(store.frames_done(source.recording)) for source in sources)
            taken = [_take(source, job, store, clock, progress) for source in sources]
            _require_evidence(store, sources, taken, job)
            progress.step("building the memory")
            memory = build_memory(store, text_encoder, stage=clock)
    except (LogError, RecordingError, RecordedPerceptionError, BeliefFileError) as error:
        raise Failure(str(error)) from error
    job.partial.replace(job.out)
    return MapResult(memory, [s.reader for s in sources], taken, resumed, dict(clock.seconds))


def _plan(job: MapJob, text_encoder: TextEncoder, progress: Progress) -> list[_Source]:
    """Every recording's frames and perception, before anything is written."""
    specs = job.perceptions * len(job.recordings) if len(job.perceptions) == 1 else job.perceptions
    if len(specs) != len(job.recordings):
        raise Failure(f"Give one --perception, or one for each of the {len(job.recordings)} recordings.")
    made: dict[str, Perception] = {}
    sources = []
    for path, spec in zip(job.recordings, specs, strict=True):
        kind, argument = kind_of(spec)
        if spec not in made:
            made[spec] = kind.make(argument, text_encoder, job.seed)
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


def _take(source: _Source, job: MapJob, store: BeliefStore, clock: Stopwatch, progress: Progress) -> Taken:
    """The evidence of one recording; its skipped images are kept with their reasons."""
    done = store.frames_done(source.recording)
    total, before = len(source.reader.plan.frames), len(done)
    cache = job.out.with_name(f"{job.out.name}.{source.recording}.perception.jsonl")
    cached = (
        CachedPerception(source.perception, cache, recording=source.recording, text_space=store.text_encoder_id)
        if source.expensive
        else nullcontext(source.perception)
    )
    with cached as perception:
        taken = take_evidence(
            _timed(source.reader.frames(without=done), clock),
            perception,
            store,
            stage=clock,
            on_frame=lambda t: progress.frames(source.reader.path.name, min(before + t.frames, total), total),
        )
    kept = store.frames_done(source.recording)
    for skip in source.reader.skips:
        if skip.stamp_ns not in kept:
            store.add_frame(source.recording, skip.stamp_ns, [], skipped=f"{skip.reason}: {skip.detail}")
            kept.add(skip.stamp_ns)
    return taken


def _timed(frames: Iterator[Any], clock: Stopwatch) -> Iterator[Any]:
    """The same frames; decoding them counts as reading."""
    while True:
        with clock("read"):
            frame = next(frames, None)
        if frame is None:
            return
        yield frame


def _require_evidence(store: BeliefStore, sources: list[_Source], taken: list[Taken], job: MapJob) -> None:
    """A memory of nothing is no memory: raises Failure, and leaves no partial file to resume."""
    if any(t.observations for t in taken) or store.observations():
        return
    store.close()
    job.partial.unlink()
    refused: Counter[str] = sum((t.refused for t in taken), Counter())
    masks = sum(t.masks for t in taken)
    why = (
        f"all {masks} masks were refused ({_counts(refused)})"
        if masks
        else f"{sources[0].perception.id} has no mask for any of its frames; is it of another recording?"
    )
    raise Failure(f"No observation came of {', '.join(s.reader.path.name for s in sources)}: {why}")


def _counts(counter: Counter[str]) -> str:
    return ", ".join(f"{n} x {reason}" for reason, n in counter.most_common())
