from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.observation import Provenance
from openbelief.perception.sentence import SentenceEncoder
from robot_app.cli import main
from robot_app.seen_in import told
from support.verbs import answer

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


def test_query_ranks_with_the_evidence_for_each(memory, capsys):
    result = answer(capsys, "query", memory, "take me to the lamp, please?", "--limit", 2)
    assert result["query"] == "take me to the lamp, please?" and result["target"] == "lamp"
    assert result["readout"] == "grounded" and result["memory"] == str(memory) and result["answer"] == "found"
    assert result["understood"]["target"] == "lamp" and result["understood"]["unused"] == []
    assert set(result["candidates"][0]["terms"]) == {"thing", "place", "relation", "not", "which"}
    best = result["candidates"][0]
    assert len(result["candidates"]) == 2 and best["object_id"] == 1 and best["phrases"] == ["floor lamp"]
    assert set(best) >= {"score", "visual", "language", "label", "trust", "centroid", "aabb", "room"}
    assert best["room"] is None and np.shape(best["aabb"]) == (2, 3) and len(best["centroid"]) == 3


def test_the_papers_readouts_answer_as_they_do_and_know_no_doubt(memory, capsys):
    result = answer(capsys, "query", memory, "take me to the lamp", "--readout", "consensus")
    assert result["readout"] == "consensus" and result["answer"] is None and result["understood"]["target"] == "lamp"
    opened = ObjectMemory.open(memory, SentenceEncoder())
    scores = [c["score"] for c in result["candidates"]]
    assert scores == pytest.approx([c.score for c in opened.rank("take me to the lamp")])


def test_what_is_not_there_is_said_with_the_nearest_and_what_consensus_would_have_answered(memory, capsys):
    result = answer(capsys, "query", memory, "the saxophone in the attic")
    assert result["answer"] == "not found" and len(result["offers"]) == 3
    assert result["understood"]["unused"] == ["attic"] and result["consensus"]["object_id"] in {0, 1, 2}
    assert main(["query", str(memory), "the saxophone in the attic"]) == 0
    shown = capsys.readouterr().out
    assert "Not found: " in shown and "The nearest are: " in shown and "Not used: attic." in shown


@pytest.mark.parametrize("sentence", ["stop", "please come back", "help"])
def test_a_command_is_no_query(memory, capsys, sentence):
    assert main(["query", str(memory), sentence]) == 1
    assert "is the command" in capsys.readouterr().err


def test_query_knows_where_the_operator_stands(memory, capsys):
    assert answer(capsys, "query", memory, "the nearest lamp", "--at", "0,0,90")["notes"] == []
    assert answer(capsys, "query", memory, "the nearest lamp")["understood"]["unused"] == ["nearest"]
    with pytest.raises(SystemExit) as ended:
        main(["query", str(memory), "lamp", "--at", "here"])
    assert ended.value.code == 2 and "X,Y" in capsys.readouterr().err


def test_why_shows_every_phrase_weight_frame_and_mask(memory, capsys, tmp_path):
    result = answer(capsys, "why", memory, 0, "--crops", tmp_path / "crops")
    assert [c["label"] for c in result["concepts"]] == ["red chair"] and result["lambda"] == 0.2
    assert [(o["frame"], o["mask"], o["phrase"]) for o in result["observations"]] == [
        (f, 0, "red chair") for f in range(3)
    ]
    assert result["observations"][0]["weight"] == pytest.approx(0.8 * 216**0.5)
    assert len(list((tmp_path / "crops").iterdir())) == 3


def test_crops_of_masks_that_share_their_numbers_are_all_kept(memory, capsys, tmp_path):
    chair = ObjectMemory.open(memory).objects[0].observations[0]
    source = replace(chair.provenance, recording="another walk")
    walks = [chair, Observation(chair.frame, chair.mask, "chair", 0.8, chair.points, chair.feature, source)]
    ObjectMemory.build(walks, SentenceEncoder()).save(tmp_path / "two.belief")
    written = answer(capsys, "why", tmp_path / "two.belief", 0, "--crops", tmp_path / "crops")["crops"]
    assert len(set(written)) == 2 == len(list((tmp_path / "crops").iterdir()))


def test_why_says_what_each_part_of_a_sentence_added_for_an_object(memory, capsys):
    result = answer(capsys, "why", memory, 1, "--asked", "the lamp next to the sofa")["asked"]
    assert result["rank"] == 1 and set(result["terms"]) == {"thing", "place", "relation", "not", "which"}
    assert result["consensus"]["object_id"] in {0, 1, 2} and result["understood"]["relation"] == "next to sofa"
    assert main(["why", str(memory), "1", "--asked", "the lamp"]) == 0
    assert "rank 1" in capsys.readouterr().out


