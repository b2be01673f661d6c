"""The watchdog's I/O: subscribes to workstations and Nav2, cancels through the local bridge, publishes its status."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from drivers.repeats import Repeats
from drivers.ros import action
from drivers.ros.action import ActionClient, ActionReply
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.shapes import AUTO, shapes_of
from drivers.ros.zenoh_link import ZenohLink
from drivers.topics import NAVIGATE_TO_POSE
from drivers.watchdog.hands import DdsUnavailable, Hand
from drivers.watchdog.latch import Watchdog, WatchdogAction, WatchdogFacts, WatchdogState
from drivers.watchdog.running_goals import TAKEN, RunningGoals
from drivers.watchdog.wire import (
    STATUS_S,
    HeartbeatMessage,
    ResetReply,
    WatchdogKeys,
    WatchdogStatus,
    WatchdogWireError,
    packed,
    unpacked,
)

logger = logging.getLogger(__name__)
CANCEL_S = 1.0  # for the answer to one cancel; the next is sent before, so a slow Nav2 still acknowledges
WORKSTATIONS_MAX = 16
OLD_NS = 10_000_000_000
Heard = TypeVar("Heard")


class WatchdogGuard:
    """Construct, `start`, then call `step` often (50 times a second). Callbacks come on Zenoh's threads."""

    def __init__(
        self,
        link: ZenohLink,
        keys: BridgeKeys | None = None,
        *,
        distribution: str = AUTO,
        hand: Hand | None = None,
        now_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        keys = keys or BridgeKeys()
        self._hand, self._tokens = hand, (keys.bridge_token("*"), keys.action_token(NAVIGATE_TO_POSE))
        self._bridge_gone: int | None = None
        self._link, self._keys, self._now_ns = link, WatchdogKeys(keys), now_ns
        self._navigate = ActionClient(link, keys, NAVIGATE_TO_POSE, shapes_of(distribution))
        self._watchdog = Watchdog()
        self._beats: dict[str, int] = {}
        self._gone: dict[str, int] = {}
        self._left: set[str] = set()
        self._goals, self._servers = RunningGoals(), set[str]()
        self._acknowledged = False
        self._trip = self._refusals = 0
        self._told: tuple[WatchdogState, bool, tuple[str, ...]] | None = None
        self._repeats = Repeats()
        self._sequence, self._told_ns = 0, 0
        self._lock = threading.RLock()

    def start(self) -> None:
        """Begin to hear; all of it ends with the link."""
        self._link.subscribe(self._keys.heartbeat, self._hear_beat)
        self._link.watch_tokens(self._keys.token(), self._hear_token)
        for token, hear in zip(self._tokens, (self._hear_bridge, self._hear_server), strict=True):
            self._link.watch_tokens(token, hear)
        self._link.answer(self._keys.reset, self._reset)
        self._navigate.listen(lambda _: None, self._goals.hear)

    @property
    def status(self) -> WatchdogStatus:
        with self._lock:
            watchdog = self._watchdog
            return WatchdogStatus(
                state=watchdog.state,
                watched=watchdog.watched,
                full=len(self._beats) >= WORKSTATIONS_MAX,
                hand=self._hand.name if self._hand else "",
                hand_servers=self._hand.servers if self._hand else 0,
                reason=watchdog.reason,
                acknowledged=self._acknowledged,
                sequence=self._sequence,
            )

    def step(self) -> None:
        """Judge, act, tell. Raises PortError where a handler failed, LinkLost where our own session is closed."""
        self._hear_hand()
        with self._lock:
            was_latched = self._watchdog.latched
            wanted = self._watchdog.update(self._now_ns(), self._facts())
            if self._watchdog.latched and not was_latched:
                self._acknowledged, self._refusals, self._trip = False, 0, self._trip + 1
                logger.error("WATCHDOG: %s; cancelling every navigation goal", self._watchdog.reason)
        if wanted is WatchdogAction.CANCEL:
            self._with_hand(lambda hand: hand.cancel_all(self._trip))
            self._navigate.cancel_later(action.ALL_GOALS, CANCEL_S, partial(self._hear_answer, self._trip))
        self._tell()
        self._link.check()  # last, so that a handler that failed does not keep us from cancelling

    def _facts(self, *, reset: bool = False) -> WatchdogFacts:
        return WatchdogFacts(
            beats=dict(self._beats),
            gone=dict(self._gone),
            left=frozenset(self._left),
            acknowledged=self._acknowledged,
            driving=self._is_driving,
            reset=reset,
            bridge_gone=self._bridge_gone,
        )

    @property
    def _is_driving(self) -> bool:
        """Nav2's own word where the hand hears it: what came over a bridge that died says nothing any more."""
        return self._hand.driving if self._hand is not None and self._hand.servers else bool(self._goals)

    def _tell(self) -> None:
        now_ns, status = self._now_ns(), self.status
        now = (status.state, status.acknowledged, status.watched)
        news = now != self._told
        if news or now_ns - self._told_ns >= round(STATUS_S * 1e9):
            if news:
                why = f": {status.reason}" if status.reason else ""
                logger.info("watchdog %s%s, watching %d workstation(s)", status.state, why, len(status.watched))
            self._told, self._told_ns, self._sequence = now, now_ns, self._sequence + 1
            self._link.put(self._keys.status, packed(status), drop=True)

    # Hearing (on Zenoh's threads)

    def _hear_beat(self, payload: bytes) -> None:
        try:
            beat = unpacked(HeartbeatMessage, payload)
        except WatchdogWireError as error:
            if count := self._repeats.due():
                logger.warning("a heartbeat was ignored (%d so far): %s", count, error)
            return
        with self._lock:
            if beat.workstation not in self._beats and not self._room():
                if count := self._repeats.due(beat.workstation):
                    who = beat.workstation[:8]
                    logger.warning("workstation %s is not watched: too many (%d heartbeats so far)", who, count)
                return
            (self._left.add if beat.state == "goodbye" else self._left.discard)(beat.workstation)
            self._beats[beat.workstation] = self._now_ns()

    def _room(self) -> bool:
        """Whether one more workstation can be watched. Unless latched, those long silent make room for it."""
        if not self._watchdog.latched:
            old_ns = self._now_ns() - OLD_NS
            for name in [name for name, beat_ns in self._beats.items() if beat_ns < old_ns]:
                del self._beats[name]
                self._left.discard(name)
                self._gone.pop(name, None)
        return len(self._beats) < WORKSTATIONS_MAX

    def _hear_token(self, key: str, there: bool) -> None:
        workstation = key.rsplit("/", 1)[-1]
        with self._lock:
            if there:
                self._gone.pop(workstation, None)
            elif workstation in self._beats:
                self._gone[workstation] = self._now_ns()

    def _hear_bridge(self, _key: str, there: bool) -> None:
        if not there:
            with self._lock:
                self._bridge_gone = self._now_ns()

    def _hear_server(self, token: str, there: bool) -> None:
        (self._servers.add if there else self._servers.discard)(token)
        if not self._servers:
            self._goals.forget()

    def _hear_hand(self) -> None:
        for found in self._with_hand(lambda hand: hand.hear()) or ():
            self._judge_code(found.trip, found.code, f"Nav2 answered {found.code} on DDS")

    def _with_hand(self, use: Callable[[Hand], Heard]) -> Heard | None:
        """A hand that is broken does not keep the other one from cancelling."""
        if self._hand is None:
            return None
        try:
            return use(self._hand)
        except DdsUnavailable as error:
            if count := self._repeats.due("hand"):
                logger.error("WATCHDOG: without the bridge nobody can cancel (%d times so far): %s", count, error)
            return None

    def _hear_answer(self, trip: int, answer: ActionReply) -> None:
        """An answer to the cancel of an earlier trip says nothing about this one."""
        code = None
        if answer.every and None not in answer.every:
            code = self._goals.code([reply for reply in answer.every if reply is not None])
        self._judge_code(trip, code, answer.why or f"Nav2 answered {code}")

    def _judge_code(self, trip: int, code: int | None, why: str) -> None:
        with self._lock:
            if trip != self._trip:
                return
            if code in TAKEN:
                self._acknowledged = True
                return
            self._refusals += 1
            refusals = self._refusals
        if refusals & (refusals - 1) == 0:  # 1, 2, 4, 8 ...: five a second would bury the rest of the log
            logger.error("WATCHDOG: the cancel was not taken (%d times so far): %s", refusals, why)

    def _reset(self, _payload: bytes) -> bytes:
        """A person asks: refused while Nav2 has not acknowledged the cancel. Nothing moves by it."""
        with self._lock:
            if not self._watchdog.latched:
                return packed(ResetReply(ok=True, reason="it was not latched"))
            if not self._acknowledged or self._is_driving:
                return packed(ResetReply(ok=False, reason="Nav2 has not stopped every goal: use the remote"))
            self._watchdog.update(self._now_ns(), self._facts(reset=True))
        logger.warning("the watchdog was reset by a person")
        return packed(ResetReply(ok=True))
