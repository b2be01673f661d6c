"""A ROS 2 action or service asked over Zenoh: every question ends in a message or in the reason why there is none."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from queue import Empty, SimpleQueue

import numpy as np

from drivers.ros.bridge_keys import Keys
from drivers.ros.messages import Codec, Message, WireError, stamp_to_ns
from drivers.ros.shapes import Shapes
from drivers.ros.subscription import Subscription
from drivers.ros.zenoh_link import Replies, ZenohLink
from drivers.topics import ACTION_MAX_BYTES, Action, Service

CANCEL, STATUS_ARRAY = "action_msgs/srv/CancelGoal", "action_msgs/msg/GoalStatusArray"
OWN_TYPES = (
    "SendGoal_Request",
    "SendGoal_Response",
    "GetResult_Request",
    "GetResult_Response",
    "FeedbackMessage",
)
ALL_GOALS = bytes(16)  # the zero uuid with a zero stamp
UNKNOWN, ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(7)  # action_msgs/GoalStatus
ACTIVE, TERMINAL = (ACCEPTED, EXECUTING, CANCELING), (SUCCEEDED, CANCELED, ABORTED)
CANCEL_OK, CANCEL_REJECTED, CANCEL_UNKNOWN_GOAL, CANCEL_TERMINATED = range(4)  # action_msgs/CancelGoal


@dataclass(frozen=True)
class ActionReply:
    """The reply to one question; where there is none, `why` is the clause that says so.

    replies: each server's own where several answered, None for one that cannot be read; then `message` is None.
    """

    message: Message | None
    why: str = ""
    replies: tuple[Message | None, ...] = ()

    @property
    def every(self) -> tuple[Message | None, ...]:
        """What each server said that answered."""
        return self.replies or (() if self.message is None else (self.message,))


class ServiceClient:
    """Asks one ROS service; an action is three of them."""

    def __init__(self, link: ZenohLink, key: str, type_name: str, shapes: Shapes) -> None:
        self._link, self._key, self._type_name, self._shapes = link, key, type_name, shapes

    def ask(self, timeout_s: float, **fields: Message) -> ActionReply:
        """Wait for the reply, `timeout_s` of wall time at most. Raises LinkLost where our own session is closed."""
        return self.ask_with(self._request(fields), timeout_s)

    def ask_with(self, payload: bytes, timeout_s: float) -> ActionReply:
        """The same for a request that is encoded already."""
        return self._answer(self._link.get(self._key, payload, timeout_s))

    def ask_later(self, timeout_s: float, use: Callable[[ActionReply], None], **fields: Message) -> None:
        """The same without waiting."""
        payload = self._request(fields)
        self._link.get_later(self._key, payload, timeout_s, lambda replies: use(self._answer(replies)))

    def _request(self, fields: dict[str, Message]) -> bytes:
        return self._shapes.encode(self._shapes.make(f"{self._type_name}_Request", **fields))

    def _answer(self, replies: Replies) -> ActionReply:
        """An empty list is ambiguous: no such service, a request it could not read, or a link that died."""
        if len(replies.payloads) > 1:
            said = f"{len(replies.payloads)} servers answered on {self._key}: leave one running"
            return ActionReply(None, said, tuple(self._decoded(payload).message for payload in replies.payloads))
        if replies.payloads:
            return self._decoded(replies.payloads[0])
        if replies.errors:
            late = "Timeout" in replies.errors
            return ActionReply(
                None, "no answer came in time" if late else f"the answer was an error: {replies.errors[0]}"
            )
        return ActionReply(None, f"nobody answered on {self._key}")

    def _decoded(self, payload: bytes) -> ActionReply:
        if len(payload) > ACTION_MAX_BYTES:
            return ActionReply(None, f"the answer has {len(payload)} bytes, more than the {ACTION_MAX_BYTES} allowed")
        try:
            return ActionReply(self._shapes.decode(payload, f"{self._type_name}_Response"))
        except WireError as error:
            return ActionReply(None, f"the answer cannot be read: {error}")


def service_client(link: ZenohLink, keys: Keys, service: Service, shapes: Shapes) -> ServiceClient:
    return ServiceClient(link, keys.service(service), service.type_name, shapes)


class ActionClient:
    """Asks one ROS action server behind the bridge and hears what it says.

    Making one takes 0.1-0.5 s the first time: nothing is left to be compiled while a robot moves.
    """

    def __init__(self, link: ZenohLink, keys: Keys, action: Action, shapes: Shapes) -> None:
        self.action, self._link, self._keys, self._shapes = action, link, keys, shapes
        own = [f"{action.type_name}_{kind}" for kind in OWN_TYPES]
        shapes.warm_up([*own, f"{CANCEL}_Request", f"{CANCEL}_Response", STATUS_ARRAY])
        self._send = self._service("send_goal", f"{action.type_name}_SendGoal")
        self._result = self._service("get_result", f"{action.type_name}_GetResult")
        self._cancel = self._service("cancel_goal", CANCEL)

    def _service(self, part: str, type_name: str) -> ServiceClient:
        return ServiceClient(self._link, self._keys.action(self.action, part), type_name, self._shapes)

    def send_goal(self, uuid: bytes, timeout_s: float, **goal: Message) -> ActionReply:
        """SendGoal_Response. The same uuid sent twice cannot run twice.

        A goal whose shape differs between the distributions left is asked in each, in their order, until one answers;
        where none does, the first reason counts.
        """
        silences = []
        for payload, shapes in self._shapes.encodings(lambda codec: self._goal(codec, uuid, goal)).items():
            answer = self._send.ask_with(payload, timeout_s)
            if answer.message is not None:
                if answer.message.accepted:
                    self._shapes.keep(shapes)
                return answer
            silences.append(answer)
        return silences[0]

    def _goal(self, codec: Codec, uuid: bytes, fields: dict[str, Message]) -> Message:
        goal = codec.make(f"{self.action.type_name}_Goal", **fields)
        return codec.make(f"{self.action.type_name}_SendGoal_Request", goal_id=self._uuid(uuid), goal=goal)

    def get_result(self, uuid: bytes, timeout_s: float) -> ActionReply:
        """GetResult_Response; the server answers when the goal has ended, at once where it knows no such goal."""
        return self._result.ask(timeout_s, goal_id=self._uuid(uuid))

    def get_result_later(self, uuid: bytes, timeout_s: float, use: Callable[[ActionReply], None]) -> None:
        self._result.ask_later(timeout_s, use, goal_id=self._uuid(uuid))

    def cancel(self, uuid: bytes, timeout_s: float) -> ActionReply:
        """CancelGoal_Response; ALL_GOALS cancels every goal of the server."""
        return self._cancel.ask(timeout_s, goal_info=self._info(uuid))

    def cancel_each(self, uuids: Sequence[bytes], timeout_s: float) -> list[ActionReply]:
        """The answers to several cancels, all asked at once."""
        answers: SimpleQueue[tuple[int, ActionReply]] = SimpleQueue()
        for number, uuid in enumerate(uuids):
            self.cancel_later(uuid, timeout_s, partial(_keep, answers, number))
        found = [ActionReply(None, "no answer came in time")] * len(uuids)
        end_s = time.monotonic() + timeout_s + 1.0  # Zenoh ends every query itself; the margin is for a loaded machine
        with suppress(Empty):
            for _ in uuids:
                number, answer = answers.get(timeout=max(end_s - time.monotonic(), 0.0))
                found[number] = answer
        return found

    def cancel_later(self, uuid: bytes, timeout_s: float, use: Callable[[ActionReply], None]) -> None:
        self._cancel.ask_later(timeout_s, use, goal_info=self._info(uuid))

    def listen(
        self,
        feedback: Callable[[Message], None],
        status: Callable[[dict[bytes, int]], None],
        accepted: Callable[[dict[bytes, int]], None] = lambda _: None,
    ) -> None:
        """Hear feedback messages, and of every goal by uuid (latched): when it was accepted, then its status."""

        def use(array: Message) -> None:
            accepted(acceptances(array))
            status(statuses(array))

        heard = self._intake("feedback", f"{self.action.type_name}_FeedbackMessage", feedback)
        self._link.subscribe(self._keys.action(self.action, "feedback"), heard)
        array = self._intake("status", STATUS_ARRAY, use)
        self._link.subscribe(self._keys.action(self.action, "status"), array, history=True)

    def _intake(self, part: str, type_name: str, use: Callable[[Message], None]) -> Subscription:
        return Subscription(f"{self.action.name} {part}", type_name, ACTION_MAX_BYTES, self._shapes, use)

    def _info(self, uuid: bytes) -> Message:
        return self._shapes.make("action_msgs/msg/GoalInfo", goal_id=self._uuid(uuid))

    def _uuid(self, uuid: bytes) -> Message:
        return self._shapes.make("unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(uuid, np.uint8))


def _keep(answers: SimpleQueue[tuple[int, ActionReply]], number: int, answer: ActionReply) -> None:
    answers.put((number, answer))


def acceptances(array: Message) -> dict[bytes, int]:
    """Goal uuid -> when its server accepted it, in nanoseconds, of a GoalStatusArray."""
    return {bytes(s.goal_info.goal_id.uuid): stamp_to_ns(s.goal_info.stamp) for s in array.status_list}


def statuses(array: Message) -> dict[bytes, int]:
    """Goal uuid -> status of a GoalStatusArray."""
    return {bytes(s.goal_info.goal_id.uuid): int(s.status) for s in array.status_list}