def test_query_and_why_show_how_far_the_words_of_the_map_contradict_the_sentence(memory, capsys):
    best = answer(capsys, "query", memory, "the blue chair")["candidates"][0]
    assert (best["object_id"], best["contradicted"]) == (0, 1.0)
    assert answer(capsys, "query", memory, "the red chair")["candidates"][0]["contradicted"] == 0.0
    assert answer(capsys, "why", memory, 0, "--asked", "the blue chair")["asked"]["contradicted"] == 1.0
    assert main(["query", str(memory), "the blue chair", "--wide"]) == 0
    shown = capsys.readouterr().out
    assert "Unsure: what fits best was called red, never blue." in shown and "contradicted" in shown
    assert main(["why", str(memory), "0", "--asked", "the blue chair"]) == 0
    assert "100% is another" in capsys.readouterr().out


def test_what_a_model_said_is_shown_as_plain_text(memory, capsys):
    assert main(["why", str(memory), "2"]) == 0
    shown = capsys.readouterr().out
    assert "[bold]sofa" in shown and "\x1b[2J" not in shown
    assert main(["query", str(memory), "sofa"]) == 0
    assert "\x1b[2J" not in capsys.readouterr().out


@pytest.mark.parametrize(("verb", "asked", "only_wide"), [("query", "lamp", "trust"), ("why", "0", "points")])
def test_tables_fit_80_columns_and_wide_shows_every_one(memory, capsys, verb, asked, only_wide):
    assert main([verb, str(memory), asked]) == 0
    narrow = capsys.readouterr().out
    assert max(len(line) for line in narrow.splitlines() if line[:1] in "┏┃┡│└") <= 80 and only_wide not in narrow
    assert main([verb, str(memory), asked, "--wide"]) == 0
    assert only_wide in capsys.readouterr().out


def test_rebuild_changes_belief_and_keeps_the_evidence(memory, capsys, tmp_path):
    new = tmp_path / "new.belief"
    result = answer(capsys, "rebuild", memory, "-o", new, "--set", "alpha=2.0", "--set", "fusion=calibrated")
    assert result["changed"] == {"alpha": 2.0, "fusion": "calibrated"} and result["objects"] == 3
    old, opened = ObjectMemory.open(memory), ObjectMemory.open(new)
    assert opened.parameters.alpha == 2.0 and (opened.evidence.digests == old.evidence.digests).all()
    assert opened.content_hash == result["content_hash"] != old.content_hash
    assert main(["rebuild", str(memory), "-o", str(new)]) == 1
    assert "--force" in capsys.readouterr().err


def test_rebuild_refuses_a_parameter_that_was_settled_while_mapping(memory, capsys, tmp_path):
    assert main(["rebuild", str(memory), "-o", str(tmp_path / "new.belief"), "--set", "voxel_m=0.05"]) == 1
    assert capsys.readouterr().err.count("\n") == 1 and not (tmp_path / "new.belief").exists()


@pytest.mark.parametrize("change", ["alpha=nan", "beta=1", "alpha", "alpha=high", "tau_g=abc", "tau_v=5"])
def test_a_setting_that_is_none_is_wrong_usage(memory, capsys, tmp_path, change):
    with pytest.raises(SystemExit) as ended:
        main(["rebuild", str(memory), "-o", str(tmp_path / "new.belief"), "--set", change])
    assert ended.value.code == 2 and "argument --set: " in capsys.readouterr().err
    assert not (tmp_path / "new.belief").exists()


