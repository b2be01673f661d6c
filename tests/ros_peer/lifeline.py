"""What a peer process owes the test that started it: to say when it is ready, and to end when the test is gone."""

from __future__ import annotations

import os
import sys
import threading


def ready() -> None:
    """Tell the test, and watch it from now on: its end of our standard input closes however it ends."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    sys.stdout.write("ready\n")
    sys.stdout.flush()


def _end_with_parent() -> None:
    sys.stdin.buffer.read()
    os._exit(0)
