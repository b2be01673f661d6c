"""The Safety port: what the supervisor judges by, gathered from the ports at every poll."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from behaviors.safety_facts import SafetyFacts, Sample
from behaviors.safety_policy import SafetyPolicy
from behaviors.supervisor import Supervisor
from drivers.ports import ANY_AGE_S, Battery, Camera, Clock, Lidar, Map, PortError, PoseSource, SafetyVerdict
from openbelief.arrays import Array
from openbelief.memory import ObjectMemory
from openbelief.pose import Pose2

BATTERY_MAX_AGE_S = 30.0
THINNED = 16  # every so many rows of an image or points of a cloud tell whether it is the same again


def nothing_wrong() -> str | None:
    return None


@dataclass(frozen=True, kw_only=True)
class Sources:
    """Where facts come from; what is None is not there, and nothing is expected of it."""

    clock: Clock
    poses: PoseSource
    map: Map
    camera: Camera | None = None
    lidar: Lidar | None = None
    battery: Battery | None = None
    disk_free_bytes: Callable[[], int] | None = None
    link: Callable[[], str | None] = nothing_wrong
    watchdog: Callable[[], str | None] = nothing_wrong
    memory: ObjectMemory | None = None


class Supervision:
    """The Safety port over live sources. The clock is one that no step of the system's clock moves."""

    def __init__(self, sources: Sources, limits: SafetyPolicy) -> None:
        self._sources, self._limits = sources, limits
        self._supervisor = Supervisor(limits)
        self._digests: dict[str, Sample] = {}

    def verdict(self, goal: Pose2 | None) -> SafetyVerdict:
        return self._supervisor.update(self._sources.clock.now_ns(), self._facts(goal))

    def _facts(self, goal: Pose2 | None) -> SafetyFacts:
        s = self._sources
        there = {"camera": s.camera, "cloud": s.lidar, "battery": s.battery}
        return SafetyFacts(
            expected=frozenset(name for name, port in there.items() if port is not None),
            pose=self._pose(),
            camera=self._image(),
            cloud=self._cloud(),
            battery=self._charge(),
            disk_free_bytes=s.disk_free_bytes() if s.disk_free_bytes and goal is None else None,
            goal=goal,
            link=s.link(),
            watchdog=s.watchdog(),
            memory=self._mismatch() if goal is None else None,
        )

    def _pose(self) -> Pose2 | None:
        try:
            return self._sources.poses.robot_pose(self._limits.pose_max_age_s)
        except PortError:
            return None

    def _image(self) -> Sample | None:
        if self._sources.camera is None:
            return None
        try:
            frame = self._sources.camera.latest(ANY_AGE_S)
        except PortError:
            return None
        return self._sample("camera", frame.stamp_ns, frame.color, frame.depth_m)

    def _cloud(self) -> Sample | None:
        if self._sources.lidar is None:
            return None
        try:
            cloud = self._sources.lidar.latest(ANY_AGE_S)
        except PortError:
            return None
        return self._sample("cloud", cloud.stamp_ns, cloud.points)

    def _charge(self) -> float | None:
        if self._sources.battery is None:
            return None
        try:
            return self._sources.battery.latest(BATTERY_MAX_AGE_S).fraction
        except PortError:
            return None

    def _sample(self, name: str, stamp_ns: int, *contents: Array) -> Sample:
        known = self._digests.get(name)
        if known is None or known.stamp_ns != stamp_ns:
            digest = 0
            for content in contents:
                digest = zlib.crc32(np.ascontiguousarray(content[::THINNED]).data, digest)
            self._digests[name] = known = Sample(stamp_ns, digest)
        return known

    def _mismatch(self) -> str | None:
        """A memory of another site, or a map of another place: most of what was mapped does not lie on the map."""
        memory = self._sources.memory
        if memory is None or not len(memory.objects):
            return None
        try:
            grid = self._sources.map.latest()
        except PortError:
            return None  # "is Nav2 up?" says so
        on_map = grid.contains(grid.cell(np.array([node.centroid[:2] for node in memory.objects])))
        if 2 * int(on_map.sum()) >= len(on_map):
            return None
        return (
            f"Memory and map do not match: {int((~on_map).sum())} of {len(on_map)} objects lie off the map. "
            "Load the memory of this site, or the map that it was made on."
        )
