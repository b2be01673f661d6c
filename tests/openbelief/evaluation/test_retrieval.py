from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation
from openbelief.evaluation.colours import coloured_queries
from openbelief.evaluation.retrieval import evaluate
from openbelief.evaluation.truth import TruthError, read_truth, truth_of
from openbelief.observation import Provenance
from support.encoders import WordEncoder

BLOCK = (np.stack(np.meshgrid(*[np.arange(5)] * 3), axis=-1).reshape(-1, 3) * 0.02).astype(np.float32)


def view(phrase, x, frame, mask):
    source = Provenance("walk", frame, (0, 0, 1, 1), {"size": [1, 1], "counts": [0, 1]})
    return Observation(frame, mask, phrase, 0.9, BLOCK + np.float32([x, 0, 0]), np.eye(16)[0], source)


def box(x):
    return [[x, 0, 0], [x + 0.1, 0.1, 0.1]]


@pytest.fixture
def memory():
    """A lamp where it is, a "cup" 0.6 m beside the true cup, and a lamp (fragment) once more."""
    views = [view("lamp", 0, f, 0) for f in range(3)] + [view("cup", 5.7, f, 1) for f in range(3)]
    return ObjectMemory.build([*views, view("dog", 0.15, 9, 2)], WordEncoder())


@pytest.fixture
def truth(tmp_path):
    def write(**changes):
        content = {
            "format": "openbelief.truth/1",
            "objects": [{"id": 7, "label": "lamp", "aabb": box(0)}, {"id": 8, "label": "cup", "aabb": box(5)}],
            "queries": [
                {"query": "find the lamp", "kind": "direct", "accept": [7]},
                {"query": "cup", "kind": "direct", "accept": [8]},
                {"query": "zebra", "kind": "absent", "accept": []},
                {"query": "spoon", "kind": "direct", "accept": [8], "findable": False},
            ],
            "mask_origin": [*[[f, 0, 7] for f in range(3)], *[[f, 1, 8] for f in range(2)], [2, 1, 3], [9, 2, 7]],
        }
        path = tmp_path / "truth.json"
        path.write_text(json.dumps(content | changes))
        return path

    return write


def test_right_and_near_are_told_apart_and_what_cannot_be_found_is_not_scored(memory, truth):
    result = evaluate(memory, read_truth(truth()))
    assert result["queries"] == 2
    assert (result["r_at_1"], result["r_at_3"], result["sr_at_1m"]) == (0.5, 0.5, 1.0)
    assert result["by_kind"] == {"direct": {"queries": 2, "r_at_1": 0.5, "r_at_3": 0.5, "sr_at_1m": 1.0}}
    assert result["unfindable"]["queries"] == 1 and result["absent"]["queries"] == 1
    (miss,) = result["misses"]
    assert miss["query"] == "cup" and miss["because"] == "no mapped object lies where an accepted one is"
    assert "language_alone" not in result
    json.dumps(result, allow_nan=False)


def test_fragments_and_mixed_nodes_are_counted(memory, truth):
    nodes = evaluate(memory, read_truth(truth()))["nodes"]
    assert nodes == {
        "nodes": 3,
        "true_objects": 2,
        "mapped_objects": 2,
        "nodes_per_object": 1.5,
        "purity": pytest.approx(6 / 7),
    }


def test_without_mask_origins_purity_is_unknown_not_one(memory, truth):
    assert evaluate(memory, read_truth(truth(mask_origin=[])))["nodes"]["purity"] is None


def test_language_alone_is_reported_where_features_are_no_text(memory, truth):
    blind = ObjectMemory.build(memory.observations, WordEncoder(), feature_text_aligned=False)
    assert evaluate(blind, read_truth(truth()))["language_alone"]["queries"] == 2


@pytest.mark.parametrize(
    "changes",
    [
        {"format": "openbelief.truth/2"},
        {"objects": [{"id": 7, "label": "lamp", "aabb": [[1, 0, 0], [0, 0, 0]]}]},
        {"queries": [{"query": "x", "kind": "direct", "accept": [99]}]},
        {"queries": [{"query": "x", "kind": "direct", "accept": []}]},
        {"queries": 3},
    ],
)
def test_a_truth_that_contradicts_itself_is_refused_in_one_line(truth, changes):
    with pytest.raises(TruthError, match=r"^[^\n]*truth.json[^\n]*$"):
        read_truth(truth(**changes))


def test_a_truth_that_is_none_is_refused(tmp_path):
    (tmp_path / "truth.json").write_text("not json")
    for path in (tmp_path / "truth.json", tmp_path / "missing.json"):
        with pytest.raises(TruthError, match="json"):
            read_truth(path)


def test_a_margin_in_the_truth_file_is_obeyed(memory, truth):
    """The cup's centroid lies 0.15 m outside this box."""
    near = {"objects": [{"id": 7, "label": "lamp", "aabb": box(0)}, {"id": 8, "label": "cup", "aabb": box(5.5)}]}
    assert evaluate(memory, read_truth(truth(**near)))["r_at_1"] == 1.0
    tight = evaluate(memory, read_truth(truth(margin_m=0.1, **near)))
    assert tight["r_at_1"] == 0.5 and tight["margin_m"] == 0.1 and tight["sr_at_1m"] == 1.0
    for wrong in (-0.1, "wide", [1]):
        with pytest.raises(TruthError, match=r"^[^\n]*$"):
            read_truth(truth(margin_m=wrong))


def test_grounded_says_what_doubt_keeps_and_refuses(memory, truth):
    """These words are unlike each other, so what is there is found and what is not is not."""
    result = evaluate(memory, read_truth(truth(absent_nouns=["tuba", "yurt"])), "grounded")
    assert result["readout"] == "grounded" and result["queries"] == 2 and result["kept"] == 1.0
    assert result["absent_nouns"] == {"queries": 2, "refused": 1.0, "unsure": 0.0, "not_found": 1.0}
    kept = [point["kept"] for point in result["doubt"]["curve"]]
    assert kept == sorted(kept, reverse=True) and result["absent"]["auc"] == 1.0
    json.dumps(result, allow_nan=False)


def test_without_absent_nouns_nothing_is_said_of_them(memory, truth):
    result = evaluate(memory, read_truth(truth()), "grounded")
    assert "absent_nouns" not in result and result["kept"] == 1.0
    assert "kept" not in evaluate(memory, read_truth(truth()))


def test_what_is_asked_for_in_a_colour_that_none_has_is_no_colour_of_its_own():
    box = [[0, 0, 0], [1, 1, 1]]
    things = [("chair", "red"), ("chair", "white"), ("lamp", "red"), ("sofa", None), ("mug", "blue")]
    objects = [{"id": i, "label": n, "colour": c, "aabb": box} for i, (n, c) in enumerate(things)]
    own, other = coloured_queries(truth_of({"objects": objects, "queries": []}))
    assert own == ["red chair", "red lamp", "blue mug"]
    assert other == ["blue chair", "white lamp", "white mug"]
    assert coloured_queries(truth_of({"objects": objects[3:4], "queries": []})) == ([], [])


def test_grounded_says_what_is_kept_and_refused_of_colours(memory, truth):
    told = read_truth(truth())
    coloured = {i: replace(each, colour=("red", "blue")[i % 2]) for i, each in told.objects.items()}
    result = evaluate(memory, replace(told, objects=coloured), "grounded")["colours"]
    assert result["queries"] == len({each.label for each in coloured.values()}) and result["kept"] == 1.0
    assert result["refused"] == 0.0, "of no thing of this map was a colour said"
