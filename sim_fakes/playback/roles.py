"""Which topic of a recording plays which role: what `[topics]` of robot.toml names, else the only one possible."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from drivers.topics import CAMERA_IMU, CAMERA_INFO, COLOR, DEPTH, LIDAR, LIDAR_IMU, MAP
from logs.frames.reader import MAX_TF_GAP_S, PAIR_TOLERANCE_S
from logs.frames.topics import RecordingTopics, base, listed

# Role -> words that speak for a topic, words that speak against it (clouds of cameras, maps that Nav2 inflated)
WORDS = {
    "lidar": (
        ("lidar", "livox", "mid360", "velodyne", "ouster", "hesai", "rslidar"),
        ("camera", "depth", "map", "voxel"),
    ),
    "map": (("map",), ("costmap",)),
}
HALVES = ("gyro", "accel")


class RoleUnclear(ValueError):
    """Several topics could play a role, or the one that was named is not there; the text lists what there is."""


@dataclass(frozen=True)
class PlayedTopics:
    """ROS names as in `[topics]`, and what belongs together in time as in `[pairing]`.

    named: the fields that a person set; the others are only what is usual.
    """

    color: str = COLOR.name
    depth: str = DEPTH.name
    camera_info: str = CAMERA_INFO.name
    lidar: str = LIDAR.name
    lidar_imu: str = LIDAR_IMU.name
    camera_imu: str = CAMERA_IMU.name
    map: str = MAP.name
    named: frozenset[str] = frozenset()
    pair_tolerance_s: float = PAIR_TOLERANCE_S
    depth_offset_s: float = 0.0
    max_tf_gap_s: float = MAX_TF_GAP_S

    def of_camera(self, there: Collection[str]) -> RecordingTopics:
        """The camera's topics that were named or are there; None leaves the choice to the reader.

        A camera_info that was not named is the one beside colour.
        """
        info = self.camera_info if "camera_info" in self.named else None
        return RecordingTopics(self._image("color", there), self._image("depth", there), info)

    def _image(self, role: str, there: Collection[str]) -> str | None:
        """A camera's raw topic also stands for its compressed twin, and the other way round."""
        name = str(getattr(self, role))
        twins = [topic for topic in (name, *sorted(there)) if topic in there and base(topic) == base(name)]
        return twins[0] if twins else name if role in self.named else None

    def one(self, role: str, there: Collection[str]) -> str | None:
        """The topic of a role among those of its type; None where none can be meant. Raises RoleUnclear."""
        name = str(getattr(self, role))
        if name in there:
            return name
        if role in self.named:
            raise RoleUnclear(f"has no {role} topic {name!r} ([topics] {role}); of that type it has: {listed(there)}")
        speak_for, speak_against = WORDS[role]
        left = [topic for topic in there if not any(word in topic.lower() for word in speak_against)]
        likely = [topic for topic in left if any(word in topic.lower() for word in speak_for)]
        left = likely if len(likely) == 1 else left
        if len(left) > 1:
            raise RoleUnclear(
                f"holds several topics that could be the {role} ({listed(left)}): name one in [topics] {role}"
            )
        return left[0] if left else None

    def imu(self, sensor: str, there: Collection[str], words: tuple[str, ...]) -> str | None:
        """A sensor's IMU; None where there is none, or several could be meant. Half of one (gyro/sample) is no IMU."""
        role = f"{sensor}_imu"
        name = str(getattr(self, role))
        if name in there:
            return name
        if role in self.named:
            raise RoleUnclear(f"has no topic {name!r} ([topics] {role}); of that type it has: {listed(there)}")
        likely = [t for t in there if any(w in t for w in words) and not any(half in t for half in HALVES)]
        return likely[0] if len(likely) == 1 else None
