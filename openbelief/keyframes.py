"""Which frames are kept as views of the site: decided in the order of the walk, before a frame is acquired."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Iterable

from openbelief.arrays import Array
from openbelief.observation import RgbdFrame
from openbelief.surroundings import is_keyframe

Posed = tuple[int, Array]  # stamp_ns, T_map_camera


class Keyframes:
    """Asked about frame after frame. kept: the keyframes of a recording that an earlier run left."""

    def __init__(self, kept: Callable[[str], Iterable[Posed]]) -> None:
        self._kept = kept
        self._poses: dict[str, list[Posed]] = {}  # of each recording, by stamp

    def take(self, frame: RgbdFrame) -> bool:
        """Is it one? Then it is what the next frames are compared with: each with the last one before it in time."""
        if frame.recording not in self._poses:
            self._poses[frame.recording] = sorted(self._kept(frame.recording), key=lambda posed: posed[0])
        poses = self._poses[frame.recording]
        at = bisect_left(poses, frame.stamp_ns, key=lambda posed: posed[0])
        if not is_keyframe(frame.T_map_camera, poses[at - 1][1] if at else None):
            return False
        poses.insert(at, (frame.stamp_ns, frame.T_map_camera))
        return True
