"""`openbelief map --perception paper:PROFILE.toml`: the real pipeline, a model server in a process of its own."""

from __future__ import annotations

import json
import os
import threading
from collections import Counter
from pathlib import Path

import pytest

from drivers.clock import SystemClock
from logs.frames.reader import FrameReader
from openbelief.mapping import map_frames
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.sentence import SentenceEncoder
from openbelief.perception.vlm_prompt import PROMPT
from openbelief.store import BeliefStore
from robot_app.cli import main
from robot_app.profiles import open_profile
from sim_fakes.wire.recorded_answers import recorded_answers

RECORDINGS = Path(__file__).resolve().parents[3].parent / "shared" / "recordings"
FRAMES = 8


@pytest.fixture
def walk(make_walk, tmp_path) -> Path:
    made = make_walk(FRAMES)
    made.write_perception(tmp_path / "masks.jsonl")
    return made.write(tmp_path / "walk.mcap")


@pytest.fixture
def answers(walk) -> dict[str, str]:
    return recorded_answers(walk, walk.parent / "masks.jsonl")


def profile(folder: Path, endpoint: str, masks: str = "masks.jsonl", **vlm: object) -> str:
    path = folder / "profile.toml"
    lines = [f'segmenter = "recorded:{masks}"', f'encoder = "recorded:{masks}"', "[vlm]", f'endpoint = "{endpoint}"']
    lines += ['model = "stand-in-vl"', *(f"{key} = {value}" for key, value in vlm.items())]
    path.write_text("\n".join(lines))
    return f"paper:{path}"


def mapped(walk: Path, spec: str, capsys, out: str = "site.belief") -> dict:
    assert main(["map", str(walk), "--perception", spec, "-o", str(walk.parent / out), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def one_by_one(walk: Path, spec: str) -> str:
    """The content hash when every frame goes through every stage before the next is read."""
    perception, _ = open_profile(spec.partition(":")[2], SystemClock(), print)
    encoder, path = SentenceEncoder(), walk.parent / "sequential.belief"
    store = BeliefStore.create(
        path, text_encoder_id=encoder.id, text_dim=512, parameters=Parameters(), feature_text_aligned=False, about={}
    )
    return map_frames(FrameReader(walk), perception, store, encoder).content_hash


def test_side_by_side_gives_the_same_memory_as_one_by_one(walk, answers, start_vlm, tmp_path, capsys):
    server = start_vlm(answers=answers)
    spec = profile(tmp_path, server.endpoint)
    report = mapped(walk, spec, capsys)
    assert (report["frames"], report["objects"], report["frames_unseen"]) == (FRAMES, 3, {})
    assert report["content_hash"] == one_by_one(walk, spec)
    assert {"read", "phrases", "segments", "features", "acquire", "cache"} <= set(report["seconds"])
    assert Counter(server.answered) == dict.fromkeys(answers, 2)  # once by each of the two


def test_the_memory_keeps_the_prompt_and_the_model(walk, answers, start_vlm, tmp_path, capsys):
    mapped(walk, profile(tmp_path, start_vlm(answers=answers).endpoint), capsys)
    about = ObjectMemory.open(tmp_path / "site.belief").about
    assert about["perception_about"][0]["phrases"]["prompt"] == PROMPT
    assert about["perception"][0].startswith("paper[vlm stand-in-vl, prompt 2 (")


def test_a_server_that_dies_and_comes_back_loses_nothing(walk, answers, start_vlm, tmp_path, capsys):
    whole = mapped(walk, profile(tmp_path, start_vlm(answers=answers).endpoint), capsys, "whole.belief")
    server = start_vlm(answers=answers, behave="ok|ok|ok|die")
    spec = profile(tmp_path, server.endpoint)
    nurse = threading.Thread(target=server.restart_when_dead)
    nurse.start()
    report = mapped(walk, spec, capsys)
    nurse.join()
    assert report["content_hash"] == whole["content_hash"] and report["frames"] == FRAMES
    assert Counter(server.answered) == dict.fromkeys(answers, 1)  # nothing was computed twice


def test_when_patience_ends_the_same_command_goes_on_later(walk, answers, start_vlm, tmp_path, capsys):
    whole = mapped(walk, profile(tmp_path, start_vlm(answers=answers).endpoint), capsys, "whole.belief")
    server = start_vlm(answers=answers, behave="ok|ok|ok|ok|die")
    spec = profile(tmp_path, server.endpoint, patience_s=0, concurrency=2)
    command = ["map", str(walk), "--perception", spec, "-o", str(tmp_path / "site.belief")]
    assert main(command) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert "cannot be reached" in error and error.endswith("run the same command again to go on.")
    assert main(command) == 1  # not back yet
    assert "cannot be reached" in capsys.readouterr().err.splitlines()[-1]
    server.restart()
    report = mapped(walk, spec, capsys)
    assert report["content_hash"] == whole["content_hash"]
    assert Counter(server.answered) == dict.fromkeys(answers, 1)


def test_a_frame_without_a_usable_reply_is_kept_as_skipped_with_its_reason(walk, answers, start_vlm, tmp_path, capsys):
    server = start_vlm(answers=answers, behave="|".join(["ok"] * 3 + ["say:%%%"] * 3))
    spec = profile(tmp_path, server.endpoint, concurrency=1)
    reason = "no phrases: The reply of stand-in-vl cannot be used: there is no phrase in it."
    assert mapped(walk, spec, capsys)["frames_unseen"] == {reason: 1}
    assert [f.skipped for f in ObjectMemory.open(tmp_path / "site.belief").frames if f.skipped] == [reason]


@pytest.mark.parametrize(
    ("options", "words"),
    [({"model": "other-vl"}, "serves other-vl, not stand-in-vl"), ({"key": "secret"}, "refuses our key")],
)
def test_a_wrong_server_is_refused_before_anything_is_written(options, words, walk, start_vlm, tmp_path, capsys):
    spec = profile(tmp_path, start_vlm(**options).endpoint)
    assert main(["map", str(walk), "--perception", spec, "-o", str(tmp_path / "site.belief")]) == 1
    assert words in capsys.readouterr().err
    assert not list(tmp_path.glob("site.belief*"))


@pytest.mark.recordings
def test_part_of_the_apartment_through_a_model_server(start_vlm, tmp_path, capsys):
    recording, masks = RECORDINGS / "apartment.mcap", RECORDINGS / "apartment.perception.jsonl"
    if not (recording.is_file() and masks.is_file()):
        pytest.skip("the shared recordings folder is not beside the checkout")
    server = start_vlm(recording=recording, perception=masks, stride=20)
    spec = profile(tmp_path, server.endpoint, masks=os.fspath(masks))
    arguments = [os.fspath(recording), "--stride", "20", "--json"]
    hashes = {}
    for name, perception in (("paper", spec), ("recorded", f"recorded:{masks}")):
        out = os.fspath(tmp_path / f"{name}.belief")
        assert main(["map", *arguments, "--perception", perception, "-o", out]) == 0
        hashes[name] = json.loads(capsys.readouterr().out)
    assert len(server.answered) == hashes["paper"]["frames"] == hashes["recorded"]["frames"] == 10
    # Doubles of a mask under one phrase are suppressed now; nothing else is lost on the way through the server.
    kept = hashes["paper"]["observations"] / hashes["recorded"]["observations"]
    assert 0.95 < kept <= 1.0
