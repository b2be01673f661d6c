"""The Camera port over ROS topics: colour, aligned depth and calibration become frames as they are asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from drivers.ports import CameraFrame, Clock, StaleData
from drivers.ros.bridge_keys import BridgeKeys, Keys
from drivers.ros.calibration import is_rectified
from drivers.ros.image_messages import camera_frame_of
from drivers.ros.messages import Message, stamp_to_ns
from drivers.ros.subscription import Subscription, listen
from drivers.ros.zenoh_link import ZenohLink
from drivers.stamps import is_news, require_fresh
from drivers.topics import CAMERA_INFO, COLOR, DEPTH, Topic

WAITING = 8  # colour or depth images that wait for their partners, at most of each


@dataclass(frozen=True, kw_only=True)
class PairingTolerance:
    """How colour and depth of one moment are told. offset_s: by how much the depth camera's stamps are late."""

    tolerance_s: float = 0.0
    offset_s: float = 0.0


class StampPairs:
    """Colour and depth images wait for each other; the newest pair counts. Bounded; one thread at a time."""

    def __init__(self, pairing: PairingTolerance) -> None:
        self.tolerance_ns, self._offset_ns = round(pairing.tolerance_s * 1e9), round(pairing.offset_s * 1e9)
        self._waiting: tuple[dict[int, Message], dict[int, Message]] = ({}, {})  # colour, depth: stamp -> message
        self.newest: tuple[int, Message, Message] | None = None  # the colour's stamp, colour, depth
        self.nearest_ns: int | None = None  # depth after colour, of the last two that are no pair

    def add(self, part: int, message: Message) -> None:
        """part: 0 for colour, 1 for depth."""
        stamp_ns = stamp_to_ns(message.header.stamp) - part * self._offset_ns
        ours, theirs = self._waiting[part], self._waiting[1 - part]
        ours[stamp_ns] = message
        while len(ours) > WAITING:
            del ours[next(iter(ours))]
        partner_ns = min(theirs, key=lambda s: abs(s - stamp_ns), default=None)
        if partner_ns is None:
            return
        color_ns, depth_ns = (stamp_ns, partner_ns) if part == 0 else (partner_ns, stamp_ns)
        if abs(depth_ns - color_ns) > self.tolerance_ns:
            self.nearest_ns = depth_ns - color_ns
            return
        color = self._waiting[0].pop(color_ns)
        depth = self._waiting[1][depth_ns] if self.tolerance_ns else self._waiting[1].pop(depth_ns)
        if self.newest is None or is_news(color_ns, self.newest[0]):
            self.newest = color_ns, color, depth


class RosCamera:
    """The Camera port: colour (raw or compressed) and aligned depth of one stamp, with the newest calibration."""

    def __init__(
        self,
        link: ZenohLink,
        clock: Clock,
        keys: Keys | None = None,
        *,
        color: Topic = COLOR,
        depth: Topic = DEPTH,
        camera_info: Topic = CAMERA_INFO,
        pairing: PairingTolerance | None = None,
    ) -> None:
        self._link, self._clock, self._keys = link, clock, keys or BridgeKeys()
        self._topics = (color, depth, camera_info)
        self._rectified = is_rectified(color.name)
        self._intakes: list[Subscription] = []
        self._pairs = StampPairs(pairing or PairingTolerance())
        self._info: Message | None = None  # it is no measurement: the newest holds for every image
        self._frame: CameraFrame | None = None
        self._refused: tuple[int, str] | None = None  # a stamp, and why its image cannot be used
        self._lock = threading.Lock()

    def start(self) -> None:
        """Begin to listen; it ends with the link."""
        for topic, use in zip(self._topics, (self._part(0), self._part(1), self._keep_info), strict=True):
            self._intakes.append(listen(self._link, self._keys, topic, use))

    def latest(self, max_age_s: float) -> CameraFrame:
        self._link.check()
        with self._lock:
            newest, info = self._pairs.newest, self._info
        if newest is None or info is None:
            raise StaleData(f"No camera image yet (messages so far: {self._heard()}).{self._why()}{self._trouble()}")
        require_fresh("Camera", newest[0], self._clock.now_ns(), max_age_s, self._trouble())
        return self._decoded(*newest, info)

    def _decoded(self, stamp_ns: int, color: Message, depth: Message, info: Message) -> CameraFrame:
        """Decoded when asked for (a JPEG takes 3 ms), and once, whether it can be or not."""
        if self._frame is not None and self._frame.stamp_ns == stamp_ns:
            return self._frame
        if self._refused is None or self._refused[0] != stamp_ns:
            try:
                apart_ns = abs(stamp_to_ns(depth.header.stamp) - stamp_ns)
                self._frame = camera_frame_of(color, depth, info, rectified=self._rectified, apart_ns=apart_ns)
                return self._frame
            except ValueError as error:
                self._refused = stamp_ns, str(error)
                self._intakes[0].drop(str(error))
        raise StaleData(f"The newest camera image cannot be used: {self._refused[1]}")

    def _part(self, part: int) -> Callable[[Message], None]:
        def add(message: Message) -> None:
            with self._lock:
                self._pairs.add(part, message)

        return add

    def _keep_info(self, message: Message) -> None:
        with self._lock:
            self._info = message

    def _heard(self) -> str:
        return ", ".join(f"{t.name}: {i.received}" for t, i in zip(self._topics, self._intakes, strict=False))

    def _why(self) -> str:
        """What is known of images that came and are no frame."""
        with self._lock:
            pairs, info = self._pairs, self._info
        if pairs.newest is None and pairs.nearest_ns is not None:
            return (
                f" Colour and depth come with different stamps (depth {pairs.nearest_ns / 1e6:+.1f} ms): set "
                "[pairing] tolerance_s or depth_offset_s in robot.toml where the camera works so."
            )
        if pairs.newest is not None and info is None:
            return f" Images come, but no calibration on {self._topics[2].name}."
        return ""

    def _trouble(self) -> str:
        return "".join(intake.trouble() for intake in self._intakes)