ROOMS = [{"name": "west", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]


def test_rooms_are_given_to_a_finished_memory_shown_by_query_and_why(memory, capsys, tmp_path):
    (tmp_path / "truth.json").write_text(json.dumps({"format": "openbelief.truth/1", "rooms": ROOMS}))
    new = tmp_path / "new.belief"
    result = answer(capsys, "rebuild", memory, "-o", new, "--rooms", tmp_path / "truth.json")
    assert result["content_hash"] == result["source"]["content_hash"]
    before, now = (answer(capsys, "query", path, "a chair")["candidates"] for path in (memory, new))
    assert [c["room"] for c in before] == [None] * 3
    assert {c["object_id"]: c["room"] for c in now} == {0: "west", 1: None, 2: None}
    assert [c | {"room": None} for c in now] == before
    assert main(["query", str(new), "chair"]) == 0 and " west " in capsys.readouterr().out
    assert main(["why", str(new), "0"]) == 0 and " m in the west, " in capsys.readouterr().out


@pytest.mark.parametrize("said", ["{", "[1]", '{"rooms": 3}', '[{"name": "a", "polygon": [[0, 0]]}]', "{}"])
def test_a_file_without_rooms_is_refused_in_one_line(memory, capsys, tmp_path, said):
    (tmp_path / "rooms.json").write_text(said)
    arguments = ["rebuild", memory, "-o", tmp_path / "new.belief", "--rooms", tmp_path / "rooms.json"]
    assert main([*map(str, arguments)]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert "rooms.json names no rooms" in line and not (tmp_path / "new.belief").exists()


def square(name: str, x_m: float) -> dict:
    return {"name": name, "polygon": [[x_m, -1], [x_m + 2, -1], [x_m + 2, 2], [x_m, 2]]}


def test_rebuild_says_what_other_rooms_change(memory, capsys, tmp_path):
    rooms = tmp_path / "rooms.json"
    rooms.write_text(json.dumps([square("hall", -1), square("study", 2)]))
    result = answer(capsys, "rebuild", memory, "-o", tmp_path / "new.belief", "--rooms", rooms)
    assert result["rooms"] == [{"name": "hall", "objects": 1}, {"name": "study", "objects": 1}]
    assert [(m["object_id"], m["from"], m["to"]) for m in result["moved"]] == [(0, None, "hall"), (1, None, "study")]
    assert main(["rebuild", str(memory), "-o", str(tmp_path / "again.belief"), "--rooms", str(rooms)]) == 0
    assert "hall 1, study 1" in capsys.readouterr().out


def test_rooms_of_another_site_and_none_at_all_are_noticed(memory, capsys, tmp_path):
    rooms, new = tmp_path / "rooms.json", tmp_path / "new.belief"
    for said, words in (([], "its list is empty"), ([square("attic", 500)], "is it of another site?")):
        rooms.write_text(json.dumps(said))
        assert main(["rebuild", str(memory), "-o", str(new), "--rooms", str(rooms)]) == 1
        assert words in capsys.readouterr().err and not new.exists()


def test_the_truth_of_another_site_is_noticed(memory, capsys, tmp_path):
    truth, far = tmp_path / "truth.json", [[100, 100, 0], [101, 101, 1]]
    truth.write_text(
        json.dumps(
            {
                "format": "openbelief.truth/1",
                "objects": [{"id": 1, "label": "red chair", "aabb": far}],
                "queries": [{"query": "red chair", "kind": "direct", "accept": [1]}],
            }
        )
    )
    assert main(["eval", "retrieval", str(memory), str(truth), "--json"]) == 1
    assert "of another site" in capsys.readouterr().err


def test_the_margin_is_over_the_second_candidate_also_where_one_is_shown(memory, capsys):
    one, two = (answer(capsys, "query", memory, "lamp", "--limit", limit) for limit in (1, 2))
    assert len(one["candidates"]) == 1 and one["margin"] == two["margin"] > 0


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


def test_the_curve_of_doubt_is_printed_and_plotted(memory, capsys, tmp_path):
    boxes = [{"id": k, "label": said, "aabb": [[3 * k, 0, 0], [3 * k + 0.1, 0.1, 0.1]]} for k, said in enumerate(SAID)]
    queries = [{"query": "find the lamp", "kind": "direct", "accept": [1]}]
    document = {"format": "openbelief.truth/1", "objects": boxes, "queries": queries, "absent_nouns": ["tuba", "yurt"]}
    truth, picture = tmp_path / "truth.json", tmp_path / "doubt.png"
    truth.write_text(json.dumps(document))
    evaluated = ["eval", "retrieval", str(memory), str(truth)]
    assert main([*evaluated, "--readout", "grounded", "--plot", str(picture)]) == 0
    said = capsys.readouterr().out
    assert "kept: 100% of the findable" in said and "2 absent nouns 100% refused" in said and "found at 0.40:" in said
    assert picture.read_bytes().startswith(b"\x89PNG")
    with pytest.raises(SystemExit, match="2"):
        main([*evaluated, "--plot", str(picture)])  # consensus knows no doubt
    for wrong in (tmp_path / "doubt.txt", tmp_path / "nowhere" / "doubt.png", tmp_path):
        assert main([*evaluated, "--readout", "grounded", "--plot", str(wrong)]) == 1
        assert len(capsys.readouterr().err.splitlines()[-1]) > 10
    document["queries"][0]["findable"] = False
    truth.write_text(json.dumps(document))
    assert main([*evaluated, "--readout", "grounded"]) == 0 and "kept: -" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["query", "missing.belief", "lamp"], "does not exist"),
        (["query", ".", "lamp"], ". is a folder, not a memory"),
        (["rebuild", "{memory}", "-o", "new.belief", "--rooms", "missing.json"], "missing.json cannot be read"),
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


def test_a_plain_question_loads_no_library_that_takes_longer_than_its_answer(memory):
    script = (
        "import sys; from robot_app.cli import main; "
        "main(['query', sys.argv[1], 'red chair next to the lamp in the kitchen']); "
        "print(sorted({'scipy', 'open3d', 'onnxruntime', 'matplotlib', 'rosbags'} & set(sys.modules)))"
    )
    said = subprocess.run([sys.executable, "-c", script, memory], capture_output=True, text=True, check=True).stdout
    assert said.splitlines()[-1] == "[]"


@pytest.mark.parametrize(
    ("stamp_ns", "said"),
    [(0, "0.0 s"), (11_066_666_667, "11.1 s"), (1_780_300_043_733_352_478, "2026-06-01 07:47:23.7 UTC")],
)
def test_a_view_is_told_by_the_time_of_day_where_its_stamp_is_one(stamp_ns, said):
    row = {"object_id": 3, "recording": "walk", "stamp_ns": stamp_ns, "share": 0.5, "picture": "views/a.jpg"}
    assert told([row], "lamp")[1] == f"  walk at {said}: 50% of it -> views/a.jpg"
