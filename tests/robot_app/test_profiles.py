from __future__ import annotations

from pathlib import Path

import pytest

from openbelief.perception.sentence import SentenceEncoder
from robot_app.cli import Failure
from robot_app.perceptions import kind_of, text_encoder_of
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
    assert perception.id.startswith("paper[vlm stand-in-vl, prompt 1 (")
    assert perception.id.count("recorded:walk.perception.jsonl@") == 2
    assert isinstance(text_encoder_of(f"paper:{profile}"), SentenceEncoder)


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
    "bad endpoint": ("http://", "", "endpoint should be http"),
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
