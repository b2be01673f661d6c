"""Repeated log events are counted and logged at the 1st, 2nd, 4th, 8th ... time, so that they bury nothing."""

from __future__ import annotations

import threading
from collections import Counter

KINDS_MAX = 64  # kinds that are counted apart; all further ones share one count


class Repeats:
    """Counts by kind. Thread-safe."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def due(self, kind: str = "") -> int | None:
        """The count of that kind with this time, where it is to be told; None where it is not."""
        with self._lock:
            if kind not in self._counts and len(self._counts) >= KINDS_MAX:
                kind = "others"
            self._counts[kind] += 1
            count = self._counts[kind]
        return count if count & (count - 1) == 0 else None
