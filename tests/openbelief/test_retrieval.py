"""Scores and ranking (Sec. III-E): the paper's fusion, where a channel is missing too."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from openbelief import ObjectMemory, Parameters

READOUTS = ("consensus", "early", "belief")


def test_the_score_is_the_paper_s_fusion(memory, tiny_encoder):
    query = tiny_encoder.encode(["chair"])[0].astype(float)
    for candidate in memory.rank(query, "belief"):
        node = memory.objects[candidate.object_id]
        language = sum(c.belief * float(c.embedding @ query) for c in node.concepts)
        assert candidate.visual == pytest.approx(float(node.feature @ query), abs=1e-6)
        assert candidate.language == pytest.approx(language, abs=1e-6)
        assert candidate.score == pytest.approx(0.2 * candidate.visual + 0.8 * candidate.language)


def test_a_degraded_node_leans_on_vision_and_one_without_language_on_nothing_else(observe, tiny_encoder):
    memory = ObjectMemory.build([observe("box"), observe(None, at=(2, 0, 0), mask=1)], tiny_encoder)
    named, unnamed = sorted(memory.rank(np.eye(16)[0]), key=lambda c: c.object_id)
    assert named.score == pytest.approx(0.7 * named.visual + 0.3 * named.language)
    assert unnamed.language is None and unnamed.score == unnamed.visual == pytest.approx(1.0)
    assert memory.objects[1].concepts == () and memory.objects[1].consensus is None
    assert memory.objects[1].trust == "degraded"


def test_ties_go_to_the_lowest_id(observe, tiny_encoder):
    memory = ObjectMemory.build([observe("box", at=(2 * m, 0, 0), mask=m) for m in range(4)], tiny_encoder)
    assert [c.object_id for c in memory.rank("box")] == [0, 1, 2, 3]
    assert [c.object_id for c in memory.rank("box", exclude={0, 2}, limit=1)] == [1]


@given(seed=st.integers(0, 1000), readout=st.sampled_from(READOUTS))
@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_rejected_candidate_never_comes_back_and_scores_only_fall(memory, seed, readout):
    query, rejected, scores = np.random.default_rng(seed).normal(size=16), set(), []
    while candidate := memory.retrieve(query, readout, exclude=rejected):
        assert candidate.object_id not in rejected
        rejected.add(candidate.object_id)
        scores.append(candidate.score)
    assert rejected == {0, 1, 2, 3} and scores == sorted(scores, reverse=True)


@given(factor=st.floats(0.3, 1.0), seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_scaling_every_confidence_leaves_the_consensus_ranking_almost_unchanged(
    flat, tiny_encoder, memory, factor, seed
):
    quieter = [dataclasses.replace(o, confidence=o.confidence * factor) for o in flat]
    query = np.random.default_rng(seed).normal(size=16)
    before = {c.object_id: c.score for c in memory.rank(query)}
    after = {c.object_id: c.score for c in ObjectMemory.build(quieter, tiny_encoder).rank(query)}
    assert all(after[i] == pytest.approx(before[i], abs=0.02) for i in before)


def test_without_vision_one_stray_word_does_not_beat_many_looks(observe, tiny_encoder):
    looks = [observe("cup", frame=f) for f in range(5)] + [observe("old cup", frame=f) for f in range(5, 8)]
    stray = observe("cup", at=(3, 0, 0), frame=9)
    memory = ObjectMemory.build([*looks, stray], tiny_encoder, feature_text_aligned=False)
    first, second = memory.rank("cup")
    assert first.object_id == 0 and first.score == first.language > second.language == second.score


def test_without_vision_a_node_without_language_comes_last(observe, tiny_encoder):
    views = [observe(None, frame=0), observe("box", at=(2, 0, 0), frame=1)]
    memory = ObjectMemory.build(views, tiny_encoder, feature_text_aligned=False)
    assert [c.object_id for c in memory.rank("lamp")] == [1, 0]


def test_calibrated_fusion_does_not_depend_on_a_channel_s_scale(flat, tiny_encoder, memory):
    calibrated = ObjectMemory.build(flat, tiny_encoder, Parameters(fusion="calibrated"))
    scores = {c.object_id: c for c in calibrated.rank(np.eye(16)[2])}
    visual = np.array([scores[i].visual for i in range(4)])
    language = np.array([scores[i].language for i in range(4)])
    standard = [(x - x.mean()) / x.std() for x in (visual, language)]
    assert [scores[i].score for i in range(4)] == pytest.approx(0.2 * standard[0] + 0.8 * standard[1])


@given(seed=st.integers(0, 10_000), readout=st.sampled_from(READOUTS), limit=st.integers(1, 5), aligned=st.booleans())
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_the_best_few_are_the_first_of_all(observe, tiny_encoder, seed, readout, limit, aligned):
    """Ties too: things that look and are called the same score the same, wherever they stand in the matrices."""
    rng, words = np.random.default_rng(seed), ("red chair", "chair", "floor lamp", None, "white wall")
    views = [
        observe(words[rng.integers(5)], at=(2 * i, 0, 0), frame=i, look=int(rng.integers(3)), side=2) for i in range(37)
    ]
    memory = ObjectMemory.build(views, tiny_encoder, feature_text_aligned=aligned)
    query, exclude = rng.normal(size=16), set(rng.integers(0, 37, 5).tolist())
    ranked = memory.rank(query, readout, exclude)
    assert memory.rank(query, readout, exclude, limit) == ranked[:limit] and not exclude & {c.object_id for c in ranked}
    assert [(-c.score, c.object_id) for c in ranked] == sorted((-c.score, c.object_id) for c in ranked)
    of_kind = {}
    for c in ranked:
        node = memory.objects[c.object_id]
        of_kind.setdefault((node.label, node.feature.tobytes()), set()).add(c.score)
    assert all(len(scores) == 1 for scores in of_kind.values())


def test_an_unknown_readout_is_refused(memory):
    with pytest.raises(ValueError, match="consensus, early, belief"):
        memory.rank("lamp", "full")
    with pytest.raises(ValueError, match="visual, consensus, early, full"):
        memory.project(["lamp"], "belief")
