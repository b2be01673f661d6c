"""How the watchdog stops the robot without the bridge: it stands beside Nav2, so it speaks to it on DDS itself."""

from __future__ import annotations

import logging
import secrets
from dataclasses import dataclass, field
from typing import Protocol

from drivers.dds.action import (
    CANCEL_REQUEST,
    CANCEL_RESPONSE,
    STATUS_ARRAY,
    ActionTopics,
    with_header,
    without_header,
)
from drivers.dds.raw import DdsPeer, DdsUnavailable
from drivers.repeats import Repeats
from drivers.ros.action import statuses
from drivers.ros.messages import Message, WireError, codec
from drivers.topics import ACTION_MAX_BYTES, NAVIGATE_TO_POSE
from drivers.watchdog.running_goals import RunningGoals

logger = logging.getLogger(__name__)
PENDING_MAX = 32


@dataclass(frozen=True)
class Acknowledgement:
    """What every server that hears us answered to the cancel of one trip; the gravest code."""

    trip: int
    code: int


class Hand(Protocol):
    """A second way to Nav2. Nothing here blocks; nothing raises but DdsUnavailable where it is broken for good."""

    name: str

    @property
    def servers(self) -> int:
        """How many Nav2 servers it reaches just now."""
        ...

    @property
    def driving(self) -> bool:
        """Whether one of them says that a goal runs."""
        ...

    def cancel_all(self, trip: int) -> None: ...

    def hear(self) -> list[Acknowledgement]:
        """What was answered since the last call."""
        ...


@dataclass
class _Pending:
    trip: int
    servers: int
    replies: list[Message] = field(default_factory=list)


class DdsHand:
    """The Hand over a DDS participant of its own (`cyclonedds`)."""

    name = "cyclonedds"

    def __init__(self, peer: DdsPeer) -> None:
        topics = ActionTopics(NAVIGATE_TO_POSE)
        self._requests = peer.writer(topics.cancel_request, CANCEL_REQUEST)
        self._replies = peer.reader(topics.cancel_reply, CANCEL_RESPONSE)
        self._statuses = peer.reader(topics.status, STATUS_ARRAY, latched=True)
        self._client, self._sequence = secrets.randbits(63), 0
        self._pending: dict[int, _Pending] = {}
        self._goals, self._repeats = RunningGoals(), Repeats()
        codec().warm_up([CANCEL_REQUEST, CANCEL_RESPONSE, STATUS_ARRAY])
        self._cancel_all = codec().encode(codec().make(CANCEL_REQUEST))  # zero uuid, zero stamp

    @property
    def servers(self) -> int:
        return self._requests.readers

    @property
    def driving(self) -> bool:
        return bool(self._goals)

    def cancel_all(self, trip: int) -> None:
        self._sequence += 1
        self._pending[self._sequence] = _Pending(trip, max(self.servers, 1))
        while len(self._pending) > PENDING_MAX:
            del self._pending[next(iter(self._pending))]
        self._requests.write(with_header(self._cancel_all, self._client, self._sequence))

    def hear(self) -> list[Acknowledgement]:
        for payload in self._statuses.take():
            self._hear_status(payload)
        if not self._statuses.writers:
            self._goals.forget()
        return [found for payload in self._replies.take() if (found := self._hear_reply(payload))]

    def _hear_status(self, payload: bytes) -> None:
        try:
            array = codec().decode(payload[:ACTION_MAX_BYTES], STATUS_ARRAY)
        except WireError as error:
            self._ignored("a status", error)
            return
        self._goals.hear(statuses(array))

    def _hear_reply(self, payload: bytes) -> Acknowledgement | None:
        """The answer of the last server that was asked; until then nothing is acknowledged."""
        found = without_header(payload)
        if found is None or found[1] != self._client or (pending := self._pending.get(found[2])) is None:
            return None  # somebody else's
        try:
            pending.replies.append(codec().decode(found[0], CANCEL_RESPONSE))
        except WireError as error:
            self._ignored("an answer", error)
            return None
        if len(pending.replies) < pending.servers:
            return None
        del self._pending[found[2]]
        return Acknowledgement(pending.trip, self._goals.code(pending.replies))

    def _ignored(self, what: str, error: WireError) -> None:
        if count := self._repeats.due(what):
            logger.warning("%s on DDS was ignored (%d so far): %s", what, count, error)


__all__ = ["Acknowledgement", "DdsHand", "DdsUnavailable", "Hand"]
