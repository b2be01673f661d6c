"""How much room a recording may take: warn early, stop while the system still has room to live."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path


class DiskRoom(StrEnum):
    OK = "ok"
    LOW = "low"
    FULL = "full"


@dataclass(frozen=True)
class DiskBudget:
    """Free space below `warn_bytes` is told, below `stop_bytes` recording ends in good order."""

    warn_bytes: int = 10_000_000_000
    stop_bytes: int = 2_000_000_000
    check_every_s: float = 1.0

    def room(self, folder: Path) -> tuple[DiskRoom, str]:
        """The verdict and a sentence for the operator."""
        free = shutil.disk_usage(folder).free
        if free < self.stop_bytes:
            sentence = f"only {free / 1e9:.1f} GB are free, recording stops below {self.stop_bytes / 1e9:.1f} GB"
            return DiskRoom.FULL, sentence
        if free < self.warn_bytes:
            return DiskRoom.LOW, f"{free / 1e9:.1f} GB are free, recording stops below {self.stop_bytes / 1e9:.1f} GB"
        return DiskRoom.OK, f"{free / 1e9:.1f} GB are free"
