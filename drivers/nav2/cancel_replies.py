"""What the answers to a cancel mean. Several servers may answer: a cancel is taken when every one of them took it."""

from __future__ import annotations

from collections.abc import Sequence

from drivers.ros import action
from drivers.ros.action import ActionReply
from drivers.ros.messages import Message

# The gravest first: what one server says of a goal, where another says something else.
GRAVITY = (action.CANCEL_REJECTED, action.CANCEL_OK, action.CANCEL_TERMINATED, action.CANCEL_UNKNOWN_GOAL)


def cancel_code(answer: ActionReply, uuid: bytes) -> int | None:
    """The gravest answer to the cancel of one goal; None where there is none, or one cannot be read.

    "Ok" that does not name the goal cancels nothing (rclpy's way of refusing).
    """
    codes = [None if reply is None else _code(reply, uuid) for reply in answer.every]
    if not codes or None in codes:
        return None
    return min((code for code in codes if code is not None), key=GRAVITY.index)


def all_refused(answer: ActionReply) -> bool:
    """Whether the cancel of all goals was not taken: unanswered, unreadable, or refused by a server."""
    codes = [None if reply is None else int(reply.return_code) for reply in answer.every]
    return not codes or any(code in (None, action.CANCEL_REJECTED) for code in codes)


def not_halted(every: ActionReply, each: Sequence[tuple[bytes, ActionReply]]) -> str | None:
    """Why a goal may still run after the cancel of all goals and of `each`, as a clause; None where none does.

    The answer for all goals may leave out one that was refused, so each goal that is known is asked for by itself.
    """
    if all_refused(every):
        return every.why or "Nav2 refused"
    named = {uuid for reply in every.every if reply is not None for uuid in named_in(reply)}
    for uuid, answer in each:
        if uuid not in named and cancel_code(answer, uuid) in (None, action.CANCEL_REJECTED):
            return answer.why or "Nav2 refused for one goal"
    return None


def named_in(reply: Message) -> set[bytes]:
    """The goals that a CancelGoal_Response says are being cancelled."""
    return {bytes(info.goal_id.uuid) for info in reply.goals_canceling}


def _code(reply: Message, uuid: bytes) -> int:
    code = int(reply.return_code)
    if code == action.CANCEL_OK and uuid not in named_in(reply):
        return action.CANCEL_REJECTED
    return code if code in GRAVITY else action.CANCEL_REJECTED
