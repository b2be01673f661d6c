"""The workstation's side of the watchdog: a heartbeat ten times a second, and what the robot says about it."""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable
from types import TracebackType

from drivers.ports import LinkLost, PortError
from drivers.ros.bridge_keys import BridgeKeys
from drivers.ros.zenoh_link import ZenohLink
from drivers.watchdog.latch import WatchdogState
from drivers.watchdog.wire import (
    BEAT_S,
    STATUS_MAX_AGE_S,
    HeartbeatMessage,
    ResetReply,
    WatchdogKeys,
    WatchdogStatus,
    WatchdogWireError,
    packed,
    unpacked,
)

RESET_S = 1.0


class Heartbeat:
    """Beats from `with` to its end, as long as `alive` says so. Ending in good order, or because an input was refused
    (ValueError), says goodbye; ending with another exception does not, and then the watchdog on the robot cancels what
    may still be under way."""

    def __init__(
        self,
        link: ZenohLink,
        keys: BridgeKeys | None = None,
        *,
        workstation: str | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        self._link, self._keys, self._alive = link, WatchdogKeys(keys or BridgeKeys()), alive
        self.workstation = workstation or uuid.uuid4().hex
        self._sequence = 0
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Heartbeat:
        self._link.declare_token(self._keys.token(self.workstation))
        self.resume()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        abandoned = self._stop.is_set()
        self.abandon()
        if not abandoned and (error is None or isinstance(error, ValueError)):
            self._beat("goodbye")

    def abandon(self) -> None:
        """Fall silent on purpose, so that the watchdog on the robot stops it: our own cancel went unanswered."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def resume(self) -> None:
        """Beat, whether or not it was abandoned before; that undoes no latch."""
        if self._thread is None or not self._thread.is_alive():
            self._stop.clear()
            self._thread = threading.Thread(target=self._run, name="heartbeat", daemon=True)
            self._thread.start()

    def _run(self) -> None:
        due_s = time.monotonic()
        while not self._stop.wait(max(due_s - time.monotonic(), 0.0)):
            if self._alive():
                self._beat("alive")
            due_s = max(due_s + BEAT_S, time.monotonic())

    def _beat(self, state: str) -> None:
        """A link that is closed or down carries no beat: that is for the watchdog to notice."""
        beat = HeartbeatMessage(workstation=self.workstation, sequence=self._sequence, state=state)  # type: ignore[arg-type]
        self._sequence += 1
        try:
            self._link.put(self._keys.heartbeat, packed(beat), drop=True)
        except LinkLost:
            self._stop.set()


class WatchdogView:
    """The robot's watchdog as the workstation sees it. workstation: the one that is to be watched; None only looks."""

    def __init__(self, link: ZenohLink, keys: BridgeKeys | None = None, *, workstation: str | None = None) -> None:
        self._link, self._keys, self._workstation = link, WatchdogKeys(keys or BridgeKeys()), workstation
        self._status: WatchdogStatus | None = None
        self._heard_s = 0.0

    def start(self) -> None:
        """Begin to listen; it ends with the link."""
        self._link.subscribe(self._keys.status, self._hear)

    @property
    def status(self) -> WatchdogStatus | None:
        """The newest word, None where there was none within STATUS_MAX_AGE_S of wall time."""
        return self._status if time.monotonic() - self._heard_s <= STATUS_MAX_AGE_S else None

    def trouble(self) -> str | None:
        """Why no goal should be sent, None where the watchdog watches this workstation."""
        status = self.status
        if status is None:
            return "The watchdog on the robot is not heard: start `openbelief onboard` there."
        if status.state is WatchdogState.LATCHED:
            return (
                f"The watchdog has stopped the robot and is latched: {status.reason}. Look at the robot, then reset it "
                "with `openbelief onboard --reset`."
            )
        if status.state is WatchdogState.WAITING or self._workstation not in (None, *status.watched):
            return _not_watched(status)
        if status.hand_servers > 1:
            return (
                f"{status.hand_servers} Nav2 servers answer on the robot, and each would drive it: leave one running."
            )
        return None

    def reset(self) -> ResetReply:
        """A person's decision: the watchdog lets go of its latch. Nothing moves by it. Raises PortError."""
        replies = self._link.get(self._keys.reset, b"", RESET_S)
        if not replies.payloads:
            raise PortError("The watchdog does not answer: is `openbelief onboard` running on the robot?")
        try:
            said = [unpacked(ResetReply, payload) for payload in replies.payloads]
        except WatchdogWireError as error:
            raise PortError(
                f"What answered on the watchdog's key is no watchdog's answer ({error}): it may still be latched. "
                "Are `openbelief onboard` and this program of one version, and does nothing else answer there?"
            ) from error
        return next((reply for reply in said if not reply.ok), said[0])

    def _hear(self, payload: bytes) -> None:
        try:
            self._status, self._heard_s = unpacked(WatchdogStatus, payload), time.monotonic()
        except WatchdogWireError:
            return  # somebody else's bytes on our key count as silence


def _not_watched(status: WatchdogStatus) -> str:
    if status.full:
        return (
            f"The watchdog on the robot watches {len(status.watched)} workstations and takes no more, so it would not "
            "stop the robot for this one: end those that are not needed."
        )
    return (
        "The watchdog on the robot does not hear this workstation's heartbeat: does the router's access list "
        "let this certificate put it?"
    )
