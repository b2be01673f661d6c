"""One `openbelief map` from beginning to end: plan, open or resume OUT.partial, map, rename."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

from logs.containers.recording import Recording
from logs.frames.reader import RecordingError
from logs.mcap_io.reader import LogError
from openbelief.belief_file import BeliefFile
from openbelief.mapping import Each, map_frames
from openbelief.perception.ports import PerceptionFailed, TextEncoder
from openbelief.perception.recorded import RecordedPerceptionError
from openbelief.store import BeliefFileError
from robot_app.cli import Failure
from robot_app.mapping.job import MapJob, MapResult, Progress
from robot_app.mapping.sources import Source, plan
from robot_app.mapping.stopwatch import Stopwatch
from robot_app.mapping.walks import Walks
from robot_app.mapping.watch import WatchedStore
from robot_app.mapping.workers import FrameWorkers, jobs_for


def require_recordings(paths: Iterable[Path]) -> None:
    """The first complaint is of a recording that is not there. Raises Failure."""
    for path in paths:
        try:
            Recording(path).require()
        except LogError as error:
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
    return replace(result, memory=result.memory.with_surroundings(BeliefFile(job.out).surroundings()))


def _map(job: MapJob, text_encoder: TextEncoder, progress: Progress, opened: ExitStack) -> MapResult:
    """opened: gets what the perceptions hold open."""
    clock = Stopwatch()
    with clock("read"):
        sources = plan(job, text_encoder, progress, opened)
    with _open_store(job, sources, text_encoder) as store:
        resumed = store.taken.frames
        jobs = job.jobs or jobs_for(sum(len(source.reader.plan.frames) for source in sources) - resumed)
        walks = Walks(sources, job, store, clock, progress, jobs)
        with _each(jobs, clock) as each, closing(walks.frames()) as frames:
            memory = map_frames(frames, walks, store, text_encoder, rooms=job.rooms, each=each)
    return MapResult(memory, [s.reader for s in sources], store.taken, resumed, dict(clock.seconds))


@contextmanager
def _each(jobs: int, clock: Stopwatch) -> Iterator[Each]:
    if jobs == 1:
        yield map
        return
    with FrameWorkers(jobs, partial(clock.add, "acquire")) as workers:
        yield workers.each


def _open_store(job: MapJob, sources: list[Source], text_encoder: TextEncoder) -> WatchedStore:
    """OUT.partial: a new one, or the one that an interrupted run of the same job left."""
    about = {
        "recordings": [s.about() for s in sources],
        "perception": [s.perception.id for s in sources],
        "perception_about": [getattr(s.perception, "about", {}) for s in sources],
        **job.read.about(),
    }
    if not job.partial.exists():
        return WatchedStore.create(
            job.partial,
            text_encoder_id=text_encoder.id,
            text_dim=text_encoder.dim,
            parameters=job.parameters,
            feature_text_aligned=sources[0].perception.feature_text_aligned,
            about=about,
        )
    store = WatchedStore.resume(job.partial)
    began = {**store.about, "parameters": store.parameters.to_dict(), "text encoder": store.text_encoder_id}
    now = {**about, "parameters": job.parameters.to_dict(), "text encoder": text_encoder.id}
    if differing := [key.replace("_", " ") for key in now if began.get(key) != now[key]]:
        store.close()
        raise Failure(
            f"{job.partial} was begun with other {', '.join(differing)}: "
            "repeat the first command to finish it, or delete it to begin anew."
        )
    return store
