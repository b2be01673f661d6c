"""The tools of `openbelief mcp`: a language-model agent may look, propose and stop. It cannot say yes.

find, why and where read the memory's file. propose_mission, watch and stop reach an `openbelief run` over Zenoh, where
a person commands; what an agent proposed is named as an agent's in the question and in the trial.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from drivers.ports import PortError
from openbelief.memory import ObjectMemory
from robot_app.cli import Failure
from robot_app.mission.lease import Refused
from robot_app.remote.client import RemoteClient
from robot_app.remote.messages import ProposeRequest
from robot_app.remote.server import candidates, why

if TYPE_CHECKING:
    from mcp.server import MCPServer

HOW_TO_ADD = (
    "openbelief mcp needs the extra `agent`: add it in the checkout with "
    ".venv/bin/python -m pip install -r requirements/agent.txt"
)
INSTRUCTIONS = (
    "A walking robot with a memory of the objects of one site. find, where and why answer from that memory. "
    "propose_mission asks for a drive; a person at the robot's console or terminal must say yes before it moves, and "
    "may say no. Nothing you say is that yes. watch tells what became of it; stop works at any time, by software."
)
WATCH_MAX_S, LOOK_S = 30.0, 0.2
Remote = Callable[[], RemoteClient]


def agent_server(memory: ObjectMemory, remote: Remote, agent: str) -> MCPServer[Any]:
    """agent: the name under which a person sees what is proposed. Raises Failure where the extra is missing."""
    try:
        from mcp.server import MCPServer
    except ImportError as error:
        raise Failure(HOW_TO_ADD) from error
    server: MCPServer[Any] = MCPServer("openbelief", instructions=INSTRUCTIONS, log_level="WARNING")
    for tool in (*_of_memory(memory), *_of_robot(remote, agent)):
        server.tool()(tool)
    return server


def _of_memory(memory: ObjectMemory) -> tuple[Callable[..., Any], ...]:
    def find(
        query: Annotated[str, Field(max_length=300)], limit: Annotated[int, Field(ge=1, le=50)] = 5
    ) -> dict[str, Any]:
        """The mapped objects that fit a phrase best, with score, phrases and place (metres, map frame)."""
        return _said(lambda: candidates(memory, query, limit))

    def where(query: Annotated[str, Field(max_length=300)]) -> dict[str, Any]:
        """Where the best candidate for a phrase is: its centre (x, y, z in metres, map frame) and room."""
        return _said(lambda: _place(memory, query))

    def why_object(object_id: Annotated[int, Field(ge=0)]) -> dict[str, Any]:
        """Every phrase, weight, frame and mask that speaks for an object of `find`."""
        return _said(lambda: why(memory, object_id))

    why_object.__name__ = "why"
    return find, where, why_object


def _of_robot(remote: Remote, agent: str) -> tuple[Callable[..., Any], ...]:
    def propose_mission(sentence: Annotated[str, Field(max_length=300)]) -> dict[str, Any]:
        """Ask for a drive in plain words ("take me to the sofa"). A person must say yes before the robot moves."""
        request = ProposeRequest(agent=agent, sentence=sentence)
        asked = _said(lambda: remote().send(request))
        return {"proposed": sentence, "order": asked["order"], "next": "watch it; a person is asked before it moves"}

    def watch(order: int, seconds: Annotated[float, Field(ge=0, le=WATCH_MAX_S)] = 10.0) -> dict[str, Any]:
        """What becomes of the mission with that order: waits until it has ended, at most so many seconds."""
        return _said(lambda: _watched(remote(), order, seconds))

    def stop() -> dict[str, Any]:
        """STOP the robot: a software stop over a network, no emergency stop."""
        _said(lambda: remote().stop(agent, agent=True))
        return {"stop": "heard"}

    return propose_mission, watch, stop


def _place(memory: ObjectMemory, query: str) -> dict[str, Any]:
    found = candidates(memory, query, 1)
    if not found["candidates"]:
        raise ValueError(f"Nothing here: {found['because']}.")
    best = found["candidates"][0]
    return {key: best[key] for key in ("object_id", "label", "centroid", "room", "score")}


def _watched(remote: RemoteClient, order: int, seconds: float) -> dict[str, Any]:
    end_s = time.monotonic() + seconds
    while True:
        status = remote.status()
        outcome = status["outcome"]
        ended = outcome is not None and outcome["order"] == order and status["mission"] is None
        if ended or time.monotonic() >= end_s:
            return {
                "outcome": outcome if ended else None,
                "mission": status["mission"],
                "asked of a person": status["question"]["sentence"] if status["question"] else None,
                "stop": status["stop"],
                "said": [each["sentence"] for each in status["said"]][-10:],
            }
        time.sleep(LOOK_S)


def _said(act: Callable[[], Any]) -> Any:
    """What goes wrong in a way that was foreseen, as a sentence that the agent may read."""
    from mcp.server.mcpserver.exceptions import ToolError

    try:
        return act()
    except (Refused, PortError, ValueError) as error:
        raise ToolError(str(error)) from error
