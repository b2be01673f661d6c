"""Memory that a finished test module leaves behind, given back to the system."""

from __future__ import annotations

import ctypes
import gc
import resource
from pathlib import Path

GROWN_BYTES = 100 << 20
STATM = Path("/proc/self/statm")  # Linux


class ResidentMemory:
    """Collects and trims where the process has grown since the last time.

    Else glibc keeps what is freed, gigabytes in a whole run, and cycles wait for a collection that comes late.
    """

    def __init__(self) -> None:
        self._before = self._resident()

    def give_back(self) -> None:
        if self._resident() - self._before < GROWN_BYTES:
            return
        gc.collect()
        if hasattr(trim := ctypes.CDLL(None), "malloc_trim"):
            trim.malloc_trim(0)
        self._before = self._resident()

    def _resident(self) -> int:
        """Bytes; 0 where the system does not tell."""
        return int(STATM.read_text().split()[1]) * resource.getpagesize() if STATM.exists() else 0
