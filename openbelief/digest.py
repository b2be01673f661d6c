"""The hash that names an observation."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from openbelief.observation import Observation


def digest(observation: Observation) -> bytes:
    """32 bytes over everything the observation says now. The JPEG crop is an illustration and stays outside."""
    source, recording = observation.provenance, observation.recording
    frame, mask, confidence = int(observation.frame), int(observation.mask), float(observation.confidence)
    said: list[Any] = [recording, frame, mask, observation.phrase, confidence.hex(), observation.n]
    if source:
        said += [int(source.stamp_ns), *(int(n) for n in (*source.bbox, *source.rle["size"]))]
    sha = hashlib.sha256(json.dumps(said).encode())
    if source:
        sha.update(np.ascontiguousarray(source.rle["counts"], dtype="<u4").data)
    sha.update(np.ascontiguousarray(observation.points, dtype="<f4").data)
    sha.update(np.ascontiguousarray(observation.feature, dtype="<f4").data)
    return sha.digest()
