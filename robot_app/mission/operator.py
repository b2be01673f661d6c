"""The operator of a robot, whoever speaks for them: one lease, one STOP latch, one question, one queue of sentences.

Terminal, console, voice and other programs are clients: they take the lease, ask, answer, and listen. Missions, signals
and verbs know only this. Every method may be called from any thread; a signal handler calls on a thread of its own.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

from drivers.ports import Approval, Question, Reply, StopRequest
from logs.trial.journal import Entry
from robot_app.mission.command_replies import is_stop
from robot_app.mission.lease import Lease, Leases, Refused
from robot_app.mission.notices import Change, Listener, Notices
from robot_app.mission.open_question import OpenQuestion
from robot_app.mission.sentences import Sentence, Sentences

T = TypeVar("T")
AGENT = "agent"  # how a program asks
FACES = ("terminal", "console")  # where a person answers what an agent asked for


class SharedOperator:
    """The Operator port, and what its clients call.

    approve_all: why nobody needs to be asked before motion, "" where somebody must be. now_s, epoch_ns: clocks.
    """

    def __init__(
        self,
        *,
        approve_all: str = "",
        now_s: Callable[[], float] = time.monotonic,
        epoch_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        self._approve_all, self._now_s, self._epoch_ns = approve_all, now_s, epoch_ns
        self._changed = threading.Condition(threading.RLock())
        self._notices = Notices()
        self._leases, self._sentences = Leases(now_s), Sentences()
        self._present: frozenset[str] = frozenset()
        self._question: OpenQuestion | None = None
        self._questions = 0
        self._stop: StopRequest | None = None
        self._stopped_at = 0  # the place of the last STOP among all that was said
        self._mission: Sentence | None = None
        self._idle = False  # waiting for a sentence

    # ---- what everybody may see

    @property
    def lease(self) -> Lease | None:
        return self._leases.current

    @property
    def question(self) -> OpenQuestion | None:
        return self._question

    @property
    def waiting(self) -> tuple[Sentence, ...]:
        return self._sentences.waiting

    @property
    def mission(self) -> Sentence | None:
        """What the robot is about, None between missions."""
        return self._mission

    @property
    def present(self) -> frozenset[str]:
        """The clients by which somebody can answer."""
        return self._present

    def at_once(self, look: Callable[[], T]) -> T:
        """What `look` reads of this operator, all of one moment: nothing changes meanwhile. It must not wait."""
        with self._changed:
            return look()

    def left_s(self) -> float:
        """Seconds left to answer the open question; 0 where there is none."""
        question = self._question
        return question.left_s(self._now_s()) if question else 0.0

    def listen(self, listener: Listener) -> Callable[[], None]:
        """Be told of every change, on its own thread; returns what ends it. Listeners neither wait nor raise."""
        return self._notices.listen(listener)

    # ---- clients: who is there, and who commands

    def join(self, how: str) -> None:
        """A client by which somebody can answer."""
        with self._changed:
            self._present |= {how}

    def leave(self, how: str) -> None:
        """That client is gone; where it was the last one nobody is waited for any more."""
        with self._changed:
            self._present -= {how}
            self._changed.notify_all()

    def take(self, who: str, how: str, *, over: bool = False, beats: bool = False) -> Lease:
        """The lease; raises Refused where somebody has it, unless `over`, which voids the question and the queue."""
        with self._changed:
            before = self._leases.current
            lease = self._leases.take(who, how, over=over, beats=beats)
            dropped = self._sentences.drop() if before is not None else ()
            if before is not None:
                self._void()
            self._changed.notify_all()
        since = f" It was {before.holder}." if before else ""
        self._notices.tell(Change.LEASE, f"{lease.holder} commands the robot now.{since}{_not_asked(dropped)}")
        return lease

    def release(self, lease: Lease) -> None:
        """Give the lease back; raises Refused while a mission runs: somebody must be in charge of it."""
        with self._changed:
            self._leases.require(lease)
            if self._mission is not None:
                raise Refused("A mission is under way: stop it first, or let somebody take over.")
            self._leases.release(lease)
        self._notices.tell(Change.LEASE, "Nobody commands the robot now.")

    def beat(self, lease: Lease, *, age_s: float = 0.0) -> None:
        """A sign of life of the client that commands, given so long ago; raises Refused where it does not command."""
        with self._changed:
            self._leases.beat(lease, age_s=age_s)

    def silent_s(self) -> float:
        """Seconds since the last sign of life of the client that commands; 0 where none is expected."""
        return self._leases.silent_s()

    def silence(self) -> str | None:
        """Why a moving robot must be held: whoever commands it is not heard. None where all is well."""
        return self._leases.silence()

    # ---- clients: commands

    def ask(self, lease: Lease | None, text: str, notes: tuple[Entry, ...] = ()) -> Sentence:
        """Ask for a thing; its mission comes when those before it have ended. Raises Refused.

        notes: for its trial. A stop in any words is one, whoever has the command.
        """
        if is_stop(text):
            who, how = (lease.who, lease.how) if lease else ("", "")
            self.stop(because=f"the operator said {text.strip()!r}", who=who, how=how)
            raise Refused("That is a stop, not a thing to look for: the robot was told to stop.")
        with self._changed:
            held = self._leases.require(lease)
            sentence = self._sentences.put(text, held.who, held.how, notes)
            self._changed.notify_all()
        self._notices.tell(Change.QUEUE)
        return sentence

    def propose(self, text: str, *, agent: str) -> Sentence:
        """A program asks for a thing; the person who commands says yes or no. Raises Refused: nobody does, too much."""
        with self._changed:
            if self._leases.current is None:
                raise Refused("Nobody commands the robot: a person must be there to say yes.")
            sentence = self._sentences.put(text, agent, AGENT)
            self._changed.notify_all()
        self._notices.tell(Change.TOLD, f"The agent {agent} asks for: {text}")
        return sentence

    def answer(
        self,
        lease: Lease | None,
        question_id: int,
        word: Approval,
        *,
        memory_hash: str,
        number: int | None = None,
    ) -> Reply:
        """Answer the open question; what was taken. Raises Refused, and then nothing was."""
        with self._changed:
            held, asked = self._leases.require(lease), self._question
            if asked is None:
                raise Refused("Nothing is being asked now.")
            asked.require(question_id, memory_hash, self._now_s())
            if self._agent and held.how not in FACES:
                raise Refused("An agent asked for this: the answer must come from the console or the terminal.")
            object_id = asked.chosen(word, number)
            reply = asked.reply = Reply(word, object_id, held.who, held.how, self._epoch_ns())
            self._changed.notify_all()
        self._notices.tell(Change.ANSWERED, f"{held.holder}: {word}.")
        return reply

    def stop(self, *, because: str, who: str = "", how: str = "") -> None:
        """STOP, by anybody and at any time. It stays until the next sentence, and what waits is dropped."""
        with self._changed:
            self._stopped_at = self._sentences.next_order()
            self._stop = self._stop or StopRequest(because, who, how, self._epoch_ns())
            dropped = self._sentences.drop()
            self._changed.notify_all()
        self._notices.tell(Change.STOPPED, f"STOP: {because}.{_not_asked(dropped)}")

    def interrupt(self, *, because: str, how: str = "") -> None:
        """Ctrl-C or a kill: ends the program where it waits for a sentence, and else is a STOP."""
        with self._changed:
            if self._idle:
                self._sentences.ended = True
                self._changed.notify_all()
                return
        self.stop(because=because, how=how)

    def end(self) -> None:
        """No further sentences: the program ends after those that wait."""
        with self._changed:
            self._sentences.ended = True
            self._changed.notify_all()

    # ---- the program that runs missions

    def next_sentence(self) -> Sentence | None:
        """Wait for the next sentence; None once there will be none."""
        with self._changed:
            self._idle = True
            try:
                while not self._sentences.waiting:
                    if self._sentences.ended or not self._present:
                        return None
                    self._changed.wait()
                return self._sentences.take()
            finally:
                self._idle = False

    def begin(self, sentence: Sentence) -> None:
        """Its mission begins: a STOP from before the sentence no longer counts (it never restarts motion either)."""
        with self._changed:
            if sentence.order > self._stopped_at:
                self._stop = None
            self._mission = sentence
        self._notices.tell(Change.MISSION)

    def ended(self) -> None:
        """The mission is over."""
        with self._changed:
            self._mission = None
        self._notices.tell(Change.MISSION)

    # ---- the Operator port

    def tell(self, sentence: str) -> None:
        self._notices.tell(Change.TOLD, sentence)

    def stop_requested(self) -> StopRequest | None:
        return self._stop

    def await_stop(self, seconds: float) -> bool:
        """Wait so long for a STOP; whether there is one."""
        end_s = time.monotonic() + seconds
        with self._changed:
            while self._stop is None and (left_s := end_s - time.monotonic()) > 0.0:
                self._changed.wait(left_s)
            return self._stop is not None

    def confirm(self, question: Question, timeout_s: float) -> Reply:
        """The answer to this question alone; a takeover puts it anew, to the new operator."""
        if self._agent:
            named = f"The agent {self._agent} asks, not a person. {question.sentence}"
            question = replace(question, sentence=named)
        elif self._approve_all and not question.doubt:
            self.tell(f"{question.sentence} yes ({self._approve_all})")
            return Reply(Approval.YES, how=self._approve_all, at_ns=self._epoch_ns())
        while True:
            asked = self._open(question, timeout_s)
            self._notices.tell(Change.ASKED, question.sentence)
            reply = self._await(asked)
            if reply is not None:
                return reply

    def _open(self, question: Question, timeout_s: float) -> OpenQuestion:
        with self._changed:
            self._questions += 1
            asked = OpenQuestion(self._questions, question, timeout_s, self._now_s() + timeout_s)
            self._question = asked
            return asked

    def _await(self, asked: OpenQuestion) -> Reply | None:
        """None where it was voided."""
        with self._changed:
            try:
                while not asked.void:
                    if self._stop is not None:
                        return Reply(Approval.STOP, None, self._stop.who, self._stop.how, self._stop.at_ns)
                    if asked.reply is not None:
                        return asked.reply
                    left_s = asked.left_s(self._now_s())
                    if left_s <= 0.0 or not self._present:
                        break
                    self._changed.wait(left_s)
            finally:
                self._question = None
        if asked.void:
            return None
        late = "Nobody answered in time." if self._present else "Nobody can answer: the input has ended."
        self._notices.tell(Change.EXPIRED, late)
        return Reply(Approval.EXPIRED)

    @property
    def _agent(self) -> str:
        """The agent that asked for the mission under way, "" where a person did."""
        return self._mission.who if self._mission is not None and self._mission.how == AGENT else ""

    def _void(self) -> None:
        if self._question is not None:
            self._question.void = True


def _not_asked(dropped: tuple[Sentence, ...]) -> str:
    return "".join(f" Not asked any more: {sentence.text!r}." for sentence in dropped)
