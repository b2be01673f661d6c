"""The evidence card of an object: what it was called, how often it was seen, its best crop, and who came next."""

from __future__ import annotations

from typing import Any

from openbelief.belief import phrase_support
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.observation import Observation

PHRASES_SHOWN = 6


def evidence_json(memory: ObjectMemory, object_id: int) -> dict[str, Any]:
    node = memory.objects[object_id]
    support = phrase_support(node.observations, memory.parameters)
    named = sorted(support.items(), key=lambda item: (-item[1], item[0]))
    return {
        "object_id": node.id,
        "label": node.label,
        "room": node.room,
        "trust": node.trust,
        "seen": len(node.observations),
        "frames": node.frames,
        "phrases": [{"phrase": phrase, "support": round(value, 2)} for phrase, value in named[:PHRASES_SHOWN]],
        "more_phrases": max(0, len(named) - PHRASES_SHOWN),
        "belief": [{"label": c.label, "belief": round(c.belief, 3)} for c in node.concepts[:PHRASES_SHOWN]],
        "crop": best_crop(node) is not None,
    }


def best_crop(node: ObjectNode) -> bytes | None:
    """The JPEG of the observation with the most points, None where no crop was kept."""
    kept = [o for o in node.observations if o.provenance is not None and o.provenance.crop_jpeg]
    best: Observation | None = max(kept, key=lambda o: o.n * o.confidence, default=None)
    return best.provenance.crop_jpeg if best is not None and best.provenance is not None else None
