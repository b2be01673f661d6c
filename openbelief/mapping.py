"""The offline pipeline: posed frames in, a sealed memory out, in five steps (paper Sec. III)."""

from __future__ import annotations

from collections.abc import Iterable

from openbelief.acquisition import acquire
from openbelief.derived_rooms import with_derived_rooms
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask, RgbdFrame
from openbelief.perception.ports import FrameUnseen, Perception, TextEncoder
from openbelief.rooms import Room
from openbelief.store import BeliefStore
from openbelief.surroundings import CameraView, ViewImages, is_keyframe, view_of


def map_frames(
    frames: Iterable[RgbdFrame],
    perception: Perception,
    store: BeliefStore,
    text_encoder: TextEncoder,
    *,
    rooms: Iterable[Room] = (),
) -> ObjectMemory:
    """Map a stream of frames into the store, which is sealed and closed at the end.

    A frame that the store holds is passed over, so an interrupted run goes on where it stopped. What the store has
    after every frame is safe; what any step raises ends the run.
    """
    for frame in store.unmapped(frames):
        masks, unseen = _look(perception, frame)  # 1. perceive: what is there, in words and pixels
        observations, refusals = acquire(frame, masks, store.parameters)  # 2. acquire: o_e (eq. observation)
        reasons, view = [refusal.reason for refusal in refusals], _keyframe(frame, store)
        store.add_frame(frame.recording, frame.stamp_ns, observations, reasons, unseen, view)  # 3. keep: all evidence
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


def _look(perception: Perception, frame: RgbdFrame) -> tuple[list[Mask], str | None]:
    """The frame's masks; or none, and why this one could not be looked at."""
    try:
        return perception.perceive(frame), None
    except FrameUnseen as unseen:
        return [], str(unseen)


def _keyframe(frame: RgbdFrame, store: BeliefStore) -> tuple[CameraView, ViewImages] | None:
    """The frame as a view of the site, None where the camera hardly moved since the last one."""
    last = store.last_view_pose(frame.recording, frame.stamp_ns)
    return view_of(frame) if is_keyframe(frame.T_map_camera, last) else None
