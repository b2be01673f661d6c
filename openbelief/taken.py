"""What mapping took from the frames, and what it did not, by reason."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Taken:
    """`refused` masks gave no observation, `unseen` frames no masks; both by reason."""

    frames: int = 0
    masks: int = 0
    observations: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    unseen: Counter[str] = field(default_factory=Counter)

    def and_a_frame(self, observations: int, refused: Iterable[str], unseen: str | None) -> Taken:
        """The counts with one more frame."""
        reasons = Counter(refused)
        return Taken(
            frames=self.frames + 1,
            masks=self.masks + observations + reasons.total(),
            observations=self.observations + observations,
            refused=self.refused + reasons,
            unseen=self.unseen + Counter([] if unseen is None else [unseen]),
        )

    def as_json(self) -> dict[str, Any]:
        return {**vars(self), "refused": dict(self.refused), "unseen": dict(self.unseen)}

    @classmethod
    def of_json(cls, counts: Mapping[str, Any]) -> Taken:
        numbers = (counts.get(name, 0) for name in ("frames", "masks", "observations"))
        return cls(*numbers, *(Counter(counts.get(name, {})) for name in ("refused", "unseen")))
