"""Pieces of one thing: found as by comparing all with all, kept in the file, and believed only of what they were of."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief import ObjectMemory, Parameters
from openbelief.file_checks import BeliefFileError
from openbelief.pieces import find_pieces
from support.files import resealed

VOXEL_M = 0.02


def clouds(rng: np.random.Generator, n: int, *, snapped: bool) -> list[np.ndarray]:
    made = []
    for _ in range(n):
        points = rng.uniform(0, 0.4, (int(rng.integers(1, 60)), 3)) + rng.uniform(0, 1.2, 3)
        made.append((np.floor(points / VOXEL_M) + 0.5) * VOXEL_M if snapped else points)
    return [points.astype(np.float32) for points in made]


def share(P: np.ndarray, Q: np.ndarray, radius_m: float) -> float:
    near = np.linalg.norm(P[:, None].astype(np.float64) - Q[None], axis=2) <= radius_m
    return float(max(near.any(axis=1).mean(), near.any(axis=0).mean()))


@given(st.integers(0, 2**32 - 1), st.integers(1, 25), st.booleans())
@settings(max_examples=50, deadline=None)
def test_pieces_are_those_found_by_comparing_all_with_all(seed, n, snapped):
    rng = np.random.default_rng(seed)
    points = clouds(rng, n, snapped=snapped)
    features = np.eye(3, dtype=np.float32)[rng.integers(0, 3, n)]
    boxes = np.array([[cloud.min(axis=0), cloud.max(axis=0)] for cloud in points])
    asked: set[int] = set()
    found = find_pieces(boxes, features, lambda i: (asked.add(i), points[i])[1], 0.05, 0.75, VOXEL_M)
    touch = (boxes[:, None, 0] <= boxes[None, :, 1] + 0.05).all(axis=2)
    touch &= touch.T & (features @ features.T >= 0.75)
    pairs = np.argwhere(np.triu(touch, 1))
    assert found.pair.tolist() == pairs.tolist()
    assert found.share.tolist() == [share(points[i], points[j], 0.05) for i, j in pairs]
    assert asked == set(pairs.ravel().tolist())


@pytest.fixture
def views(observe):
    """A sofa in two pieces that overlap by half, and a lamp of its own."""
    sofa = [observe("sofa", at=(x, 0, 0), frame=n, look=0) for n, x in enumerate((0.0, 0.1))]
    return [*sofa, observe("lamp", at=(4, 0, 0), frame=2, look=1)]


@pytest.fixture
def memory(views, tiny_encoder):
    return ObjectMemory.build(views, tiny_encoder, Parameters(tau_g=0.9))


@pytest.fixture
def path(memory, tmp_path):
    memory.save(tmp_path / "site.belief")
    return tmp_path / "site.belief"


def test_a_file_knows_its_pieces_and_no_observation_is_read_for_an_answer(path, memory, tiny_encoder, monkeypatch):
    monkeypatch.setattr("openbelief.belief_file.from_row", lambda row: pytest.fail("an observation was read"))
    opened = ObjectMemory.open(path, tiny_encoder)
    assert memory.table.pieces.pair.tolist() == [[0, 1]] and 0.5 <= memory.table.pieces.share[0] < 1
    assert all((a == b).all() for a, b in zip(opened.table.pieces, memory.table.pieces, strict=True))
    assert opened.answer("sofa") == memory.answer("sofa")


@pytest.mark.parametrize(
    "without", ["DELETE FROM meta WHERE key = 'pieces'", "DELETE FROM columns WHERE name LIKE 'piece%'"]
)
def test_a_file_from_before_pieces_were_kept_answers_the_same(path, memory, tiny_encoder, without):
    changes = [without] if "meta" in without else [without, "DELETE FROM meta WHERE key = 'pieces'"]
    opened = ObjectMemory.open(resealed(path, *changes), tiny_encoder)
    assert opened.content_hash == memory.content_hash
    assert opened.answer("sofa") == memory.answer("sofa")


def test_pieces_of_other_evidence_are_not_believed(path, memory, tiny_encoder):
    made_by = {"radius_m": 0.05, "cosine": 0.75, "content_hash": "0" * 64}
    change = ("UPDATE meta SET value = ? WHERE key = 'pieces'", (json.dumps(made_by),))
    opened = ObjectMemory.open(resealed(path, change, columns={"piece_share": np.zeros(1)}), tiny_encoder)
    assert opened.answer("sofa") == memory.answer("sofa")


@pytest.mark.parametrize(
    "columns",
    [
        {"piece_share": np.array([np.nan])},
        {"piece_pair": np.array([[0, 3]], "<i4")},
        {"piece_pair": np.zeros((0, 2), "<i4")},
    ],
)
def test_pieces_that_cannot_be_are_refused_in_one_line(path, tiny_encoder, columns):
    with pytest.raises(BeliefFileError, match="piece") as refused:
        ObjectMemory.open(resealed(path, columns=columns), tiny_encoder).answer("sofa")
    assert "\n" not in str(refused.value)


def test_a_changed_piece_is_found_when_it_is_read(path, tiny_encoder):
    import sqlite3

    db = sqlite3.connect(path, isolation_level=None)
    db.execute("UPDATE columns SET data = ? WHERE name = 'piece_share'", (np.array([0.9]).tobytes(),))
    db.close()
    opened = ObjectMemory.open(path, tiny_encoder)
    with pytest.raises(BeliefFileError, match="piece_share"):
        opened.answer("sofa")


def test_the_fingerprint_is_the_same_before_and_after_an_answer(path, tiny_encoder):
    opened = ObjectMemory.open(path, tiny_encoder)
    before = opened.fingerprint()
    opened.answer("sofa")
    assert opened.fingerprint() == before


def test_a_saved_memory_that_was_opened_keeps_its_pieces(path, tiny_encoder, tmp_path):
    opened = ObjectMemory.open(path, tiny_encoder)
    opened.save(tmp_path / "again.belief")
    again = ObjectMemory.open(tmp_path / "again.belief", tiny_encoder)
    assert all((a == b).all() for a, b in zip(again.table.pieces, opened.table.pieces, strict=True))
