"""A question that waits for an answer: it has a number, counts once, and expires."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.ports import Approval, Option, Question, Reply
from robot_app.mission.lease import Refused

ANSWERS = (Approval.YES, Approval.NO, Approval.NOT_THIS_ONE, Approval.TAKE)


@dataclass
class OpenQuestion:
    """id: never given twice. expires_s: by the Operator's clock, `timeout_s` after it was asked. reply: None without.

    void: a takeover ended it; it is asked anew, with another id.
    """

    id: int
    question: Question
    timeout_s: float
    expires_s: float
    reply: Reply | None = None
    void: bool = False

    def left_s(self, now_s: float) -> float:
        return max(0.0, self.expires_s - now_s)

    def require(self, question_id: int, memory_hash: str, now_s: float) -> None:
        """Raises Refused where an answer to that question, over that memory, no longer counts."""
        if question_id != self.id or self.void:
            raise Refused("That question is no longer asked: look at the one that is.")
        if self.reply is not None:
            raise Refused("That question was answered already.")
        if self.left_s(now_s) <= 0.0:
            raise Refused("The answer came too late: the question has expired.")
        if memory_hash != self.question.memory_hash:
            raise Refused("That answer is about another memory: load the page again.")

    def chosen(self, word: Approval, number: int | None) -> int | None:
        """The object that the answer names, by its number among the options; raises Refused where there is none."""
        options = {option.number: option for option in self.question.options}
        if word not in ANSWERS or (word in (Approval.NOT_THIS_ONE, Approval.TAKE) and not options):
            raise Refused(f"{word.capitalize()} is no answer to this question.")
        if word in (Approval.YES, Approval.NO):
            return None
        if number is None and word is Approval.NOT_THIS_ONE:
            return self.question.object_id
        if number not in options:
            raise Refused(f"There is no candidate number {number}: 1 to {len(options)} are there.")
        return options[number].object_id

    @property
    def words(self) -> str:
        """What may be answered, for a line of text."""
        return "yes/no/not this one/take N/why" if self.question.options else "yes/no"


def option_lines(options: tuple[Option, ...]) -> list[str]:
    return [f"  {option.number}. {option.label}  {option.score:.2f}" for option in options]
