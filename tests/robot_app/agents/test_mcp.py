"""`openbelief mcp` with the SDK's own client: an agent looks, proposes and stops; a person says yes."""

from __future__ import annotations

import asyncio
import builtins
import threading
from pathlib import Path
from typing import Any

import pytest

from logs.trial.reader import TrialReader
from robot_app.agents.server import agent_server
from robot_app.cli import Failure, main
from tests.robot_app.remote.test_live import command_of_the_page

mcp = pytest.importorskip("mcp", reason="the extra `agent` is not installed (requirements/agent.txt)")
ARMCHAIR = "go to the armchair"
SERVING = "Commands over Zenoh are taken at"


def agent(config: Path) -> Any:
    """The SDK's client, over the standard streams of a process of its own."""
    command, *arguments = ["helper" if word == "assistant" else word for word in command_of_the_page("mcp", config)]
    return mcp.Client(mcp.StdioServerParameters(command=command, args=arguments, cwd=Path.cwd()))


def value(result: Any) -> Any:
    assert not result.is_error, result.content
    return result.structured_content


async def looks(config: Path) -> dict[str, Any]:
    async with agent(config) as client:
        tools = {tool.name for tool in (await client.list_tools()).tools}
        found = value(await client.call_tool("find", {"query": "armchair", "limit": 3}))
        best = found["candidates"][0]["object_id"]
        return {
            "tools": tools,
            "best": found["candidates"][0]["label"],
            "why": value(await client.call_tool("why", {"object_id": best})),
            "where": value(await client.call_tool("where", {"query": "armchair"})),
            "nobody": await client.call_tool("propose_mission", {"sentence": ARMCHAIR}),
            "no object": await client.call_tool("why", {"object_id": 999}),
            "too long": await client.call_tool("propose_mission", {"sentence": "x" * 301}),
        }


def test_without_a_running_robot_an_agent_still_finds_things_and_is_told_why_it_cannot_propose(remote_toml):
    seen = asyncio.run(looks(remote_toml))
    assert seen["tools"] == {"find", "where", "why", "propose_mission", "watch", "stop"}
    assert seen["best"] == "armchair" and seen["why"]["observations"]
    assert seen["where"]["centroid"] == seen["why"]["centroid"]
    for name, because in (("nobody", "Nothing answers at"), ("no object", "no object 999"), ("too long", "300")):
        assert seen[name].is_error and because in seen[name].content[0].text


async def proposes(config: Path) -> dict[str, Any]:
    async with agent(config) as client:
        order = value(await client.call_tool("propose_mission", {"sentence": ARMCHAIR}))["order"]
        for _ in range(20):
            seen = value(await client.call_tool("watch", {"order": order, "seconds": 10}))
            if seen["outcome"]:
                return seen
    return seen


@pytest.mark.parametrize(("answer", "end"), [("yes", "CONFIRMED"), ("no", "CANCELLED")])
def test_what_an_agent_proposes_waits_for_the_persons_answer_and_is_named_in_the_trial(
    terminal,
    remote_toml,
    keyboard,
    screen,
    answer,
    end,
):
    config, got = remote_toml, []

    def run() -> None:
        try:
            got.append(asyncio.run(proposes(config)))
        finally:
            keyboard.type("")

    screen.reactions[SERVING] = lambda: threading.Thread(target=run).start()
    screen.reactions["The agent helper asks, not a person. May I walk"] = lambda: keyboard.type(answer)
    config.write_text(config.read_text().replace('motion = "ask"', 'motion = "allow"'))  # not for what an agent asks
    assert terminal(["run", "--config", str(config)]) == 0
    [seen] = got
    assert seen["outcome"]["end"] == end
    [path] = config.parent.glob("**/trial_*.mcap")
    trial = TrialReader(path)
    assert (trial.query.who, trial.query.how) == ("helper", "agent")
    [reply] = [record for record in trial.records if record.topic == "/trial/operator_reply"]
    assert (reply.reply, reply.how) == (answer, "terminal")
    assert any(f"The agent helper asks for: {ARMCHAIR}" in line for line in screen.lines)
    assert main(["replay", str(path)]) == 0


def test_without_the_extra_one_line_says_how_to_add_it(monkeypatch):
    whole = builtins.__import__

    def without(name, *arguments, **options):
        if name.split(".")[0] == "mcp":
            raise ImportError(name)
        return whole(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(Failure, match=r"requirements/agent\.txt"):
        agent_server(None, lambda: None, "helper")
