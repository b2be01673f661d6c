"""The queryables of a running `openbelief run`: each is a client of its Operator, as terminal and console are."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from pydantic import ValidationError

from drivers.ports import Approval
from drivers.ros.zenoh_link import ZenohLink
from logs.structured import neutralise
from logs.trial.journal import Attached
from logs.trial.records import Ended, Record
from openbelief.memory import ObjectMemory
from openbelief.settings import first_complaint
from openbelief.target_phrase import target_phrase
from robot_app.mission.lease import Lease, Refused
from robot_app.mission.notices import Change, Notice
from robot_app.mission.operator import SharedOperator
from robot_app.remote import messages as m

HOW = "zenoh"
SAID_KEPT = 100


class RemoteServer:
    """Answers requests as bytes; also the journal that learns how a mission ended (`run_missions(watching=...)`)."""

    def __init__(self, operator: SharedOperator, memory: ObjectMemory) -> None:
        self._operator, self._memory = operator, memory
        self._said: deque[tuple[int, str]] = deque(maxlen=SAID_KEPT)
        self._count = 0
        self._outcome: dict[str, Any] | None = None
        self._about = 0  # the order of the sentence whose mission runs, or ran last
        self._acts: dict[type[m.RemoteMessage], Callable[[Any], dict[str, Any]]] = {
            m.LeaseRequest: self._lease,
            m.BeatRequest: self._beat,
            m.ReleaseRequest: self._release,
            m.AskRequest: self._ask,
            m.ConfirmRequest: self._confirm,
            m.ProposeRequest: self._propose,
            m.RemoteStopRequest: self._stop,
            m.StatusRequest: self._status,
            m.CandidatesRequest: self._candidates,
            m.WhyRequest: self._why,
        }

    @contextmanager
    def serving(self, link: ZenohLink, namespace: str = "") -> Iterator[RemoteServer]:
        """Answer on that link until the end. Ranking has a thread of its own: a STOP never waits for it."""
        end_listening = self._operator.listen(self._hear)
        with ThreadPoolExecutor(1, thread_name_prefix="remote") as slow:
            for kind in m.REQUESTS:
                elsewhere = slow if kind in (m.CandidatesRequest, m.WhyRequest) else None
                link.answer(m.operator_key(kind.verb, namespace), self._answering(kind), elsewhere=elsewhere)
            try:
                yield self
            finally:
                end_listening()

    def reply(self, kind: type[m.RemoteMessage], payload: bytes) -> dict[str, Any]:
        """What is answered; a refusal says why, and then nothing was done."""
        if len(payload) > m.REQUEST_MAX_BYTES:
            return _refusal(f"That is too large: {m.REQUEST_MAX_BYTES >> 10} KiB is the limit of a request.")
        try:
            return {"ok": True, **self._acts[kind](kind.model_validate_json(payload or b"{}"))}
        except ValidationError as error:
            return _refusal(f"That is no {kind.verb} request: {first_complaint(error, 'the request')}.")
        except (Refused, ValueError) as refused:
            return _refusal(str(refused))

    def write(self, record: Record, attached: Attached = None) -> None:  # noqa: ARG002 - a Journal's
        if isinstance(record, Ended):
            self._outcome = {"order": self._about, **record.model_dump(mode="json")}

    def _answering(self, kind: type[m.RemoteMessage]) -> Callable[[bytes], bytes]:
        return lambda payload: json.dumps(self.reply(kind, payload), allow_nan=False).encode()

    def _hear(self, notice: Notice) -> None:
        if notice.change is Change.MISSION and (mission := self._operator.mission):
            self._about = mission.order
        if notice.sentence:
            self._count += 1
            self._said.append((self._count, notice.sentence))

    # ---- the verbs

    def _lease(self, request: m.LeaseRequest) -> dict[str, Any]:
        lease = self._operator.take(_one_line(request.who), HOW, over=request.over, beats=True)
        self._operator.join(HOW)
        return {"token": lease.token, "epoch": lease.epoch}

    def _beat(self, request: m.BeatRequest) -> dict[str, Any]:
        self._operator.beat(_lease_of(request))
        return {}

    def _release(self, request: m.ReleaseRequest) -> dict[str, Any]:
        self._operator.release(_lease_of(request))
        self._operator.leave(HOW)
        return {}

    def _ask(self, request: m.AskRequest) -> dict[str, Any]:
        target_phrase(request.sentence)
        return {"order": self._operator.ask(_lease_of(request), _one_line(request.sentence)).order}

    def _propose(self, request: m.ProposeRequest) -> dict[str, Any]:
        target_phrase(request.sentence)
        return {"order": self._operator.propose(_one_line(request.sentence), agent=_one_line(request.agent)).order}

    def _confirm(self, request: m.ConfirmRequest) -> dict[str, Any]:
        reply = self._operator.answer(
            _lease_of(request),
            request.question,
            Approval(request.word),
            memory_hash=request.memory_hash,
            number=request.number,
        )
        return {"answered": str(reply.word), "object_id": reply.object_id}

    def _stop(self, request: m.RemoteStopRequest) -> dict[str, Any]:
        who = f"the agent {request.who}" if request.agent else request.who
        self._operator.stop(because=f"{_one_line(who)} said stop over the network", who=_one_line(who), how=HOW)
        return {}

    def _status(self, request: m.StatusRequest) -> dict[str, Any]:
        operator = self._operator
        mission, asked, lease = operator.mission, operator.question, operator.lease
        stop = operator.stop_requested()
        return {
            "mission": None if mission is None else _sentence(mission),
            "waiting": [_sentence(each) for each in operator.waiting],
            "question": None if asked is None else _question(asked, operator.left_s()),
            "commands": None if lease is None else {"who": lease.who, "how": lease.how, "epoch": lease.epoch},
            "stop": stop.because if stop else None,
            "outcome": self._outcome,
            "said": [{"number": n, "sentence": text} for n, text in list(self._said) if n > request.since],
            "memory_hash": self._memory.content_hash,
        }

    def _candidates(self, request: m.CandidatesRequest) -> dict[str, Any]:
        return candidates(self._memory, request.query, request.limit)

    def _why(self, request: m.WhyRequest) -> dict[str, Any]:
        return {"why": why(self._memory, request.object_id)}


def candidates(memory: ObjectMemory, query: str, limit: int) -> dict[str, Any]:
    """The ranking of `openbelief query`, as JSON. Raises ValueError where the query names nothing."""
    from robot_app.verbs.query import describe

    ranked = memory.rank(query, limit=limit)
    nothing = {} if ranked else {"because": memory.nothing_because(query)}
    return {"candidates": [describe(memory, each) for each in ranked], **nothing}


def why(memory: ObjectMemory, object_id: int) -> dict[str, Any]:
    """The evidence of `openbelief why`, as JSON. Raises ValueError where there is no such object."""
    from robot_app.verbs.why import explain

    if not 0 <= object_id < len(memory.objects):
        held = f"0 to {len(memory.objects) - 1}" if memory.objects else "none"
        raise ValueError(f"There is no object {object_id}: the memory holds {held}.")
    return explain(memory, memory.objects[object_id])


def _lease_of(request: m.Leased) -> Lease:
    return Lease("", HOW, request.epoch, token=request.token)


def _one_line(text: str) -> str:
    return neutralise(" ".join(text.split()))


def _sentence(sentence: Any) -> dict[str, Any]:
    return {"order": sentence.order, "text": sentence.text, "who": sentence.who, "how": sentence.how}


def _question(asked: Any, left_s: float) -> dict[str, Any]:
    question = asked.question
    return {
        "id": asked.id,
        "sentence": question.sentence,
        "because": question.because,
        "doubt": question.doubt,
        "memory_hash": question.memory_hash,
        "object_id": question.object_id,
        "path_length_m": question.path_length_m,
        "left_s": round(left_s, 2),
        "options": [
            {"number": o.number, "object_id": o.object_id, "label": o.label, "score": o.score} for o in question.options
        ],
    }


def _refusal(sentence: str) -> dict[str, Any]:
    return {"ok": False, "refused": sentence}
