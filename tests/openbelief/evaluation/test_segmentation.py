from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation
from openbelief.evaluation.labelled_points import read_classes, read_labelled_points
from openbelief.evaluation.segmentation import PROTOCOLS, evaluate, score, transfer
from support.encoders import AxisEncoder

HOVSG, DUALMAP = PROTOCOLS


@pytest.mark.parametrize(
    ("protocol", "expected"), [(HOVSG, (0.6970, 0.7045, 0.7333)), (DUALMAP, (0.3667, 0.75, 0.7333))]
)
def test_the_golden_case_of_both_protocols(protocol, expected):
    truth = np.repeat([1, 2, 3], [50, 30, 20])
    predicted = np.repeat([1, 7, 2, 3, 1], [40, 10, 20, 25, 5])
    scores = score(truth, predicted, [3], protocol)
    assert (scores.miou, scores.fmiou, scores.macc) == pytest.approx(expected, abs=5e-5)


def test_the_protocols_ignore_different_names():
    assert HOVSG.ignores("floor") and not HOVSG.ignores("floor lamp") and not HOVSG.ignores("ceiling")
    assert DUALMAP.ignores("floor lamp") and DUALMAP.ignores("ceiling") and not DUALMAP.ignores("door")


def test_nothing_left_to_score_is_refused():
    with pytest.raises(ValueError, match="hovsg"):
        score(np.array([1, 1]), np.array([1, 2]), [1], HOVSG)


def test_a_point_takes_the_majority_of_its_five_nearest():
    points = np.array([[x, 0, 0] for x in (0.0, 0.1, 0.2, 0.3, 0.4, 9.0)])
    labels = np.array([7, 7, 2, 2, 2, 5])
    assert transfer(points, labels, np.array([[0.0, 0, 0], [99.0, 0, 0]])).tolist() == [2, 2]
    assert transfer(points[:2], np.array([4, 3]), np.zeros((1, 3))).tolist() == [3]


def test_a_memory_that_names_everything_right_scores_one():
    block = np.random.default_rng(0).uniform(0, 0.2, (60, 3))
    blocks = [block + np.array([3.0 * k, 0, 0]) for k in range(3)]
    views = [Observation(0, k, name, 0.9, blocks[k], np.eye(4)[k]) for k, name in enumerate(["chair", "lamp", "wall"])]
    memory = ObjectMemory.build(views, AxisEncoder(["chair", "lamp", "wall"].index, 4))
    truth_points = np.concatenate(blocks)
    classes = ["unlabelled", "chair", "lamp", "wall"]
    for readout in ("visual", "consensus", "early", "full"):
        scores = evaluate(memory, classes, truth_points, np.repeat([1, 2, 3], 60), readout)
        assert {name: (s.miou, s.fmiou, s.macc) for name, s in scores.items()} == {
            "hovsg": (1.0, 1.0, 1.0),
            "dualmap": (1.0, 1.0, 1.0),
        }


@pytest.fixture
def ply(tmp_path):
    def make(count=3, declared=None, properties="float x\nfloat y\nfloat z\nushort label\nushort instance"):
        layout = np.dtype([("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("label", "<u2"), ("instance", "<u2")])
        rows = np.array([(k, 0, 0, k, 0) for k in range(count)], layout)
        lines = [f"property {line}" for line in properties.split("\n")]
        head = ["ply", "format binary_little_endian 1.0", f"element vertex {declared or count}", *lines, "end_header\n"]
        (tmp_path / "a.ply").write_bytes("\n".join(head).encode() + rows.tobytes())
        return tmp_path / "a.ply"

    return make


def test_labelled_points_are_read(ply):
    points, labels = read_labelled_points(ply(), 3)
    assert points[:, 0].tolist() == [0, 1, 2] and labels.tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"declared": 4}, "cut short"),
        ({"properties": "float x\nfloat y"}, "'label'"),
        ({"properties": "list a b c"}, "one number"),
    ],
)
def test_points_that_cannot_be_read_are_refused(ply, change, words):
    with pytest.raises(ValueError, match=words):
        read_labelled_points(ply(**change), 3)


def test_labels_outside_the_classes_and_other_files_are_refused(ply, tmp_path):
    with pytest.raises(ValueError, match="0 to 1"):
        read_labelled_points(ply(), 2)
    (tmp_path / "b.ply").write_bytes(b"solid")
    with pytest.raises(ValueError, match="not a PLY"):
        read_labelled_points(tmp_path / "b.ply", 2)
    (tmp_path / "classes.txt").write_text("\n")
    with pytest.raises(ValueError, match="no class"):
        read_classes(tmp_path / "classes.txt")
