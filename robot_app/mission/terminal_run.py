"""`openbelief run` at the terminal: sentences are typed, answers too."""

from __future__ import annotations

from robot_app.config import Config
from robot_app.mission.distance_line import DistanceLine
from robot_app.mission.live import Report, run_missions
from robot_app.mission.missions import open_missions
from robot_app.mission.operator import SharedOperator
from robot_app.mission.terminal import Terminal
from robot_app.remote.service import open_remote
from robot_app.signals import signals_stop


def run_at_the_terminal(config: Config, report: Report | None) -> None:
    operator = SharedOperator()
    with (
        Terminal(operator, who=config.recording.operator) as terminal,
        signals_stop(operator) as heard,
        open_missions(config, operator) as missions,
    ):
        if not heard:
            operator.tell(f"Ready over {config.memory}. Ask for a thing; an empty line ends.")
            with open_remote(config, operator, missions) as watching:
                shown = (DistanceLine(terminal.screen), *watching)
                run_missions(missions, operator, heard, report=report, watching=shown)
