"""A memory made by an attacker: its words are markup, its pictures none."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation
from openbelief.observation import Provenance
from openbelief.perception.sentence import SentenceEncoder
from openbelief.rooms import Room

HOSTILE = "</script><script>alert(1)</script><img src=x onerror=alert(2)>"


@pytest.fixture(scope="module")
def hostile(tmp_path_factory):
    """A memory whose phrases and rooms are markup."""
    block = (np.stack(np.meshgrid(*[np.arange(6)] * 3), axis=-1).reshape(-1, 3) * 0.02).astype(np.float32)
    encoder = SentenceEncoder()
    source = Provenance(HOSTILE, 5, (1, 2, 3, 4), {"size": [2, 2], "counts": [1, 3]}, b"\xff\xd8no picture")
    seen = [Observation(0, 0, HOSTILE[:50], 0.8, block, encoder.encode(["chair"])[0], source)]
    square = [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    path = tmp_path_factory.mktemp("hostile") / "site.belief"
    ObjectMemory.build(seen, encoder, rooms=[Room("<b>hall</b>", square)]).save(path)
    return path
