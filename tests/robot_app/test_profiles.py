from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from logs.structured import configure
from openbelief.observation import Intrinsics, RgbdFrame
from openbelief.perception.recorded import RecordedPerception
from openbelief.perception.sentence import SentenceEncoder
from robot_app.cli import Failure
from robot_app.perceptions import kind_of, open_perception, text_encoder_of
from robot_app.profiles import BUILT_IN, load_profile, open_profile

PROFILE = """
segmenter = "recorded:walk.perception.jsonl"
encoder = "recorded:walk.perception.jsonl"
[vlm]
endpoint = "http://127.0.0.1:8000/v1"
model = "stand-in-vl"
"""


class NoClock:
    def now_ns(self) -> int:
        return 0

    def sleep(self, seconds: float) -> None:
        raise AssertionError("nothing to wait for")


@pytest.fixture
def profile(make_walk, tmp_path: Path) -> Path:
    make_walk(2).write_perception(tmp_path / "walk.perception.jsonl")
    path = tmp_path / "profile.toml"
    path.write_text(PROFILE)
    return path


def test_the_built_in_profile_is_the_papers():
    profile, base = load_profile("")
    assert profile.vlm.model == "Qwen/Qwen3-VL-4B-Instruct" and base == Path()
    assert (profile.segmenter.split(":")[0], profile.encoder.split(":")[0]) == ("sam3", "clip")
    assert BUILT_IN.read_text().isascii()


def test_the_argument_of_paper_may_be_left_out_and_that_of_recorded_may_not():
    assert kind_of("paper")[1] == "" and kind_of("paper:x.toml")[1] == "x.toml"
    with pytest.raises(Failure, match=r"should be recorded:FILE.jsonl \| .*paper\[:PROFILE.toml\]"):
        kind_of("recorded")


def test_parts_are_found_beside_the_profile(profile, start_vlm, monkeypatch):
    profile.write_text(PROFILE.replace("http://127.0.0.1:8000/v1", start_vlm().endpoint))
    perception, _ = open_profile(str(profile), NoClock(), print)
    perception.close()
    assert perception.id.startswith("paper[vlm stand-in-vl, prompt 2 (")
    assert perception.id.count("recorded:walk.perception.jsonl@") == 2
    assert isinstance(text_encoder_of(f"paper:{profile}"), SentenceEncoder)


def test_a_mission_gets_the_same_perception_with_its_looks_timed(profile, start_vlm, monkeypatch):
    answer = {"*": "red box\ngreen box\nblue box"}
    profile.write_text(PROFILE.replace("http://127.0.0.1:8000/v1", start_vlm(answers=answer).endpoint))
    stream = io.StringIO()
    configure(NoClock(), stream, json_lines=True)
    perception = open_perception(f"paper:{profile}", SentenceEncoder())
    stamp_ns = min(RecordedPerception(profile.parent / "walk.perception.jsonl").stamps)
    camera = Intrinsics(160, 120, 120.0, 120.0, 79.5, 59.5)
    frame = RgbdFrame(0, stamp_ns, np.zeros((120, 160, 3), np.uint8), np.ones((120, 160)), camera, np.eye(4))
    assert {mask.phrase for mask in perception.perceive(frame)} <= {"red box", "green box", "blue box"}
    line = json.loads(stream.getvalue())
    assert list(line["seconds"]) == ["phrases", "segments", "features"] and line["budget_s"] == 6.0


RECORDED = "recorded:walk.perception.jsonl"
VLM = 'model = "stand-in-vl"'
# What is replaced in the profile, by what, and the words of the refusal.
REFUSED = {
    "no TOML": (VLM, "= =", "cannot be read as TOML"),
    "unknown key": (VLM, f"{VLM}\ncolour = 1", "vlm.colour: unknown key"),
    "no model": (VLM, "", "vlm.model: Field required"),
    "a number out of range": (VLM, f"{VLM}\ntimeout_s = nan", "vlm.timeout_s"),
    "unknown segmenter": (f'segmenter = "{RECORDED}"', 'segmenter = "sam2:x"', "segmenter should be sam3:PATH or"),
    "encoder without a path": (f'encoder = "{RECORDED}"', 'encoder = "clip"', "encoder should be clip:PATH or"),
    "no such recording": (RECORDED, "recorded:talk.jsonl", "talk.jsonl cannot be read"),
    "no such network": (RECORDED, "sam3:nothing", "nothing/model.json is missing"),
    "unknown device": (f'encoder = "{RECORDED}"', f'device = "tpu"\nencoder = "{RECORDED}"', "device: Input should be"),
    "bad endpoint": ("http://", "", "vlm.endpoint: should be http"),
    "key not set": (VLM, f'{VLM}\napi_key_env = "NOT_SET_ANYWHERE"', "NOT_SET_ANYWHERE is not set"),
    "no server": (":8000", ":9", "127.0.0.1:9/v1 cannot be reached"),
}


@pytest.mark.parametrize(("old", "new", "words"), REFUSED.values(), ids=REFUSED)
def test_a_profile_that_cannot_work_is_refused_in_one_line(old, new, words, profile):
    profile.write_text(PROFILE.replace(old, new, 1))
    with pytest.raises(Failure) as refused:
        open_profile(str(profile), NoClock(), print)
    assert words in str(refused.value) and "\n" not in str(refused.value)


def test_a_profile_that_is_not_there_is_named():
    with pytest.raises(Failure, match=r"nowhere\.toml: cannot be read"):
        load_profile("nowhere.toml")
