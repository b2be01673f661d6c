"""The offline pipeline: posed frames in, a sealed memory out, in five steps (paper Sec. III)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from typing import Any

from openbelief.acquisition import acquire
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import FrameUnseen, Perception, TextEncoder
from openbelief.rooms import Room
from openbelief.store import BeliefStore
from openbelief.surroundings import CameraView, ViewImages, is_keyframe, view_of

Stage = Callable[[str], AbstractContextManager[object]]
STAGES = ("perceive", "acquire", "keep", "build", "seal")


def _untimed(_: str) -> AbstractContextManager[object]:
    return nullcontext()


@dataclass
class Taken:
    """What was taken from the frames, by reason: `refused` masks gave no observation, `unseen` frames no masks."""

    frames: int = 0
    masks: int = 0
    observations: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    unseen: Counter[str] = field(default_factory=Counter)

    @classmethod
    def so_far(cls, store: BeliefStore) -> Taken:
        """What the store's file has counted, in earlier runs too."""
        counts = store.counts
        numbers = (counts.get(name, 0) for name in ("frames", "masks", "observations"))
        return cls(*numbers, *(Counter(counts.get(name, {})) for name in ("refused", "unseen")))

    def as_json(self) -> dict[str, Any]:
        return {**vars(self), "refused": dict(self.refused), "unseen": dict(self.unseen)}


def map_frames(
    frames: Iterable[RgbdFrame],
    perception: Perception,
    store: BeliefStore,
    text_encoder: TextEncoder,
    *,
    stage: Stage = _untimed,
) -> ObjectMemory:
    """All five steps over one stream of frames; the store is sealed and closed."""
    take_evidence(frames, perception, store, stage=stage)
    return build_memory(store, text_encoder, stage=stage)


def take_evidence(
    frames: Iterable[RgbdFrame],
    perception: Perception,
    store: BeliefStore,
    *,
    stage: Stage = _untimed,
    on_frame: Callable[[Taken], None] = lambda _: None,
) -> Taken:
    """Steps 1 to 3, frame by frame. A frame that the store holds is passed over, so an interrupted run goes on; one
    that the perception cannot look at is kept as skipped, with the reason. What is counted goes on from there too.

    stage: a context manager per step, for timing (the core reads no clock). on_frame: told after every frame.
    """
    taken, done = Taken.so_far(store), _Done(store)
    for frame in frames:
        if frame.stamp_ns in done.of(frame.recording):
            continue
        try:
            with stage("perceive"):
                masks = perception.perceive(frame)
        except FrameUnseen as unseen:
            taken.frames += 1
            taken.unseen[str(unseen)] += 1
            store.add_frame(frame.recording, frame.stamp_ns, [], skipped=str(unseen), counts=taken.as_json())
        else:
            _keep(frame, masks, store, taken, stage)
        on_frame(taken)
    return taken


def _keep(frame: RgbdFrame, masks: list[Mask], store: BeliefStore, taken: Taken, stage: Stage) -> None:
    with stage("acquire"):
        observations, refusals = acquire(frame, masks, store.parameters)
    taken.frames += 1
    taken.masks += len(masks)
    taken.observations += len(observations)
    taken.refused.update(refusal.reason for refusal in refusals)
    with stage("keep"):
        view = _keyframe(frame, store)
        store.add_frame(frame.recording, frame.stamp_ns, observations, counts=taken.as_json(), view=view)


def _keyframe(frame: RgbdFrame, store: BeliefStore) -> tuple[CameraView, ViewImages] | None:
    """The frame as a view of the site, None where the camera hardly moved since the last one."""
    last = store.last_view_pose(frame.recording, frame.stamp_ns)
    return view_of(frame) if is_keyframe(frame.T_map_camera, last) else None


def build_memory(
    store: BeliefStore, text_encoder: TextEncoder, *, rooms: Iterable[Room] = (), stage: Stage = _untimed
) -> ObjectMemory:
    """Steps 4 and 5: associate and believe over all evidence in the store, then seal and close it."""
    with stage("build"):
        memory = ObjectMemory.build(
            store.observations(),
            text_encoder,
            store.parameters,
            feature_text_aligned=store.feature_text_aligned,
            frames=store.frames(),
            about=store.about,
            rooms=rooms,
            surroundings=store.surroundings(),
        )
    with stage("seal"):
        store.finish(memory)
    return memory


class _Done:
    """The stamps that the store held when the run began, per recording."""

    def __init__(self, store: BeliefStore) -> None:
        self._store = store
        self._stamps: dict[str, set[int]] = {}

    def of(self, recording: str) -> set[int]:
        if recording not in self._stamps:
            self._stamps[recording] = self._store.frames_done(recording)
        return self._stamps[recording]
