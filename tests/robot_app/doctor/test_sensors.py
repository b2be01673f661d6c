"""Sensors at this machine, each looked at by itself."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from drivers.clock import SimClock, SystemClock
from drivers.livox.settings import LivoxSettings
from robot_app.config import Config
from robot_app.config_sections import PortsSection
from robot_app.doctor.finding import Level
from robot_app.doctor.sensors import check_real_camera, counter, examine_local
from robot_app.doctor.topic_probe import ProbedTopic, TopicProbe
from robot_app.local_sensors import open_emulated_realsense

Eventually = Callable[[Callable[[], bool]], None]


def test_a_lidar_that_is_not_there_is_found(tmp_path: Path) -> None:
    livox = LivoxSettings(lidar_ip="127.88.8.8", host_ip="203.0.113.9")
    config = Config(ports=PortsSection(lidar="real", camera="ros", pose="ros", map="ros", navigator="ros"), livox=livox)
    [line] = examine_local(config)
    assert line.name == "lidar" and line.level == Level.FAIL and "203.0.113.9" in line.said and line.remedy


def test_a_camera_here_is_looked_at(eventually: Eventually) -> None:
    with ExitStack() as opened:
        camera = open_emulated_realsense(Config(), SystemClock(), opened)
        eventually(lambda: camera.health().counts.frames > 0)
        ears = TopicProbe(SystemClock())
        ears.count("camera", counter(camera))
        ears.listen(1.0)
        usb, rate = check_real_camera(camera, ears)
    assert (usb.name, usb.level) == ("camera usb", Level.OK) and "3.2" in usb.said
    assert rate.name == "camera rate" and "of 30 Hz" in rate.said and ears.counted_hz("camera") > 0


def test_the_rate_of_a_sensor_here_is_counted_while_it_is_listened_to() -> None:
    clock, images = SimClock(0), [7]
    ears = TopicProbe(clock)
    ears.count("camera", lambda: images[0])
    clock.every(1 / 30, lambda: images.append(images.pop() + 1))
    ears.listen(3.0)
    assert ears.counted_hz("camera") == pytest.approx(30, abs=0.5)
    clock.every(1.0, lambda: images.append(images.pop() * 0))  # its process was started anew
    ears.listen(3.0)
    assert ears.counted_hz("camera") == 0.0


def test_gaps_between_stamps_are_counted_as_missing() -> None:
    assert ProbedTopic([k * 100 for k in range(20) if k not in (5, 9, 10)]).missing == 3
    assert ProbedTopic([]).missing == 0
