"""For language-model agents: a Model Context Protocol server on standard input and output.

Tools: find, where and why (from the memory of robot.toml), and propose_mission, watch and stop, which reach a running
`openbelief run` whose robot.toml says [remote] serve = "here" or "robot". Motion waits for a person's yes at its
console or terminal, whatever an agent says; what was proposed is named as an agent's there and in the trial.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, Usage

if TYPE_CHECKING:
    from robot_app.config import Config
    from robot_app.remote.client import RemoteClient

EXAMPLE = "openbelief mcp --config demo-out/robot.toml --agent assistant"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--config", type=Path, default=Path("robot.toml"), metavar="robot.toml", help="default robot.toml"
    )
    parser.add_argument("--agent", default="mcp", metavar="NAME", help="how the agent is named to people (default mcp)")


def run(options: argparse.Namespace) -> None:
    from openbelief.memory import ObjectMemory
    from openbelief.store import BeliefFileError
    from robot_app.agents.server import agent_server
    from robot_app.app import mission_text_encoder
    from robot_app.config import ConfigError, load_config

    if options.json:
        raise Usage("openbelief mcp speaks JSON on standard output already")
    try:
        config = load_config(options.config)
        if config.memory is None:
            raise ConfigError('no memory is named: say memory = "site.belief" (openbelief map makes one)')
        memory = ObjectMemory.open(config.memory, text_encoder=mission_text_encoder(config))
        with _RemoteWhenNeeded(config) as remote:
            agent_server(memory, remote.client, options.agent).run("stdio")
    except (ConfigError, BeliefFileError, OSError, ValueError) as error:
        raise Failure(str(error)) from error


class _RemoteWhenNeeded:
    """The link to the run, opened by the first tool that needs it: the memory's tools work without."""

    def __init__(self, config: Config) -> None:
        from contextlib import ExitStack

        self._config, self._opened = config, ExitStack()
        self._client: RemoteClient | None = None

    def __enter__(self) -> _RemoteWhenNeeded:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    def client(self) -> RemoteClient:
        """Raises PortError where nobody listens there."""
        from drivers.ros.zenoh_link import ZenohLink
        from robot_app.remote.client import RemoteClient
        from robot_app.remote.service import link_config

        if self._client is None:
            link = self._opened.enter_context(ZenohLink(link_config(self._config)))
            self._client = RemoteClient(link, self._config.zenoh.namespace)
        return self._client
