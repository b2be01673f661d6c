"""The deadman of the robot: when a workstation falls silent or its token goes, every navigation goal is cancelled.

Zenoh has none: a robot under way drives on when its workstation dies. The logic is here, pure;
robot_app/onboard/process.py feeds it. `now_ns` is monotonic time, so a step of the system clock changes nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

SILENCE_S = 0.7  # of a 10 Hz heartbeat: six beats may be lost, and 1 s is kept with 0.3 s for the cancel's way
BRIDGE_GONE = "the bridge between robot and workstation ended or was restarted: nobody could have stopped a goal"
RETRY_S = 0.2  # between two cancels while none was acknowledged, or while a goal runs though latched


class WatchdogState(StrEnum):
    """WAITING: no workstation. ARMED: at least one beats. LATCHED: tripped, until a person resets it."""

    WAITING = "waiting"
    ARMED = "armed"
    LATCHED = "latched"


class WatchdogAction(StrEnum):
    NONE = "none"
    CANCEL = "cancel all goals"


@dataclass(frozen=True, slots=True)
class WatchdogFacts:
    """What was heard until now. beats: workstation -> when its newest heartbeat came. gone: workstation -> when its
    liveliness token went away. left: those that said goodbye. acknowledged: Nav2 took a cancel-all sent since the
    watchdog tripped. driving: Nav2's status names a goal that runs. reset: a person asks for it. bridge_gone: when a
    bridge's liveliness token last went away, None where none did.
    """

    beats: Mapping[str, int]
    gone: Mapping[str, int] = field(default_factory=dict)
    left: frozenset[str] = frozenset()
    acknowledged: bool = False
    driving: bool = False
    reset: bool = False
    bridge_gone: int | None = None


class Watchdog:
    """`update` says what to do now. Every workstation that beats is watched; one that says goodbye is not any more."""

    def __init__(self, silence_s: float = SILENCE_S) -> None:
        self._silence_ns = round(silence_s * 1e9)
        self._forgotten: dict[str, int] = {}  # workstation -> its newest beat when it was reset or left
        self._cancelled_ns: int | None = None
        self._bridge_gone: int | None = None  # the loss that was judged already
        self.state = WatchdogState.WAITING
        self.watched: tuple[str, ...] = ()  # whose silence is acted on
        self.reason = ""

    @property
    def latched(self) -> bool:
        return self.state is WatchdogState.LATCHED

    def update(self, now_ns: int, facts: WatchdogFacts) -> WatchdogAction:
        """CANCEL at the trip, every RETRY_S until it is acknowledged, and wherever a goal runs though latched."""
        watched = self._watched(facts)
        self.watched = tuple(sorted(watched))
        bridge_gone, self._bridge_gone = facts.bridge_gone != self._bridge_gone, facts.bridge_gone
        if self.latched:
            return self._latched(now_ns, facts)
        self.state = WatchdogState.ARMED if watched else WatchdogState.WAITING
        if watched and bridge_gone:
            return self._trip(now_ns, BRIDGE_GONE)
        for workstation in watched:
            if why := self._lost(workstation, now_ns, facts):
                return self._trip(now_ns, why)
        return WatchdogAction.NONE

    def _watched(self, facts: WatchdogFacts) -> dict[str, int]:
        self._forgotten = {name: beat for name, beat in self._forgotten.items() if name in facts.beats}
        self._forgotten |= {name: facts.beats[name] for name in facts.left if name in facts.beats}
        return {name: beat for name, beat in facts.beats.items() if beat > self._forgotten.get(name, -1)}

    def _lost(self, workstation: str, now_ns: int, facts: WatchdogFacts) -> str | None:
        """A beat after the token went shows that the workstation came back; its new token may still be on the way."""
        beat_ns = facts.beats[workstation]
        silent_ns = now_ns - beat_ns
        if facts.gone.get(workstation, -1) > beat_ns:
            return f"workstation {workstation[:8]} is gone (its liveliness token went away)"
        if silent_ns > self._silence_ns:
            return f"workstation {workstation[:8]} was silent for {silent_ns / 1e9:.2f} s"
        return None

    def _trip(self, now_ns: int, why: str) -> WatchdogAction:
        self.state, self.reason, self._cancelled_ns = WatchdogState.LATCHED, why, now_ns
        return WatchdogAction.CANCEL

    def _latched(self, now_ns: int, facts: WatchdogFacts) -> WatchdogAction:
        if facts.reset and facts.acknowledged:
            self._forgotten |= {name: beat for name, beat in facts.beats.items() if self._lost(name, now_ns, facts)}
            self.state, self.reason, self._cancelled_ns = WatchdogState.WAITING, "", None
            return WatchdogAction.NONE
        due = self._cancelled_ns is None or now_ns - self._cancelled_ns >= round(RETRY_S * 1e9)
        if due and (facts.driving or not facts.acknowledged):
            self._cancelled_ns = now_ns
            return WatchdogAction.CANCEL
        return WatchdogAction.NONE
