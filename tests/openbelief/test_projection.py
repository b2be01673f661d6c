from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from openbelief import ObjectMemory, Parameters
from openbelief.projection import mixed, one_hot, project_node, refine

CLASSES = ["chair", "lamp", "hat stand", "wall"]


@pytest.fixture
def memory(flat, tiny_encoder):
    return ObjectMemory.build(flat, tiny_encoder, Parameters())


@pytest.mark.parametrize("readout", ["visual", "consensus", "early", "full"])
def test_every_row_is_a_distribution_over_the_classes(memory, readout):
    rows = memory.project(CLASSES, readout)
    assert rows.shape == (4, 4) and rows.dtype == np.float64
    assert (rows >= 0).all() and rows.sum(axis=1) == pytest.approx(1.0)


def test_names_and_their_embeddings_give_the_same(memory, tiny_encoder):
    assert memory.project(CLASSES) == pytest.approx(memory.project(tiny_encoder.encode(CLASSES)))


def test_consensus_names_what_was_said_most(memory):
    assert memory.project(CLASSES, "consensus").argmax(axis=1).tolist() == [0, 0, 1, 3]


def test_early_commit_is_the_full_belief_with_a_one_hot_belief(memory, tiny_encoder):
    classes = tiny_encoder.encode(CLASSES).astype(float)
    for node in memory.objects:
        early = project_node(node, classes, "early", memory.parameters)
        assert early == pytest.approx(mixed(one_hot(node), node, classes, memory.parameters))


def test_a_node_without_language_is_read_visually(observe, tiny_encoder):
    memory = ObjectMemory.build([observe(None)], tiny_encoder)
    visual = memory.project(CLASSES, "visual")
    for readout in ("consensus", "early", "full"):
        assert memory.project(CLASSES, readout) == pytest.approx(visual)


@given(
    belief=st.lists(st.sampled_from([0.0, 0.2, 0.5, 1.0]), min_size=2, max_size=6).filter(any),
    seed=st.integers(0, 1000),
)
@settings(max_examples=50, deadline=None)
def test_refinement_keeps_the_support(belief, seed):
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(len(belief), 8))
    rows /= np.linalg.norm(rows, axis=1, keepdims=True)
    refined = refine(np.array(belief) / sum(belief), rows, rows[0], Parameters())
    assert ((refined == 0) == (np.array(belief) == 0)).all() and refined.sum() == pytest.approx(1.0)


def test_refinement_may_promote_what_the_eye_agrees_with():
    rows = np.eye(2)
    assert refine(np.array([0.7, 0.3]), rows, np.array([0.0, 1.0]), Parameters()).argmax() == 1


@pytest.mark.parametrize("classes", [[], np.zeros((2, 16)), np.ones((2, 3)), np.full((1, 16), np.inf)])
def test_classes_that_are_none_are_refused(memory, classes):
    with pytest.raises(ValueError, match="lass"):
        memory.project(classes)


def test_one_name_is_no_list_of_names(flat, tiny_encoder):
    with pytest.raises(ValueError, match="a list of at least one"):
        ObjectMemory.build(flat, tiny_encoder, Parameters()).project("chair")
