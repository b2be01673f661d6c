"""Whole missions of a run that is commanded through the robot's own router: TLS, access rules, certificates, lease."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
import zenoh

from drivers.ports import PortError
from drivers.ros.zenoh_link import ZenohLink
from logs.trial.reader import TrialReader
from robot_app.certs.zenoh import AGENT, OPERATOR, WORKSTATION
from robot_app.config import dump_config, load_config
from robot_app.config_sections import RemoteSection
from robot_app.remote import messages as m
from robot_app.remote.client import NOBODY, RemoteClient
from robot_app.remote.service import link_config
from robot_app.wall_time_robot import in_wall_time
from tests.robot_app.certs.test_certs import free_ports, new_network
from tests.robot_app.remote.test_live import ARMCHAIR, beside


@dataclass(frozen=True)
class Networked:
    """A simulated robot behind the shipped router; each machine's robot.toml."""

    workstation: Path
    operator: Path
    agent: Path


@pytest.fixture
def networked(small_site: Path) -> Iterator[Networked]:
    certs = small_site / "certs"
    network = new_network(certs, free_ports())
    with ExitStack() as opened:
        reached = opened.enter_context(in_wall_time(load_config(small_site / "robot.toml")))
        router = zenoh.Config.from_file(str(certs / "robot" / "bridge.json5"))
        router.insert_json5("connect/endpoints", json.dumps([reached.zenoh.endpoint]))
        opened.enter_context(zenoh.open(router))

        def written(who: str) -> Path:
            door = load_config(certs / who / "robot.toml").zenoh
            config = reached.model_copy(
                update={
                    "zenoh": door,
                    "remote": RemoteSection(serve="robot"),
                    "mission": replace(reached.mission, motion="ask"),
                }
            )
            path = small_site / f"{who}.toml"
            path.write_text(dump_config(config))
            return path

        assert load_config(certs / WORKSTATION / "robot.toml").zenoh.endpoint == network.endpoint
        yield Networked(*(written(who) for who in (WORKSTATION, OPERATOR, AGENT)))


def denied(agent: Path, request: m.RemoteMessage) -> bool:
    """Whether nobody answers a program with the agent's certificate."""
    config = load_config(agent)
    with ZenohLink(link_config(config)) as link:
        try:
            RemoteClient(link).send(request)
        except PortError as error:
            return str(error) == NOBODY
    return False


def test_an_operators_program_asks_says_yes_and_is_confirmed_and_an_agents_may_not(
    terminal, networked, keyboard, screen, capsys
):
    def act() -> dict:
        command = [sys.executable, "-m", "robot_app.cli", "ask", ARMCHAIR, "--remote", "--take-over", "--yes", "--json"]
        done = subprocess.run(
            [*command, "--who", "ada", "--config", str(networked.operator)],
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=150,
        )
        with ZenohLink(link_config(load_config(networked.agent))) as link:
            looks = RemoteClient(link).status()["outcome"]["end"]
        return {
            "done": done,
            "agent looks": looks,
            "agent leases": not denied(networked.agent, m.LeaseRequest(who="helper", over=True)),
            "agent confirms": not denied(
                networked.agent, m.ConfirmRequest(token="", epoch=1, question=1, memory_hash="", word="yes")
            ),
        }

    got = beside(screen, keyboard, act)
    assert terminal(["run", "--config", str(networked.workstation), "--json"]) == 0, screen.lines[-5:]
    [seen] = got
    assert isinstance(seen, dict), seen
    assert seen["done"].returncode == 0, seen["done"].stderr
    assert json.loads(seen["done"].stdout)["outcome"] == "CONFIRMED" == seen["agent looks"]
    assert not seen["agent leases"] and not seen["agent confirms"]
    trial = TrialReader(Path(json.loads(capsys.readouterr().out.splitlines()[-1])["trial"]))
    assert (trial.query.who, trial.query.how) == ("ada", "zenoh")


def test_a_simulated_robot_has_no_router_and_that_is_said(terminal, small_site, screen):
    config = small_site / "robot.toml"
    config.write_text(config.read_text().replace('serve = "off"', 'serve = "robot"'))
    assert terminal(["run", "--config", str(config)]) == 1
    assert 'say "here" for a simulated one' in screen.lines[-1]
