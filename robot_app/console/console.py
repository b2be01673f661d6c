"""The console beside live missions: what the robot says, what the mission does, and the server that shows both."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from robot_app.config import Config
from robot_app.console.listening import Listening
from robot_app.console.live_pages import LivePages
from robot_app.console.server import Parts, Server, serving
from robot_app.console.snapshots import LiveMission, Snapshots
from robot_app.console.speech import PageVoice
from robot_app.console.talk import Talk
from robot_app.console.telemetry import Telemetry
from robot_app.console.trial_pages import TrialPages
from robot_app.mission.missions import Missions
from robot_app.mission.operator import SharedOperator
from robot_app.mission.trial_shelf import TrialShelf
from robot_app.voice.speaking import Silence, Speaker
from robot_app.voice.suggestions import memory_phrases


@dataclass(frozen=True)
class OpenConsole:
    """server: where it is. live: give it to `Missions.ask` as what watches."""

    server: Server
    live: LiveMission


@contextmanager
def open_console(
    listening: Listening,
    config: Config,
    operator: SharedOperator,
    missions: Missions,
    *,
    extra: Callable[[], dict[str, Any]] = dict,
) -> Iterator[OpenConsole]:
    """Serve these missions' pages. extra: more for each snapshot. Raises Failure where it must not or cannot."""
    from robot_app.console.commands import HOW

    live, memory = LiveMission(missions.memory), missions.memory
    voice = PageVoice(config.voice) if config.voice.speak == "auto" else None
    with (
        Telemetry(missions.robot, config.trials, missions.watch.trouble) as telemetry,
        Speaker(operator, voice or Silence()) as speaker,
    ):
        more = (lambda: {"speech": voice.as_json(), **extra()}) if voice else extra
        snapshots = Snapshots(operator, live, lambda: telemetry.readings, extra=more)
        parts = Parts(
            operator=operator,
            snapshots=snapshots,
            picture=telemetry.picture,
            live_pages=LivePages(operator, memory, config.safety, missions.robot.map, live),
            trial_pages=TrialPages(TrialShelf(config.trials)),
            talk=Talk(config.voice, lambda: memory_phrases(memory), operator, missions.note, speaker.quiet),
            voice=voice,
        )
        with serving(listening, config.console, parts) as server:
            operator.join(HOW)
            try:
                yield OpenConsole(server, live)
            finally:
                operator.leave(HOW)
