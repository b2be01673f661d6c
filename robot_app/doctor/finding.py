"""What the doctor says of one part, and what it looks at."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from drivers.watchdog.heartbeat import WatchdogView
from robot_app.app import Robot
from robot_app.config import Config
from robot_app.doctor.topic_probe import TopicProbe


class Level(StrEnum):
    OK = "ok"
    WARN = "warn"
    FAIL = "fail"


@dataclass(frozen=True)
class Finding:
    """One finding. remedy: what to do, empty where all is well."""

    name: str
    level: Level
    said: str
    remedy: str = ""


@dataclass(frozen=True)
class Examined:
    """What robot checks look at: the open robot, what was heard of its topics, its watchdog as it is heard here."""

    config: Config
    robot: Robot
    ears: TopicProbe
    watchdog: WatchdogView
