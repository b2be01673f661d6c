from __future__ import annotations

import json

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.observation import Provenance
from openbelief.perception.sentence import SentenceEncoder
from robot_app.cli import main

BLOCK = (np.stack(np.meshgrid(*[np.arange(6)] * 3), axis=-1).reshape(-1, 3) * 0.02).astype(np.float32)
SAID = ["red chair", "floor lamp", "[bold]sofa[/bold]\x1b[2J"]


@pytest.fixture(scope="module")
def memory(tmp_path_factory):
    encoder = SentenceEncoder()
    features = encoder.encode(["chair", "lamp", "sofa"])
    views = [
        Observation(
            frame,
            k,
            phrase,
            0.8,
            BLOCK + np.float32([3 * k, 0, 0]),
            features[k],
            Provenance("walk", frame, (1, 2, 3, 4), {"size": [2, 2], "counts": [1, 3]}, b"\xff\xd8"),
        )
        for frame in range(3)
        for k, phrase in enumerate(SAID)
    ]
    path = tmp_path_factory.mktemp("memory") / "site.belief"
    ObjectMemory.build(views, encoder, Parameters()).save(path)
    return path


def answer(capsys, *arguments):
    assert main([*map(str, arguments), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_query_ranks_with_the_evidence_for_each(memory, capsys):
    result = answer(capsys, "query", memory, "take me to the lamp, please?", "--limit", 2)
    assert result["query"] == "take me to the lamp, please?" and result["target"] == "lamp"
    assert result["readout"] == "consensus" and result["memory"] == str(memory)
    best = result["candidates"][0]
    assert len(result["candidates"]) == 2 and best["object_id"] == 1 and best["phrases"] == ["floor lamp"]
    assert set(best) >= {"score", "visual", "language", "label", "trust", "centroid", "aabb", "room"}
    assert best["room"] is None and np.shape(best["aabb"]) == (2, 3) and len(best["centroid"]) == 3


def test_why_shows_every_phrase_weight_frame_and_mask(memory, capsys, tmp_path):
    result = answer(capsys, "why", memory, 0, "--crops", tmp_path / "crops")
    assert [c["label"] for c in result["concepts"]] == ["red chair"] and result["lambda"] == 0.2
    assert [(o["frame"], o["mask"], o["phrase"]) for o in result["observations"]] == [
        (f, 0, "red chair") for f in range(3)
    ]
    assert result["observations"][0]["weight"] == pytest.approx(0.8 * 216**0.5)
    assert len(list((tmp_path / "crops").iterdir())) == 3


def test_what_a_model_said_is_shown_as_plain_text(memory, capsys):
    assert main(["why", str(memory), "2"]) == 0
    shown = capsys.readouterr().out
    assert "[bold]sofa" in shown and "\x1b[2J" not in shown
    assert main(["query", str(memory), "sofa"]) == 0
    assert "\x1b[2J" not in capsys.readouterr().out


def test_rebuild_changes_belief_and_keeps_the_evidence(memory, capsys, tmp_path):
    new = tmp_path / "new.belief"
    result = answer(capsys, "rebuild", memory, "-o", new, "--set", "alpha=2.0", "--set", "fusion=calibrated")
    assert result["changed"] == {"alpha": 2.0, "fusion": "calibrated"} and result["objects"] == 3
    old, opened = ObjectMemory.open(memory), ObjectMemory.open(new)
    assert opened.parameters.alpha == 2.0 and opened.digests == old.digests
    assert opened.content_hash == result["content_hash"] != old.content_hash
    assert main(["rebuild", str(memory), "-o", str(new)]) == 1
    assert "--force" in capsys.readouterr().err


@pytest.mark.parametrize("change", ["voxel_m=0.05", "alpha=nan", "beta=1", "alpha", "alpha=high"])
def test_rebuild_refuses_a_parameter_it_cannot_change(memory, capsys, tmp_path, change):
    assert main(["rebuild", str(memory), "-o", str(tmp_path / "new.belief"), "--set", change]) == 1
    assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "new.belief").exists()


def test_eval_retrieval_scores_against_the_truth(memory, capsys, tmp_path):
    boxes = [{"id": k, "label": said, "aabb": [[3 * k, 0, 0], [3 * k + 0.1, 0.1, 0.1]]} for k, said in enumerate(SAID)]
    queries = [
        {"query": "find the lamp", "kind": "direct", "accept": [1]},
        {"query": "owl", "kind": "absent", "accept": []},
    ]
    truth = tmp_path / "truth.json"
    truth.write_text(json.dumps({"format": "openbelief.truth/1", "objects": boxes, "queries": queries}))
    result = answer(capsys, "eval", "retrieval", memory, truth, "--readout", "belief")
    assert (result["readout"], result["queries"], result["r_at_1"], result["sr_at_1m"]) == ("belief", 1, 1.0, 1.0)
    assert result["content_hash"] == ObjectMemory.open(memory).content_hash
    assert main(["eval", "retrieval", str(memory), str(truth)]) == 0
    assert "all findable" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["query", "missing.belief", "lamp"], "does not exist"),
        (["query", "{memory}", "take me to the"], "names nothing"),
        (["why", "{memory}", "99"], "has no object 99"),
        (["why", "{memory}", "-1"], "has no object -1"),
        (["eval", "retrieval", "{memory}", "missing.json"], "missing.json"),
        (["eval", "segmentation", "{memory}", "missing.ply", "missing.txt"], "missing.txt"),
    ],
)
def test_a_failure_is_one_line_with_its_cause(memory, capsys, arguments, words):
    assert main([a.format(memory=memory) for a in arguments]) == 1
    captured = capsys.readouterr()
    assert words in captured.err and captured.err.count("\n") == 1 and captured.out == ""
