"""Where a run can be commanded over Zenoh: not at all, at this machine, or through the robot's router."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.ports import PortError
from drivers.ros.zenoh_link import LinkConfig, ZenohLink, open_router
from logs.trial.journal import Journal
from robot_app.config import Config
from robot_app.mission.missions import Missions
from robot_app.mission.operator import SharedOperator
from robot_app.remote.server import RemoteServer


@contextmanager
def open_remote(config: Config, operator: SharedOperator, missions: Missions) -> Iterator[tuple[Journal, ...]]:
    """`[remote] serve` of robot.toml; yields the journals that must watch the missions. Raises PortError."""
    server, serve = RemoteServer(operator, missions.memory), config.remote.serve
    if serve == "off":
        yield ()
    elif serve == "robot":
        if "ros" not in missions.robot.wiring.wires:
            raise PortError('[remote] serve = "robot" needs a robot: say "here" for a simulated one.')
        with server.serving(missions.robot.wiring.wires["ros"].link, config.zenoh.namespace):
            operator.tell(f"Commands over Zenoh are taken through the robot's router, {config.zenoh.endpoint}.")
            yield (server,)
    else:
        with (
            open_router(config.remote.endpoint) as endpoint,
            ZenohLink(LinkConfig((endpoint,))) as link,
            server.serving(link, config.zenoh.namespace),
        ):
            operator.tell(f"Commands over Zenoh are taken at {endpoint}.")
            yield (server,)


def link_config(config: Config) -> LinkConfig:
    """How a client reaches that run with the same robot.toml."""
    if config.remote.serve == "robot":
        return LinkConfig((config.zenoh.endpoint,), tls=config.zenoh.tls)
    return LinkConfig((config.remote.endpoint,))
