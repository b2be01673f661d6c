"""What a page may command: a table from message to the Operator's method, who may send it, and what it must name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from drivers.ports import Approval
from logs.structured import neutralise
from robot_app.console.accounts import Role
from robot_app.console.snapshots import Snapshots
from robot_app.console.talk import Talk
from robot_app.mission.command_replies import is_stop
from robot_app.mission.lease import Lease, Refused
from robot_app.mission.operator import SharedOperator
from robot_app.mission.sentences import SENTENCE_MAX

HOW = "console"
SEEN_MAX_AGE_S = 2.0  # a command names what was on the screen; older than this it was not given just now
BEAT_MAX_AGE_S = 5.0


class Message(BaseModel):
    """id: echoed in the acknowledgement."""

    model_config = ConfigDict(extra="forbid", strict=True)
    id: int = Field(0, ge=0)


class BeatCommand(Message):
    type: Literal["beat"]
    seen: int


class StopCommand(Message):
    type: Literal["stop"]


class TakeCommand(Message):
    type: Literal["take"]
    seen: int
    over: bool = False


class ReleaseCommand(Message):
    type: Literal["release"]
    seen: int


class AskCommand(Message):
    type: Literal["ask"]
    seen: int
    epoch: int
    text: str = Field(min_length=1, max_length=SENTENCE_MAX)
    heard: int = 0  # what was said aloud for it, by the number that the talk button gave; 0: it was typed


class AnswerCommand(Message):
    type: Literal["answer"]
    seen: int
    epoch: int
    question: int
    memory_hash: str = Field(max_length=128)
    word: Literal["yes", "no", "not this one", "take"]
    number: int | None = None


AnyMessage = Annotated[
    BeatCommand | StopCommand | TakeCommand | ReleaseCommand | AskCommand | AnswerCommand, Field(discriminator="type")
]
MESSAGES: TypeAdapter[Any] = TypeAdapter(AnyMessage)


@dataclass
class Page:
    """One page in one browser: its session's name and role, and the lease that it was given. id: made by the page."""

    name: str
    role: Role
    id: str = ""
    lease: Lease | None = field(default=None, repr=False)


class Commands:
    """Carries out what pages send. `obey` returns the acknowledgement, or None where none is due."""

    def __init__(self, operator: SharedOperator, snapshots: Snapshots, talk: Talk | None = None) -> None:
        self._operator, self._snapshots, self._talk = operator, snapshots, talk
        self._table: dict[type[Message], Callable[[Page, Any], str]] = {
            StopCommand: self._stop,
            TakeCommand: self._take,
            ReleaseCommand: self._release,
            AskCommand: self._ask,
            AnswerCommand: self._answer,
        }

    def obey(self, page: Page, text: str) -> dict[str, Any] | None:
        try:
            message = MESSAGES.validate_json(text)
        except ValidationError as error:
            return _refusal(0, f"That was no command: {neutralise(error.errors()[0]['msg'])}.")
        if isinstance(message, BeatCommand):
            self._beat(page, message)
            return None
        try:
            self._check(page, message)
            return {"type": "ack", "id": message.id, "ok": True, "text": self._table[type(message)](page, message)}
        except Refused as refused:
            return _refusal(message.id, str(refused))

    def _check(self, page: Page, message: Message) -> None:
        """Anybody may stop, in any words; the rest is an operator's, given in view of what is now."""
        if isinstance(message, StopCommand) or (isinstance(message, AskCommand) and is_stop(message.text)):
            return
        if page.role != "operator":
            raise Refused("You are a viewer: you may look, and STOP.")
        age_s = self._snapshots.age_s(getattr(message, "seen", -1))
        if age_s is None or age_s > SEEN_MAX_AGE_S:
            raise Refused("Not done: that command was given too long ago. Look again.")
        epoch = getattr(message, "epoch", None)
        if epoch is not None and (page.lease is None or epoch != page.lease.epoch):
            raise Refused(_who_commands(self._operator))

    def _beat(self, page: Page, message: BeatCommand) -> None:
        """As old as the snapshot that was painted; a page without the lease may beat in vain."""
        age_s = self._snapshots.age_s(message.seen)
        if age_s is None or age_s > BEAT_MAX_AGE_S or page.lease is None:
            return
        try:
            self._operator.beat(page.lease, age_s=age_s)
        except Refused:
            page.lease = None

    def _stop(self, page: Page, _: StopCommand) -> str:
        self._operator.stop(because=f"{page.name} pressed STOP", who=page.name, how=HOW)
        return "STOP was heard."

    def _take(self, page: Page, message: TakeCommand) -> str:
        page.lease = self._operator.take(page.name, HOW, over=message.over, beats=True)
        return "You command the robot."

    def _release(self, page: Page, _: ReleaseCommand) -> str:
        if page.lease is None:
            raise Refused(_who_commands(self._operator))
        self._operator.release(page.lease)
        page.lease = None
        return "You no longer command the robot."

    def _ask(self, page: Page, message: AskCommand) -> str:
        from robot_app.mission.recorded import not_a_command

        text = " ".join(message.text.split())
        if is_stop(text):
            self._operator.stop(because=f"{page.name} said {text!r}", who=page.name, how=HOW)
            return "STOP was heard."
        try:
            not_a_command(text)
        except ValueError as error:
            raise Refused(str(error)) from error
        notes = self._talk.notes(page.name, message.heard, text) if self._talk and message.heard else ()
        self._operator.ask(page.lease, text, notes)
        return f"Asked: {text}"

    def _answer(self, page: Page, message: AnswerCommand) -> str:
        reply = self._operator.answer(
            page.lease,
            message.question,
            Approval(message.word),
            memory_hash=message.memory_hash,
            number=message.number,
        )
        return f"Answered: {reply.word}"


def _who_commands(operator: SharedOperator) -> str:
    lease = operator.lease
    return f"{lease.holder} commands the robot now: take over first." if lease else "Take the command first."


def _refusal(message_id: int, sentence: str) -> dict[str, Any]:
    return {"type": "ack", "id": message_id, "ok": False, "text": sentence}
