"""The Hand through a helper under the robot's own ROS Python (rclpy), where there is no cyclonedds wheel."""

from __future__ import annotations

import logging
import queue
import subprocess
import threading
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from drivers.dds.raw import DdsUnavailable
from drivers.processes import end_or_kill
from drivers.repeats import Repeats
from drivers.topics import NAVIGATE_TO_POSE
from drivers.watchdog.hands import Acknowledgement
from openbelief.documents import from_json

logger = logging.getLogger(__name__)
HELPER = Path(__file__).with_name("ros_helper.py")
CLOSE_S = 2.0
LINE_BYTES_MAX = 1000


def helper_command(setup: str) -> list[str]:
    """The helper in the environment of a ROS set-up file, like /opt/ros/jazzy/setup.bash."""
    return ["bash", "-c", 'source "$1" && exec python3 "$2" "$3"', "openbelief", setup, str(HELPER)]


class RosHelperHand:
    """A helper that ends is begun no more: `servers` is 0, and the watchdog says so."""

    name = "rclpy"

    def __init__(self, command: Sequence[str]) -> None:
        self._command = [*command, NAVIGATE_TO_POSE.name]
        self._heard: queue.SimpleQueue[Acknowledgement] = queue.SimpleQueue()
        self._servers, self._driving, self._repeats = 0, False, Repeats()

    def __enter__(self) -> RosHelperHand:
        try:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True
            )
        except OSError as error:
            raise DdsUnavailable(f"The helper under ROS cannot be started: {error.strerror}.") from error
        threading.Thread(target=self._read, name="ros helper", daemon=True).start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._process.stdin is not None:
            with suppress(BrokenPipeError):  # it has ended already
                self._process.stdin.close()
        end_or_kill(self._process, CLOSE_S)

    @property
    def servers(self) -> int:
        return self._servers if self._process.poll() is None else 0

    @property
    def driving(self) -> bool:
        return self._driving

    def cancel_all(self, trip: int) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(f"cancel {trip}\n")
            self._process.stdin.flush()
        except OSError as error:
            raise DdsUnavailable(f"The helper under ROS has ended: {error}") from error

    def hear(self) -> list[Acknowledgement]:
        heard = []
        while not self._heard.empty():
            heard.append(self._heard.get())
        return heard

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            try:
                said = from_json(line, max_bytes=LINE_BYTES_MAX)
                if "trip" in said:
                    self._heard.put(Acknowledgement(int(said["trip"]), int(said["code"])))
                else:
                    self._servers, self._driving = int(said["servers"]), bool(said["driving"])
            except (ValueError, KeyError, TypeError) as error:
                if count := self._repeats.due():
                    logger.warning("a line of the helper under ROS was ignored (%d so far): %s", count, error)
