"""Evidence in canonical order, and the hash that names it: independent of the order of mapping."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.rooms import Room
from openbelief.surroundings import Surroundings


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


@dataclass(frozen=True, eq=False)
class Evidence:
    """All that a memory rests on: what a .belief file holds, and what belief is derived from.

    observations: in canonical order. digests, partition: the hash of each, and the object it belongs to under
    `parameters`. embeddings: every comparable phrase -> (d,) float32 unit length, by the encoder that is named.
    frames: what mapping dealt with. rooms: given and derived. about: where it came from (JSON). surroundings: keyframes
    and maps. Only observations, partition, encoder and parameters are hashed.
    """

    observations: Sequence[Observation] = field(repr=False)
    digests: Sequence[bytes] = field(repr=False)
    partition: Sequence[int] = field(repr=False)
    embeddings: Mapping[str, Array] = field(repr=False)
    frames: tuple[FrameRecord, ...] = field(repr=False)
    rooms: tuple[Room, ...] = field(repr=False)
    about: Mapping[str, Any] = field(repr=False)
    parameters: Parameters
    text_encoder_id: str
    text_dim: int
    feature_text_aligned: bool
    surroundings: Surroundings = field(repr=False, default=Surroundings())

    def __post_init__(self) -> None:
        listed, named = ("observations", "digests", "partition", "frames", "rooms"), ("embeddings", "about")
        own: dict[str, Any] = {name: tuple(getattr(self, name)) for name in listed}
        own |= {name: MappingProxyType(dict(getattr(self, name))) for name in named}
        for name, value in own.items():
            object.__setattr__(self, name, value)

    @cached_property
    def content_hash(self) -> str:
        """Hex sha256 of evidence, partition, encoder and parameters; no derived float, no room."""
        return self._hash_of(self.digests)

    def hashed_again(self) -> str:
        """The content hash of the observations as they are now."""
        return self._hash_of(canonical_order(self.observations)[1])

    def _hash_of(self, digests: Sequence[bytes]) -> str:
        sha = hashlib.sha256(b"openbelief.memory/1\n")
        for one, object_id in zip(digests, self.partition, strict=True):
            sha.update(one + int(object_id).to_bytes(8, "little"))
        rest = [self.text_encoder_id, self.feature_text_aligned, self.parameters.to_dict()]
        sha.update(json.dumps(rest, sort_keys=True).encode())
        return sha.hexdigest()
