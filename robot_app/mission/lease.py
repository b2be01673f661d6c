"""Who commands: one lease at a time, each with an epoch. A takeover ends the one before it, and everybody sees it."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, field


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
    """Gives out one lease at a time. The caller keeps threads apart."""

    def __init__(self) -> None:
        self.current: Lease | None = None
        self._epoch = 0

    def take(self, who: str, how: str, *, over: bool, beats: bool) -> Lease:
        """A new lease; raises Refused where somebody else has it, unless it is taken over from them."""
        held = self.current
        if held is not None and not over:
            raise Refused(f"{held.holder} commands the robot: take over first.")
        self._epoch += 1
        self.current = Lease(who, how, self._epoch, beats, secrets.token_urlsafe(16))
        return self.current

    def require(self, lease: Lease | None) -> Lease:
        """The lease where it is the valid one; raises Refused with who has it instead."""
        held = self.current
        if held is None:
            raise Refused("Nobody commands the robot: take the command first.")
        if lease is None or not secrets.compare_digest(lease.token, held.token) or lease.epoch != held.epoch:
            raise Refused(f"{held.holder} commands the robot now: take over first.")
        return held

    def release(self, lease: Lease) -> None:
        self.require(lease)
        self.current = None
