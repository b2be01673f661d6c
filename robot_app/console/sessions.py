"""Who is logged in: sessions by an opaque cookie, one-time pairing tokens, and how often somebody may try."""

from __future__ import annotations

import secrets
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from robot_app.console.accounts import Role

SESSION_S = 12 * 3600.0
PAIRING_S = 600.0
SESSIONS_MAX, PAIRINGS_MAX = 64, 8


@dataclass(frozen=True)
class Session:
    """token: what the cookie holds."""

    token: str
    name: str
    role: Role
    expires_s: float


class Sessions:
    """In memory: a restart of the program logs everybody out. Thread-safe."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s, self._lock = now_s, threading.Lock()
        self._sessions: OrderedDict[str, Session] = OrderedDict()
        self._pairings: OrderedDict[str, tuple[str, Role, float]] = OrderedDict()

    def open(self, name: str, role: Role) -> Session:
        with self._lock:
            session = Session(secrets.token_urlsafe(32), name, role, self._now_s() + SESSION_S)
            self._sessions[session.token] = session
            while len(self._sessions) > SESSIONS_MAX:
                self._sessions.popitem(last=False)
            return session

    def find(self, token: str | None) -> Session | None:
        with self._lock:
            session = self._sessions.get(token or "")
            if session is None or session.expires_s <= self._now_s():
                return None
            return session

    def close(self, token: str) -> None:
        with self._lock:
            self._sessions.pop(token, None)

    def pairing(self, name: str, role: Role) -> str:
        """A token that logs one page in, once, within PAIRING_S."""
        with self._lock:
            token = secrets.token_urlsafe(24)
            self._pairings[token] = (name, role, self._now_s() + PAIRING_S)
            while len(self._pairings) > PAIRINGS_MAX:
                self._pairings.popitem(last=False)
            return token

    def pair(self, token: str) -> Session | None:
        with self._lock:
            found = self._pairings.pop(token, None)
        if found is None or found[2] <= self._now_s():
            return None
        return self.open(found[0], found[1])


class TokenBucket:
    """At most `burst` at once and `per_s` on average, for each key; old keys are forgotten. Thread-safe."""

    KEYS_MAX = 1024

    def __init__(self, per_s: float, burst: int, now_s: Callable[[], float] = time.monotonic) -> None:
        self._per_s, self._burst, self._now_s = per_s, burst, now_s
        self._lock = threading.Lock()
        self._buckets: OrderedDict[str, tuple[float, float]] = OrderedDict()  # key -> (left, when)

    def allows(self, key: str) -> bool:
        with self._lock:
            now_s = self._now_s()
            left, then_s = self._buckets.pop(key, (float(self._burst), now_s))
            left = min(float(self._burst), left + (now_s - then_s) * self._per_s)
            self._buckets[key] = (left - 1.0 if left >= 1.0 else left, now_s)
            while len(self._buckets) > self.KEYS_MAX:
                self._buckets.popitem(last=False)
            return left >= 1.0
