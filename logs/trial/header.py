"""What a trial's file says about itself, and how it refuses to be read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

FORMAT = "openbelief.trial/1"
MEMORY_NAME, SETTINGS_NAME, CONFIGURATION_NAME = "memory.belief", "mission.json", "robot.toml"  # of attachments


class TrialError(ValueError):
    """The file is no whole trial; the text is one line with the cause and the remedy."""


class NoTrial(TrialError):
    """The file is a whole recording of something else, a walk perhaps."""


@dataclass(frozen=True, kw_only=True)
class TrialHeader:
    """Which mission, over which memory. settings: its parameters and policy, JSON values.

    memory_hash: of the memory's content. state_hash: of its content and rooms; None in a trial that is older than it.
    """

    trial_id: str
    query_id: str
    memory_hash: str
    state_hash: str | None = None
    text_encoder_id: str
    settings: Mapping[str, Any]

    def as_metadata(self) -> dict[str, str]:
        """Everything but the settings, which are an attachment."""
        return {
            "format": FORMAT,
            "trial_id": self.trial_id,
            "query_id": self.query_id,
            "memory_hash": self.memory_hash,
            **({"state_hash": self.state_hash} if self.state_hash else {}),
            "text_encoder_id": self.text_encoder_id,
        }

    @classmethod
    def from_metadata(cls, identity: Mapping[str, str], settings: Mapping[str, Any]) -> TrialHeader:
        return cls(
            trial_id=identity["trial_id"],
            query_id=identity["query_id"],
            memory_hash=identity["memory_hash"],
            state_hash=identity.get("state_hash"),
            text_encoder_id=identity["text_encoder_id"],
            settings=settings,
        )
