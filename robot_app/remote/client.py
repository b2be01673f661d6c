"""A client of a running `openbelief run`: it asks over Zenoh, and raises what was refused."""

from __future__ import annotations

import threading
from types import TracebackType
from typing import Any

from pydantic import ValidationError

from drivers.ports import PortError
from drivers.ros.zenoh_link import ZenohLink
from robot_app.mission.lease import Refused
from robot_app.remote import messages as m

ANSWER_S = 5.0
BEAT_S = 0.2
NOBODY = (
    'Nobody takes commands there: start openbelief run with [remote] serve = "here" (or "robot") in its robot.toml, '
    "and use a certificate that may ask."
)


class RemoteClient:
    """One link, no lease: what anybody may ask."""

    def __init__(self, link: ZenohLink, namespace: str = "") -> None:
        self._link, self._namespace = link, namespace

    def send(self, request: m.RemoteMessage) -> dict[str, Any]:
        """The reply; raises Refused with the other end's sentence, PortError where nobody answers."""
        key = m.operator_key(request.verb, self._namespace)
        replies = self._link.get(key, request.model_dump_json().encode(), ANSWER_S)
        if not replies.payloads:
            raise PortError(NOBODY)
        try:
            reply = m.RemoteReply.model_validate_json(replies.payloads[0])
        except ValidationError as error:
            raise PortError(f"What answers {key} is no openbelief of this version.") from error
        if not reply.ok:
            raise Refused(reply.refused)
        return dict(reply.model_extra or {})

    def status(self, since: int = 0) -> dict[str, Any]:
        return self.send(m.StatusRequest(since=since))

    def stop(self, who: str, *, agent: bool = False) -> None:
        self.send(m.RemoteStopRequest(who=who, agent=agent))


class RemoteOperator(RemoteClient):
    """Holds the lease while it is open, and gives signs of life. Raises Refused where somebody else commands."""

    def __init__(self, link: ZenohLink, who: str, namespace: str = "", *, over: bool = False) -> None:
        super().__init__(link, namespace)
        self._who, self._over = who, over
        self._lease: dict[str, Any] = {}
        self._closing = threading.Event()
        self._beating = threading.Thread(target=self._beat, name="remote beat", daemon=True)

    def __enter__(self) -> RemoteOperator:
        self._lease = self.send(m.LeaseRequest(who=self._who, over=self._over))
        self._beating.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        self._beating.join()
        try:
            self.send(m.ReleaseRequest(**self._lease))
        except (Refused, PortError):
            pass  # somebody has taken over, a mission goes on without us, or the link is gone: it falls silent

    def ask(self, sentence: str) -> int:
        """The order of the sentence, by which `status` names its mission and outcome."""
        return int(self.send(m.AskRequest(sentence=sentence, **self._lease))["order"])

    def answer(self, question: dict[str, Any], word: str, number: int | None = None) -> None:
        """Answer that question of `status`."""
        request = {"question": question["id"], "memory_hash": question["memory_hash"], "word": word, "number": number}
        self.send(m.ConfirmRequest.model_validate(request | self._lease))

    def _beat(self) -> None:
        while not self._closing.wait(BEAT_S):
            try:
                self.send(m.BeatRequest(**self._lease))
            except (Refused, PortError):
                continue  # the next one may come through; who else commands, the next command says
