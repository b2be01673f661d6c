"""The offline pipeline: posed frames in, a sealed memory out, in five steps (paper Sec. III)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TypeAlias

from openbelief.acquisition import acquire
from openbelief.derived_rooms import with_derived_rooms
from openbelief.keyframes import Keyframes
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask, Observation, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.perception.ports import FrameUnseen, Perception, TextEncoder
from openbelief.rooms import Room
from openbelief.store import BeliefStore
from openbelief.surroundings import CameraView, ViewImages, view_of


@dataclass(frozen=True, eq=False)
class SegmentedFrame:
    """A frame and its masks; or none, and why it could not be looked at. keyframe: it shall be kept as a view."""

    frame: RgbdFrame
    masks: list[Mask] = field(repr=False)
    unseen: str | None
    keyframe: bool


@dataclass(frozen=True, eq=False)
class Acquired:
    """What a frame gives: observations, why masks gave none, why nothing was seen, and the view."""

    recording: str
    stamp_ns: int
    observations: list[Observation] = field(repr=False)
    refused: list[str]
    unseen: str | None
    view: tuple[CameraView, ViewImages] | None = field(repr=False)


Each: TypeAlias = Callable[[Callable[[SegmentedFrame], Acquired], Iterable[SegmentedFrame]], Iterable[Acquired]]


def map_frames(
    frames: Iterable[RgbdFrame],
    perception: Perception,
    store: BeliefStore,
    text_encoder: TextEncoder,
    *,
    rooms: Iterable[Room] = (),
    each: Each = map,
) -> ObjectMemory:
    """Map a stream of frames into the store, which is sealed and closed at the end.

    A frame that the store holds is passed over, so an interrupted run goes on where it stopped. What the store has
    after every frame is safe; what any step raises ends the run. each: acquires frame after frame, as `map` does, or
    several at once; what it gives comes in the order of the frames, and so do errors.
    """
    looked = _looked(frames, perception, store)  # 1. perceive: what is there, in words and pixels
    for got in each(partial(acquired, parameters=store.parameters), looked):  # 2. acquire: o_e (eq. observation)
        said = got.observations, got.refused, got.unseen, got.view
        store.add_frame(got.recording, got.stamp_ns, *said)  # 3. keep: all evidence
    memory = ObjectMemory.build(  # 4. build: associate (eq. association), believe (eqs. concept-vote to reliability)
        store.observations(),
        text_encoder,
        store.parameters,
        feature_text_aligned=store.feature_text_aligned,
        frames=store.frames(),
        about=store.about,
        rooms=rooms,
        surroundings=store.surroundings(),
    )
    memory = with_derived_rooms(memory)  # where nobody gave rooms, the maps show them (paper Sec. II)
    store.finish(memory.evidence, memory.table.columns)  # 5. seal
    return memory


def _looked(frames: Iterable[RgbdFrame], perception: Perception, store: BeliefStore) -> Iterator[SegmentedFrame]:
    """The frames that the store does not hold, each once; those that are under way are not in it yet."""
    keyframes, begun = Keyframes(store.view_poses), set[tuple[str, int]]()
    for frame in store.unmapped(frames):
        if (frame.recording, frame.stamp_ns) not in begun:
            begun.add((frame.recording, frame.stamp_ns))
            yield SegmentedFrame(frame, *_look(perception, frame), keyframes.take(frame))


def _look(perception: Perception, frame: RgbdFrame) -> tuple[list[Mask], str | None]:
    """The frame's masks; or none, and why this one could not be looked at."""
    try:
        return perception.perceive(frame), None
    except FrameUnseen as unseen:
        return [], str(unseen)


def acquired(looked: SegmentedFrame, parameters: Parameters) -> Acquired:
    """What the frame gives, of itself alone."""
    frame = looked.frame
    observations, refusals = acquire(frame, looked.masks, parameters)
    view = view_of(frame) if looked.keyframe else None
    reasons = [refusal.reason for refusal in refusals]
    return Acquired(frame.recording, frame.stamp_ns, observations, reasons, looked.unseen, view)
