"""Which calibration holds for an image. It is no measurement: late, stamped zero or given once, it serves them all."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.ros.calibration import intrinsics
from drivers.ros.messages import Message
from drivers.ros.refusals import ImageRefused
from logs.frames.clock_steps import Mark
from openbelief.observation import Intrinsics


class Calibrations:
    """The usable calibrations of one camera_info topic; where it changes, each image takes the nearest."""

    def __init__(self, infos: Sequence[tuple[Mark, Message]], *, rectified: bool) -> None:
        self._usable: list[tuple[Mark, Intrinsics, Message]] = []
        self._refused: ImageRefused | None = None
        for mark, info in infos:
            try:
                camera = intrinsics(info, rectified=rectified)
            except ImageRefused as refused:
                self._refused = self._refused or refused
                continue
            if not self._usable or self._usable[-1][1] != camera or mark.stamp_ns:
                self._usable.append((mark, camera, info))
        if len({camera for _, camera, _ in self._usable}) == 1:
            del self._usable[1:]

    def of(self, image: Mark) -> tuple[Intrinsics, Message]:
        """Raises ImageRefused where none is usable."""
        if not self._usable:
            raise self._refused or RuntimeError("A camera_info topic has a message, or it is no topic.")
        _, camera, info = min(self._usable, key=lambda each: self._distance(each[0], image))
        return camera, info

    @staticmethod
    def _distance(mark: Mark, image: Mark) -> tuple[bool, int]:
        """By stamp; what is stamped zero by its place in the file."""
        if mark.stamp_ns == 0:
            return True, abs(mark.order - image.order)
        return False, abs(mark.stamp_ns - image.stamp_ns)
