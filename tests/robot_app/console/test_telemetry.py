"""What the robot says on the page: one thing that cannot be read takes nothing else with it."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.clock import SystemClock
from drivers.ports import PortError
from openbelief.pose import Pose2
from robot_app.console import telemetry
from robot_app.console.telemetry import Telemetry
from robot_app.mission.safety import _writable_bytes
from tests.support.waiting import until


class Robot:
    """It stands at x, and has neither camera nor battery."""

    clock, battery = SystemClock(), None

    def __init__(self) -> None:
        self.x = 1.0
        self.poses = SimpleNamespace(robot_pose=lambda max_age_s: Pose2(self.x, 0.0, 0.0))
        self.camera = SimpleNamespace(latest=self._no_picture)

    def _no_picture(self, max_age_s: float) -> Any:
        raise PortError("No image has come yet.")


def test_a_disk_that_is_pulled_out_is_said_and_every_other_reading_goes_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(telemetry, "SLOW_S", 0.0)
    folder, robot = tmp_path / "stick", Robot()
    folder.mkdir()
    with Telemetry(robot, folder, lambda: None) as watched:  # type: ignore[arg-type]
        until(lambda: watched.readings.disk_free_bytes, "the disk's room")
        shutil.rmtree(folder)
        until(lambda: watched.readings.disk_free_bytes is None, "its loss")
        robot.x = 2.0
        until(lambda: watched.readings.pose is not None and watched.readings.pose.x == 2.0, "where the robot is now")
        assert "cannot be reached" in dict(watched.readings.silent)["disk"]


def test_what_is_not_read_at_every_look_keeps_its_reason_until_it_is_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(telemetry, "SLOW_S", 1e6)
    with Telemetry(Robot(), tmp_path / "nowhere", lambda: None) as watched:  # type: ignore[arg-type]
        until(lambda: watched.readings.silent, "a reading")
        first = watched.readings
        until(lambda: watched.readings is not first, "the next one")
        assert "disk" in dict(watched.readings.silent)


def test_where_nothing_can_be_written_there_is_no_room_for_a_trial(tmp_path: Path) -> None:
    assert _writable_bytes(tmp_path) > 0 and _writable_bytes(tmp_path / "pulled out") == 0
