from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.belief import consolidate, smoothed, synonym_threshold, weight
from openbelief.retrieval import exact, language_scores
from support.encoders import WordEncoder

PHRASES = ["chair", "red chair", "armchair", "lamp", "floor lamp", "hat stand", "box", "old wooden box"]
said_of_it = st.lists(st.tuples(st.sampled_from(PHRASES), st.floats(0.05, 1.0)), min_size=1, max_size=12)


def node_of(observe, encoder, said, **parameters):
    views = [observe(phrase, frame=i, confidence=c) for i, (phrase, c) in enumerate(said)]
    (node,) = ObjectMemory.build(views, encoder, Parameters(**parameters)).objects
    return node


def head(node, readout, query):
    """H_i of the one object."""
    return language_scores(node.table, np.array([0]), readout, exact(query))[0]


def test_weight_is_confidence_times_the_root_of_the_points(observe):
    view = observe("chair", confidence=0.5, side=10)
    assert weight(view, Parameters()) == pytest.approx(0.5 * 1000**0.5)
    assert weight(view, Parameters(weight="linear")) == pytest.approx(500.0)
    assert weight(view, Parameters(weight="uniform")) == 1.0


def test_smoothing_is_the_paper_s_fraction():
    assert smoothed(np.array([3.0, 1.0]), 0.5).tolist() == [3.5 / 5, 1.5 / 5]


def test_average_linkage_joins_at_the_threshold_and_not_below():
    rows = np.array([[1.0, 0.0], [0.8, 0.6]])
    assert consolidate(rows, 0.80) == [[0, 1]]
    assert sorted(consolidate(rows, 0.81)) == [[0], [1]]


def test_average_linkage_looks_at_all_pairs_not_at_the_nearest():
    angles = np.radians([0.0, 30.0, 60.0])  # cosines .87 .87 .50: single linkage would join all three at 0.8
    rows = np.column_stack([np.cos(angles), np.sin(angles)])
    assert sorted(len(members) for members in consolidate(rows, 0.80)) == [1, 2]


@given(st.integers(0, 2**32 - 1), st.integers(2, 24), st.integers(2, 8), st.floats(0.1, 0.98), st.booleans())
@settings(max_examples=150, deadline=None)
def test_average_linkage_is_scipy_s(seed, count, dim, threshold, repeated):
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import squareform

    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(count, dim))
    rows = rows[rng.integers(0, count, count)] if repeated else rows
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    apart = np.clip(1.0 - rows @ rows.T, 0.0, None)
    np.fill_diagonal(apart, 0.0)
    tree = linkage(squareform((apart + apart.T) / 2, checks=False), method="average")
    labels = fcluster(tree, 1.0 - threshold + 1e-6, criterion="distance")
    assert consolidate(rows, threshold) == sorted(np.flatnonzero(labels == label).tolist() for label in set(labels))


def test_threshold_follows_the_encoder_unless_it_is_set():
    assert synonym_threshold(Parameters(), "nobody knows") == 0.80
    assert synonym_threshold(Parameters(), "clip:MobileCLIP2-S4@0123456789ab-fp32") == 0.90
    assert synonym_threshold(Parameters(synonym_threshold=0.7), "clip:MobileCLIP2-S4@0123456789ab-fp32") == 0.7


def test_contradicting_phrases_stay_as_hypotheses_by_falling_support(observe, tiny_encoder):
    node = node_of(observe, tiny_encoder, [("lamp", 0.9), ("lamp", 0.9), ("hat stand", 0.5)])
    assert [c.label for c in node.concepts] == ["lamp", "hat stand"]
    assert [c.support for c in node.concepts] == pytest.approx([1.8 * 1000**0.5, 0.5 * 1000**0.5])
    assert node.label == "lamp" and node.trust == "trusted"


