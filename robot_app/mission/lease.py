"""Who commands: one lease at a time, each with an epoch. A takeover ends the one before it, and everybody sees it."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field

SILENT_S = 0.7  # without a sign of life from the client that commands, a moving robot is held


class Refused(Exception):
    """A command that was not carried out, and nothing of it; the text is one sentence for who gave it."""


@dataclass(frozen=True, slots=True)
class Lease:
    """The right to ask and to answer. who: a person. how: the client (terminal, console, voice ...). token: a secret.

    beats: a client of which a sign of life is expected while the robot moves (Operator.beat).
    """

    who: str
    how: str
    epoch: int
    beats: bool = False
    token: str = field(default="", repr=False)

    @property
    def holder(self) -> str:
        return f"{self.who} ({self.how})" if self.who else self.how


class Leases:
    """Gives out one lease at a time, and knows when its holder was last heard. The caller keeps threads apart.

    now_s: the clock of signs of life.
    """

    def __init__(self, now_s: Callable[[], float]) -> None:
        self.current: Lease | None = None
        self._epoch, self._now_s, self._beat_s = 0, now_s, now_s()

    def take(self, who: str, how: str, *, over: bool, beats: bool) -> Lease:
        """A new lease; raises Refused where somebody else has it, unless it is taken over from them."""
        held = self.current
        if held is not None and not over:
            raise Refused(f"{held.holder} commands the robot: take over first.")
        self._epoch += 1
        self.current = Lease(who, how, self._epoch, beats, secrets.token_urlsafe(16))
        self._beat_s = self._now_s()
        return self.current

    def require(self, lease: Lease | None) -> Lease:
        """The lease where it is the valid one; raises Refused with who has it instead."""
        held = self.current
        if held is None:
            raise Refused("Nobody commands the robot: take the command first.")
        if lease is None or not secrets.compare_digest(lease.token, held.token) or lease.epoch != held.epoch:
            raise Refused(f"{held.holder} commands the robot now: take over first.")
        return held

    def beat(self, lease: Lease, *, age_s: float = 0.0) -> None:
        """A sign of life of its holder, given so long ago; raises Refused where it is not the valid one."""
        self.require(lease)
        self._beat_s = max(self._beat_s, self._now_s() - age_s)

    def silent_s(self) -> float:
        """Seconds since the last sign of life of the holder; 0 where none is expected."""
        held = self.current
        return self._now_s() - self._beat_s if held is not None and held.beats else 0.0

    def silence(self) -> str | None:
        """Why a moving robot must be held: whoever commands it is not heard. None where all is well."""
        held, silent_s = self.current, self.silent_s()
        if held is None or silent_s <= SILENT_S:
            return None
        return f"The page of {held.holder} has not been on a screen for {silent_s:.1f} s."

    def release(self, lease: Lease) -> None:
        self.require(lease)
        self.current = None
