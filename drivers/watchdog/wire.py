"""What workstation and robot say to each other about the watchdog: keys, the heartbeat, the status, the reset."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drivers.ros.bridge_keys import BridgeKeys
from drivers.watchdog.latch import WatchdogState

MAX_BYTES = 1024  # a heartbeat, a reset
STATUS_MAX_BYTES = 4096  # it names every workstation that is watched
BEAT_S = 0.1  # 10 Hz
STATUS_S = 0.2  # the robot tells the state 5 times a second, so that who comes late knows it too
STATUS_MAX_AGE_S = 1.0


Kind = TypeVar("Kind", bound="WatchdogMessage")


class WatchdogWireError(ValueError):
    """A payload that is no heartbeat or status; the text says which."""


class WatchdogMessage(BaseModel):
    model_config = ConfigDict(extra="ignore", frozen=True)
    max_bytes: ClassVar[int] = MAX_BYTES


class HeartbeatMessage(WatchdogMessage):
    """One heartbeat. state "goodbye": the workstation ends in good order and has no goal under way."""

    workstation: str = Field(pattern=r"^[0-9a-f]{32}$")
    sequence: int = Field(ge=0)
    state: Literal["alive", "goodbye"] = "alive"


class WatchdogStatus(WatchdogMessage):
    """The watchdog's own word. reason: why it is latched, empty otherwise. sequence counts statuses.

    watched: the workstations whose silence it acts on. full: no further one is taken. hand: what cancels without the
    bridge ("cyclonedds", "rclpy", "" where nothing does), and how many Nav2 servers it reaches.
    """

    max_bytes: ClassVar[int] = STATUS_MAX_BYTES
    state: WatchdogState
    watched: tuple[str, ...] = ()
    full: bool = False
    hand: str = ""
    hand_servers: int = 0
    reason: str = ""
    acknowledged: bool = False
    sequence: int = 0


class ResetReply(WatchdogMessage):
    """Whether a reset was taken, and if not why."""

    ok: bool
    reason: str = ""


@dataclass(frozen=True)
class WatchdogKeys:
    """Under the bridge's namespace, beside the robot's topics."""

    keys: BridgeKeys

    @property
    def heartbeat(self) -> str:
        return self.keys.name("openbelief/heartbeat")

    @property
    def status(self) -> str:
        return self.keys.name("openbelief/watchdog/status")

    @property
    def reset(self) -> str:
        return self.keys.name("openbelief/watchdog/reset")

    def token(self, workstation: str = "*") -> str:
        return self.keys.name(f"openbelief/workstation/{workstation}")


def packed(message: WatchdogMessage) -> bytes:
    return message.model_dump_json().encode()


def unpacked(kind: type[Kind], payload: bytes) -> Kind:
    """Raises WatchdogWireError."""
    if len(payload) > kind.max_bytes:
        raise WatchdogWireError(f"{len(payload)} bytes are too many for a {kind.__name__}.")
    try:
        return kind.model_validate_json(payload)
    except ValidationError as error:
        raise WatchdogWireError(f"This is no {kind.__name__}: {error.errors()[0]['msg']}") from error
