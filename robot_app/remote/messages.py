"""What is said to a robot's operator over Zenoh: JSON requests and replies, one key a verb.

A queryable does not learn who asks. So a command carries the token of the lease that it was given under; what anybody
may do (look, STOP) and what an agent may do (propose) carries none, and the router's access rules are the other wall.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field

from drivers.ros.bridge_keys import BridgeKeys

REQUEST_MAX_BYTES = 16 << 10
Name = Annotated[str, Field(min_length=1, max_length=64)]
Words = Annotated[str, Field(min_length=1, max_length=300)]


class RemoteMessage(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
    verb: ClassVar[str]


class Leased(RemoteMessage):
    """token, epoch: of the lease, as `lease` gave it."""

    token: Annotated[str, Field(max_length=64)]
    epoch: int


class LeaseRequest(RemoteMessage):
    """Take the command. who: a person. over: also where somebody else has it, who is told."""

    verb: ClassVar[str] = "lease"
    who: Name
    over: bool = False


class BeatRequest(Leased):
    """A sign of life, five times a second: a moving robot is held where it does not come for 0.7 s."""

    verb: ClassVar[str] = "beat"


class ReleaseRequest(Leased):
    """Give the command back; refused while a mission runs."""

    verb: ClassVar[str] = "release"


class AskRequest(Leased):
    """Ask for a thing in plain words; its mission waits for those before it."""

    verb: ClassVar[str] = "ask"
    sentence: Words


class ConfirmRequest(Leased):
    """Answer the open question of `status`, over the memory that it names. number: with take and not this one."""

    verb: ClassVar[str] = "confirm"
    question: int
    memory_hash: Annotated[str, Field(max_length=128)]
    word: Literal["yes", "no", "not this one", "take"]
    number: int | None = None


class ProposeRequest(RemoteMessage):
    """An agent asks for a thing. A person at the console or the terminal must say yes before the robot moves."""

    verb: ClassVar[str] = "propose"
    agent: Name
    sentence: Words


class RemoteStopRequest(RemoteMessage):
    """STOP, by anybody and at any time: a software stop over a network, and no emergency stop."""

    verb: ClassVar[str] = "stop"
    who: Name
    agent: bool = False


class StatusRequest(RemoteMessage):
    """Who commands, what the robot is about, what is being asked, what was said. since: only sentences after that."""

    verb: ClassVar[str] = "status"
    since: int = 0


class CandidatesRequest(RemoteMessage):
    """The memory's objects for a phrase, best first."""

    verb: ClassVar[str] = "candidates"
    query: Words
    limit: Annotated[int, Field(ge=1, le=50)] = 10


class WhyRequest(RemoteMessage):
    """Every phrase, weight, frame and mask behind an object."""

    verb: ClassVar[str] = "why"
    object_id: Annotated[int, Field(ge=0)]


class RemoteReply(BaseModel):
    """ok false: nothing was done, and `refused` says why; else what the verb gives."""

    model_config = ConfigDict(extra="allow", frozen=True)
    ok: bool
    refused: str = ""


REQUESTS: tuple[type[RemoteMessage], ...] = (
    LeaseRequest,
    BeatRequest,
    ReleaseRequest,
    AskRequest,
    ConfirmRequest,
    ProposeRequest,
    RemoteStopRequest,
    StatusRequest,
    CandidatesRequest,
    WhyRequest,
)
# What the router lets a client do: who only looks, an agent, and a person who commands.
LOOKS = ("status", "candidates", "why", "stop")
AGENT_MAY = (*LOOKS, "propose")
VERBS = tuple(kind.verb for kind in REQUESTS)


def operator_key(verb: str, namespace: str = "") -> str:
    """openbelief/operator/VERB below the namespace."""
    return BridgeKeys(namespace).name(f"openbelief/operator/{verb}")
