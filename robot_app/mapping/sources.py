"""The recordings of a mapping, planned, each with the perception that looks at its frames."""

from __future__ import annotations

from collections import Counter
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Any

from logs.frames.reader import FrameReader, frame_readers
from openbelief.perception.ports import Perception, TextEncoder
from openbelief.perception.stages import StagedPerception
from robot_app.cli import Failure, Usage
from robot_app.mapping.job import MapJob, Progress
from robot_app.perceptions import kind_of


@dataclass(frozen=True)
class Source:
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


def plan(job: MapJob, text_encoder: TextEncoder, progress: Progress, opened: ExitStack) -> list[Source]:
    """Every recording's frames and perception, before anything is written."""
    specs = job.perceptions * len(job.recordings) if len(job.perceptions) == 1 else job.perceptions
    if len(specs) != len(job.recordings):
        raise Usage(f"Give one --perception, or one for each of the {len(job.recordings)} recordings.")
    made: dict[str, Perception] = {}
    sources = []
    for reader, spec in zip(frame_readers(job.recordings, job.read), specs, strict=True):
        kind, argument = kind_of(spec)
        if spec not in made:
            made[spec] = kind.make(argument, text_encoder, job.seed)
            _close_with(opened, made[spec])
        perception = made[spec]
        _require_text_space(perception, text_encoder)
        progress.step(f"reading {reader.path.name}")
        if not reader.plan.frames:
            raise Failure(f"{reader.path} gives no frame: {reader.why_nothing()}.")
        for note in reader.plan.notes:
            progress.step(f"{reader.path.name}: {note}")
        sources.append(Source(reader, reader.recording, perception, kind.expensive))
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


def reasons(counter: Counter[str]) -> str:
    return ", ".join(f"{n} x {reason}" for reason, n in counter.most_common())
