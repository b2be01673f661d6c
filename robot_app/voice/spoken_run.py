"""`openbelief run --voice`: the terminal, where an empty line begins to listen and the next one ends it."""

from __future__ import annotations

from robot_app.config import Config
from robot_app.mission.distance_line import DistanceLine
from robot_app.mission.live import Report, run_missions
from robot_app.mission.missions import open_missions
from robot_app.mission.operator import SharedOperator
from robot_app.mission.terminal import Terminal
from robot_app.remote.service import open_remote
from robot_app.signals import signals_stop
from robot_app.voice.listener import Listener
from robot_app.voice.local_talk import LocalTalk
from robot_app.voice.microphone import LocalMicrophone
from robot_app.voice.recognisers import open_recogniser
from robot_app.voice.speaking import Speaker, local_voice
from robot_app.voice.suggestions import memory_phrases


def run_by_voice(config: Config, report: Report | None) -> None:
    voice, who, operator = config.voice, config.recording.operator, SharedOperator()
    recogniser, microphone = open_recogniser(voice.recogniser, voice.language), LocalMicrophone(voice.microphone)
    with (
        signals_stop(operator) as heard,
        open_missions(config, operator) as missions,
        open_remote(config, operator, missions) as watching,
        Speaker(operator, local_voice(voice)) as speaker,
    ):
        talk = LocalTalk(
            operator,
            microphone,
            Listener(recogniser, memory_phrases(missions.memory)),
            ask=lambda words, notes: terminal.ask(words, notes),
            note=missions.note,
            who=who,
            quiet=speaker.quiet,
        )
        more = {"": talk.turn, "ask": talk.ask, "end": operator.end}
        with Terminal(operator, who=who, more=more) as terminal:
            operator.tell(f"Ready over {config.memory}. Press Enter to speak, and again to end; type end to leave.")
            shown = (DistanceLine(terminal.screen), *watching)
            run_missions(missions, operator, heard, report=report, watching=shown)
