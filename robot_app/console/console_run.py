"""`openbelief run --console`: missions asked for on the page, with the terminal beside it."""

from __future__ import annotations

from dataclasses import replace

from robot_app.config import Config
from robot_app.console.accounts import Accounts
from robot_app.console.console import open_console
from robot_app.console.invitation import Invitation
from robot_app.console.listening import Listening, checked
from robot_app.mission.live import Report, run_missions
from robot_app.mission.missions import open_missions
from robot_app.mission.operator import SharedOperator
from robot_app.mission.terminal import Terminal
from robot_app.remote.service import open_remote
from robot_app.signals import signals_stop
from robot_app.wall_time_robot import in_wall_time


def run_with_console(config: Config, listening: Listening, report: Report | None) -> None:
    """The page's missions ask a person before motion, whatever the configuration allows: one is there."""
    checked(listening, config.console, Accounts(config.console.accounts))  # before a robot is opened
    asking = config.model_copy(update={"mission": replace(config.mission, motion="ask")})
    operator = SharedOperator()
    with (
        signals_stop(operator) as heard,
        in_wall_time(asking) as reached,
        open_missions(reached, operator, kept=asking) as missions,
        open_console(listening, reached, operator, missions) as console,
        open_remote(reached, operator, missions) as watching,
    ):
        invite = Invitation(console.server, config.recording.operator or "operator")
        more = {"pair": invite.operator, "pair viewer": invite.viewer}
        with Terminal(operator, who=config.recording.operator, where_empty=invite.again, more=more, commands=False):
            if not heard:
                invite.operator()
                run_missions(missions, operator, heard, report=report, watching=(console.live, *watching))
