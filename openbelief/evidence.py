"""Evidence in canonical order, and the hash that names it: independent of the order of mapping."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.embedding import PhraseEmbeddings
from openbelief.observation import Observation, digest
from openbelief.parameters import Parameters
from openbelief.rooms import Room
from openbelief.stored_observations import Key, StoredObservations
from openbelief.surroundings import Surroundings

HASHED_AT_ONCE = 1 << 16  # observations: of millions, a copy of all would be twice what a file's keys take


@dataclass(frozen=True, order=True)
class FrameRecord:
    """A frame that mapping has dealt with; `skipped` is the reason why nothing was taken from it."""

    recording: str
    stamp_ns: int
    skipped: str | None = None


def canonical_order(observations: Sequence[Observation]) -> tuple[list[int], Array]:
    """Indices by (recording, frame, mask), repeats by their digest; and the (n, 32) uint8 digests in that order."""
    return in_order([o.key for o in observations], [o.digest for o in observations])


def in_order(keys: Sequence[Key], digests: Sequence[bytes]) -> tuple[list[int], Array]:
    """`canonical_order` of observations with these keys and digests."""
    order = sorted(range(len(keys)), key=lambda i: (keys[i], digests[i]))
    return order, np.frombuffer(b"".join(digests[i] for i in order), np.uint8).reshape(-1, 32)


@dataclass(frozen=True, eq=False)
class Evidence:
    """All that a memory rests on: what a .belief file holds, and what belief is derived from.

    observations: in canonical order. digests: (n, 32) uint8, the hash of each. partition: (n,) int64, the object each
    belongs to under `parameters`. embeddings: of every comparable phrase, by the encoder that is named. frames: what
    mapping dealt with. rooms: given and derived. about: where it came from (JSON). read_surroundings: gives keyframes
    and maps. Only observations, partition, encoder and parameters are in the content hash.
    """

    observations: Sequence[Observation] = field(repr=False)
    digests: Array = field(repr=False)
    partition: Array = field(repr=False)
    embeddings: PhraseEmbeddings = field(repr=False)
    frames: tuple[FrameRecord, ...] = field(repr=False)
    rooms: tuple[Room, ...] = field(repr=False)
    about: Mapping[str, Any] = field(repr=False)
    parameters: Parameters
    text_encoder_id: str
    text_dim: int
    feature_text_aligned: bool
    read_surroundings: Callable[[], Surroundings] = field(repr=False, default=Surroundings)

    def __post_init__(self) -> None:
        if not len(self.observations) == len(self.digests) == len(self.partition):
            raise ValueError("Every observation should have one digest and belong to one object.")
        object.__setattr__(self, "digests", read_only(np.asarray(self.digests, np.uint8).reshape(-1, 32)))
        object.__setattr__(self, "partition", read_only(np.asarray(self.partition, np.int64)))
        object.__setattr__(self, "about", MappingProxyType(dict(self.about)))

    @cached_property
    def surroundings(self) -> Surroundings:
        """Where the camera stood, what it measured and saw there, and the maps."""
        return self.read_surroundings()

    @cached_property
    def keys(self) -> Sequence[Key]:
        """(recording, frame, mask) of every observation; reads none of them."""
        observations = self.observations
        return observations.keys if isinstance(observations, StoredObservations) else [o.key for o in observations]

    @cached_property
    def content_hash(self) -> str:
        """Hex sha256 of evidence, partition, encoder and parameters; no derived float, no room."""
        return self._hash_of(self.digests)

    @cached_property
    def state_hash(self) -> str:
        """Hex sha256 of the content hash and the rooms, given and derived: what answers follow from."""
        return self._state_of(self.content_hash)

    def state_again(self) -> str:
        """The state hash as the observations in memory are now; a file's own are taken as its seal names them."""
        digests = np.array(self.digests)
        stored = isinstance(self.observations, StoredObservations)
        held = self.observations.held() if isinstance(self.observations, StoredObservations) else {}
        for i, observation in held.items() if stored else enumerate(self.observations):
            digests[i] = np.frombuffer(digest(observation), np.uint8)
        return self._state_of(self._hash_of(digests))

    def _hash_of(self, digests: Array) -> str:
        sha = hashlib.sha256(b"openbelief.memory/1\n")
        objects = self.partition.astype("<u8").reshape(-1, 1).view(np.uint8)
        for begin in range(0, len(digests), HASHED_AT_ONCE):
            part = slice(begin, begin + HASHED_AT_ONCE)
            sha.update(np.concatenate([digests[part], objects[part]], axis=1).tobytes())
        rest = [self.text_encoder_id, self.feature_text_aligned, self.parameters.to_dict()]
        sha.update(json.dumps(rest, sort_keys=True).encode())
        return sha.hexdigest()

    def _state_of(self, content_hash: str) -> str:
        said = json.dumps([content_hash, [room.as_json() for room in self.rooms]], sort_keys=True)
        return hashlib.sha256(b"openbelief.state/1\n" + said.encode()).hexdigest()
