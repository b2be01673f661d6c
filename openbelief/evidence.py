"""Evidence in canonical order, and the hash that names it: independent of the order of mapping."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.observation import Observation
from openbelief.parameters import Parameters


@dataclass(frozen=True, order=True)
class FrameRecord:
    """A frame that mapping has dealt with; `skipped` is the reason why nothing was taken from it."""

    recording: str
    stamp_ns: int
    skipped: str | None = None


def digest(observation: Observation) -> bytes:
    """32 bytes over everything the observation says. The JPEG crop is an illustration and stays outside."""
    source, recording = observation.provenance, observation.recording
    frame, mask, confidence = int(observation.frame), int(observation.mask), float(observation.confidence)
    said: list[Any] = [recording, frame, mask, observation.phrase, confidence.hex(), observation.n]
    if source:
        said += [int(source.stamp_ns), *(int(n) for n in (*source.bbox, *source.rle["size"]))]
    sha = hashlib.sha256(json.dumps(said).encode())
    if source:
        sha.update(np.asarray(source.rle["counts"], dtype="<u4").tobytes())
    sha.update(np.asarray(observation.points, dtype="<f4").tobytes())
    sha.update(np.asarray(observation.feature, dtype="<f4").tobytes())
    return sha.digest()


def canonical_order(observations: Sequence[Observation]) -> tuple[list[int], list[bytes]]:
    """Indices by (recording, frame, mask), repeats by their digest; and the digests in that order."""
    digests = [digest(o) for o in observations]
    order = sorted(range(len(digests)), key=lambda i: (observations[i].key, digests[i]))
    return order, [digests[i] for i in order]


def content_hash(
    digests: Sequence[bytes],
    partition: Sequence[int],
    text_encoder_id: str,
    parameters: Parameters,
    feature_text_aligned: bool,
) -> str:
    """Hex sha256 of what a memory rests on: evidence, partition, encoder and parameters; no derived float."""
    sha = hashlib.sha256(b"openbelief.memory/1\n")
    for one, object_id in zip(digests, partition, strict=True):
        sha.update(one + int(object_id).to_bytes(8, "little"))
    rest = [text_encoder_id, feature_text_aligned, parameters.to_dict()]
    sha.update(json.dumps(rest, sort_keys=True).encode())
    return sha.hexdigest()