def test_phrases_are_compared_clean_and_kept_raw(observe, tiny_encoder):
    node = node_of(observe, tiny_encoder, [("Red\u200b  CHAIR ", 0.9), ("red chair", 0.9)])
    assert [c.phrases for c in node.concepts] == [("red chair",)]
    assert node.observations[0].phrase == "Red\u200b  CHAIR "


def test_two_looks_are_degraded_and_three_are_trusted(observe, tiny_encoder):
    assert node_of(observe, tiny_encoder, [("lamp", 0.9)] * 2).trust == "degraded"
    assert node_of(observe, tiny_encoder, [("lamp", 0.9)] * 3).trust == "trusted"


def test_three_masks_of_one_frame_are_not_three_looks_when_frames_count(observe, tiny_encoder):
    views = [observe("lamp", frame=0, mask=mask) for mask in range(3)]
    assert ObjectMemory.build(views, tiny_encoder).objects[0].trust == "trusted"
    assert ObjectMemory.build(views, tiny_encoder, Parameters(trust_counts="frames")).objects[0].trust == "degraded"


def test_a_view_without_language_counts_neither_for_trust_nor_for_concepts(observe, tiny_encoder):
    views = [observe("lamp", frame=0), observe("lamp", frame=1), observe(None, frame=2), observe(" \u200b", frame=3)]
    (node,) = ObjectMemory.build(views, tiny_encoder).objects
    assert node.trust == "degraded" and len(node.concepts) == 1 and len(node.observations) == 4


def test_without_consolidation_every_phrase_is_its_own_concept(observe, tiny_encoder):
    said = [("floor lamp", 0.9), ("lamp floor", 0.9)]  # the tiny encoder hears the same words
    assert len(node_of(observe, tiny_encoder, said).concepts) == 1
    assert len(node_of(observe, tiny_encoder, said, consolidate=False).concepts) == 2


def test_without_regularisation_belief_is_the_plain_share_and_every_node_is_trusted(observe, tiny_encoder):
    node = node_of(observe, tiny_encoder, [("lamp", 0.6), ("box", 0.2)], regularize=False)
    assert node.belief == pytest.approx([0.75, 0.25]) and node.trust == "trusted"


@given(said=said_of_it)
@settings(max_examples=40, deadline=None)
def test_belief_is_positive_and_sums_to_one(observe_any, encoder_any, said):
    node = node_of(observe_any, encoder_any, said)
    assert (node.belief > 0).all() and node.belief.sum() == pytest.approx(1.0)
    assert np.linalg.norm(node.embeddings, axis=1) == pytest.approx(1.0, abs=1e-6)


@given(said=said_of_it, seed=st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_consensus_times_its_norm_is_the_belief_weighted_score(observe_any, encoder_any, said, seed):
    node = node_of(observe_any, encoder_any, said)
    query = np.random.default_rng(seed).normal(size=16)
    norm = np.linalg.norm(node.belief @ node.embeddings)
    assert head(node, "belief", query) == pytest.approx(node.belief @ (node.embeddings @ query), abs=1e-6)
    assert head(node, "consensus", query) * norm == pytest.approx(head(node, "belief", query), abs=1e-6)


@given(said=said_of_it, seed=st.integers(0, 1000))
@settings(max_examples=20, deadline=None)
def test_early_commit_is_the_head_of_the_concept_with_most_support(observe_any, encoder_any, said, seed):
    node = node_of(observe_any, encoder_any, said)
    query = np.random.default_rng(seed).normal(size=16)
    most = max(range(len(node.concepts)), key=lambda k: node.concepts[k].support)
    assert head(node, "early", query) == pytest.approx(node.embeddings[most] @ query)


@pytest.fixture(scope="module")
def observe_any():
    points = (np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3) * 0.02).astype(np.float32)
    return lambda phrase, frame, confidence: Observation(frame, 0, phrase, confidence, points, np.eye(16)[0])


@pytest.fixture(scope="module")
def encoder_any():
    return WordEncoder()
