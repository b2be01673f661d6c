"""What a recovery kept, what it lost, and what nobody can prove."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

MAX_LOSSES = 100  # told one by one; more are only counted


@dataclass
class RecoveryReport:
    """What was kept and what was lost. `messages_lost` is None where the file no longer says how many it had."""

    source: str
    output: str
    messages: int = 0
    unverified_messages: int = 0  # from a writer that leaves checksums out: kept, but nobody can prove them
    unverified_records: int = 0  # attachments and metadata, likewise
    unknown_records: int = 0  # of kinds that this version does not know: left out
    chunks_seen: int = 0
    chunks: int = 0
    attachments: int = 0
    metadata: int = 0
    messages_lost: int | None = None
    complete: bool = True  # nothing at all was missing or wrong
    loss_count: int = 0
    losses: list[str] = field(default_factory=list)

    def lost(self, what: str) -> None:
        self.complete = False
        self.loss_count += 1
        if len(self.losses) < MAX_LOSSES:
            self.losses.append(what)

    def as_json(self) -> dict[str, Any]:
        return asdict(self)
