"""A small log whose room is taken in advance, so that a full disk can still be written about."""

from __future__ import annotations

import json
import os
from pathlib import Path

RESERVED_BYTES = 64 * 1024  # some hundred lines


class EventLog:
    """JSON lines in `PATH`, each on the disk before `write` returns; lines beyond the reserve are dropped, counted.

    After a crash the unused reserve remains as zero bytes at the end. A log without an event leaves no file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.dropped = 0
        self._fd: int | None = None
        self._end = 0

    def open(self) -> None:
        """Raises OSError, and leaves no file, where there is no room; FileExistsError rather than overwrite."""
        self._fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        try:
            os.posix_fallocate(self._fd, 0, RESERVED_BYTES)
        except OSError:
            self.close()
            raise

    def write(self, stamp_ns: int, event: str, **details: str | int | float) -> None:
        if self._fd is None:
            raise ValueError(f"{self.path} is not open")
        line = (json.dumps({"stamp_ns": stamp_ns, "event": event, **details}) + "\n").encode()
        if self._end + len(line) > RESERVED_BYTES:
            self.dropped += 1
            return
        self._end += os.pwrite(self._fd, line, self._end)
        os.fsync(self._fd)

    def close(self) -> None:
        if self._fd is None:
            return
        os.ftruncate(self._fd, self._end)
        os.close(self._fd)
        self._fd = None
        if self._end == 0:
            self.path.unlink()
