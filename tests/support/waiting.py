"""Waiting for what real threads, processes and sockets bring about: generously, for the machine may be busy."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable

PATIENCE_S = 60.0  # a bound on hanging, not a promise: how fast something is stands in `openbelief bench`
STEP_S = 0.01


def until(condition: Callable[[], object], what: str = "", *, again: Callable[[], object] = lambda: None) -> None:
    """Return as soon as the condition holds. `again` is done before every further look, e.g. to send once more."""
    end_s = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end_s, f"not within {PATIENCE_S:g} s: {what or condition}"
        again()
        threading.Event().wait(STEP_S)
