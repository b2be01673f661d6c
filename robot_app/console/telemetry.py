"""What the robot says between missions and during them: pose, battery, disk, link, watchdog and camera."""

from __future__ import annotations

import shutil
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from drivers.ports import ANY_AGE_S, CameraFrame, PortError
from openbelief.lifetime import Lifetime
from openbelief.pose import Pose2
from robot_app.app import Robot
from robot_app.console.site_plan import jpeg

LOOK_S = 0.1
SLOW_S = 1.0  # the disk and the battery change slowly
POSE_MAX_AGE_S = 1.0
BATTERY_MAX_AGE_S = 30.0


@dataclass(frozen=True)
class Readings:
    """Each value, or None where it is not known; `silent`: what is not known, and why, in words."""

    pose: Pose2 | None = None
    battery: float | None = None
    disk_free_bytes: int | None = None
    camera_age_s: float | None = None
    link_trouble: str | None = None
    silent: tuple[tuple[str, str], ...] = ()

    def as_json(self) -> dict[str, Any]:
        pose = self.pose
        return {
            "pose": None if pose is None else {"x": pose.x, "y": pose.y, "yaw": pose.yaw},
            "battery": self.battery,
            "disk_free_bytes": self.disk_free_bytes,
            "camera_age_s": None if self.camera_age_s is None else round(self.camera_age_s, 2),
            "link": self.link_trouble,
            "silent": dict(self.silent),
        }


class Picture:
    """The newest camera image as JPEG, encoded when somebody looks, and once."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._frame: CameraFrame | None = None
        self._encoded: tuple[int, bytes] | None = None

    def show(self, frame: CameraFrame) -> None:
        self._frame = frame

    def newest(self) -> tuple[int, bytes] | None:
        """(stamp_ns, JPEG), None before the first."""
        frame = self._frame
        if frame is None:
            return None
        with self._lock:
            if self._encoded is None or self._encoded[0] != frame.stamp_ns:
                self._encoded = (frame.stamp_ns, jpeg(frame.color))
            return self._encoded


class Telemetry(Lifetime):
    """Looks at the robot's ports on a thread of its own, as a context manager; `readings` never waits."""

    def __init__(self, robot: Robot, folder: Path, link: Callable[[], str | None]) -> None:
        self._robot, self._folder, self._link = robot, folder, link
        self.readings, self.picture = Readings(), Picture()
        self._ended = threading.Event()
        self._slow_at_s = 0.0
        self._slow_silent: dict[str, str] = {}  # why battery or disk told nothing when they were last asked
        self._battery: float | None = None
        self._disk: int | None = None
        self._thread = threading.Thread(target=self._run, name="telemetry", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(LOOK_S):
            self.readings = self._look()

    def _look(self) -> Readings:
        silent: dict[str, str] = {}
        pose = self._asked("pose", lambda: self._robot.poses.robot_pose(POSE_MAX_AGE_S), silent)
        frame = self._asked("camera", lambda: self._robot.camera.latest(ANY_AGE_S), silent)
        if frame is not None:
            self.picture.show(frame)
        if time.monotonic() >= self._slow_at_s:
            self._slow_at_s = time.monotonic() + SLOW_S
            self._slow_silent = {}
            self._disk = self._free_bytes(self._slow_silent)
            self._battery = self._charge(self._slow_silent)
        age_s = None if frame is None else (self._robot.clock.now_ns() - frame.stamp_ns) / 1e9
        why = tuple((silent | self._slow_silent).items())
        return Readings(pose, self._battery, self._disk, age_s, self._link(), why)

    def _free_bytes(self, silent: dict[str, str]) -> int | None:
        try:
            return shutil.disk_usage(self._folder).free
        except OSError as error:  # a disk that was pulled out takes no other reading with it
            silent["disk"] = f"{self._folder} cannot be reached: {error.strerror}"
            return None

    def _charge(self, silent: dict[str, str]) -> float | None:
        battery = self._robot.battery
        if battery is None:
            return None
        charge = self._asked("battery", lambda: battery.latest(BATTERY_MAX_AGE_S), silent)
        return None if charge is None else float(charge.fraction)

    def _asked(self, name: str, ask: Callable[[], Any], silent: dict[str, str]) -> Any:
        """The port's answer; None, with its reason, where it has none."""
        try:
            return ask()
        except PortError as error:
            silent[name] = str(error)
            return None
