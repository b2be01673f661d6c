from __future__ import annotations

import dataclasses
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drivers.ros.messages import header
from openbelief.memory import ObjectMemory
from openbelief.run_lengths import encode_rle
from openbelief.store import BeliefStore
from robot_app.cli import main
from robot_app.mapping.report import alarm_lines

COLOR = "/camera/color/image_raw/compressed"
RECORDINGS = Path(__file__).resolve().parents[3].parent / "shared" / "recordings"

# A perception that plays a file back, notes every frame it looks at, and kills its own process on the way.
MORTAL = """
import os, signal, sys
from pathlib import Path
import numpy as np
from openbelief.perception.recorded import RecordedPerception
from openbelief.store import BeliefStore
from robot_app.mapping.job import MapJob
from robot_app.mapping.run import run_map
from robot_app.perceptions import KINDS, PerceptionKind
from robot_app.progress_lines import LineProgress

walks, out, log, where, number = sys.argv[1:]
walks = [Path(walk) for walk in walks.split(os.pathsep)]
count = 0
def die(at):
    global count
    count += at == where
    if at == where and count == int(number):
        os.kill(os.getpid(), signal.SIGKILL)

class Mortal(RecordedPerception):
    def perceive(self, frame):
        die("perceive")
        with open(log, "a") as file:
            file.write(f"{frame.stamp_ns}\\n")
        return super().perceive(frame)

class Words:
    id, dim = "words", 4
    def encode(self, texts):
        return np.array([np.eye(4)[len(t) % 4] for t in texts], np.float32)

keep = BeliefStore.add_frame
def add_frame(self, *args, **kwargs):
    die("keep")
    keep(self, *args, **kwargs)
BeliefStore.add_frame = add_frame
KINDS["mortal"] = PerceptionKind(lambda path, *_: Mortal(path), "FILE", expensive=True)
job = MapJob(walks, Path(out), [f"mortal:{walk.with_suffix('.perception.jsonl')}" for walk in walks])
result = run_map(job, Words(), LineProgress())
print(result.memory.content_hash, result.taken, [reader.skipped for reader in result.readers])
"""


def stamp_of(message) -> int | None:
    head = getattr(message, "header", None)
    return head.stamp.sec * 1_000_000_000 + head.stamp.nanosec if head else None


def run_mortal(walks, out, log, where="nowhere", number=0) -> subprocess.CompletedProcess:
    joined = os.pathsep.join(map(str, walks))
    command = [sys.executable, "-c", MORTAL, *map(str, (joined, out, log, where, number))]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)


class Words:
    """A text encoder that loads in no time."""

    id, dim = "words", 4

    def encode(self, texts):
        return np.array([np.eye(4)[len(text) % 4] for text in texts], np.float32)


@pytest.fixture
def words(monkeypatch) -> None:
    """The verb's encoder replaced by one that loads in no time."""
    monkeypatch.setattr("openbelief.perception.sentence.SentenceEncoder", Words)


@pytest.fixture
def walk(make_walk, words, tmp_path) -> Path:
    """A walk of 6 frames, its perception beside it, named as `map` looks for it."""
    made = make_walk(6)
    made.write_perception(tmp_path / "walk.perception.jsonl")
    return made.write(tmp_path / "walk.mcap")


@pytest.mark.parametrize("where", ["perceive", "keep"])
def test_a_mapping_killed_in_the_middle_resumes_to_the_same_memory_and_never_perceives_twice(walk, tmp_path, where):
    whole = run_mortal([walk], tmp_path / "whole.belief", tmp_path / "whole.log")
    assert whole.returncode == 0, whole.stderr
    killed = run_mortal([walk], tmp_path / "site.belief", tmp_path / "site.log", where, 4)
    assert killed.returncode == -signal.SIGKILL and not (tmp_path / "site.belief").exists()
    with BeliefStore.resume(tmp_path / "site.belief.partial") as store:
        assert len(store.frames()) == 3
    resumed = run_mortal([walk], tmp_path / "site.belief", tmp_path / "site.log")
    assert resumed.returncode == 0, resumed.stderr
    assert resumed.stdout == whole.stdout  # the content hash and the counts
    looked_at = (tmp_path / "site.log").read_text().split()
    assert len(looked_at) == 6 and looked_at == (tmp_path / "whole.log").read_text().split()
    assert not (tmp_path / "site.belief.partial").exists()


@pytest.mark.parametrize("number", [3, 6])  # in the first walk, and in the second
def test_a_resumed_mapping_reports_the_counts_of_an_uninterrupted_one(make_walk, tmp_path, number):
    """Masks refused, pictures that would not decode and ones without depth are counted over all runs."""
    walks = []
    for name, count in (("a", 5), ("b", 6)):
        made = make_walk(count)
        speck = np.zeros((120, 160), bool)
        speck[:3, :3] = True
        first = made.masks[0]
        made.masks.insert(1, first | {"mask_index": 9, "rle": encode_rle(speck)})
        made.drop("/camera/depth/image_rect_raw", made.stamps[2])
        _, _, picture = next(m for m in made.messages if m[0] == COLOR and stamp_of(m[2]) == made.stamps[1])
        broken = dataclasses.replace(picture, data=np.frombuffer(b"no jpeg", np.uint8))
        made.replace(COLOR, made.stamps[1], broken)
        made.write_perception(tmp_path / f"{name}.perception.jsonl")
        walks.append(made.write(tmp_path / f"{name}.mcap"))
    whole = run_mortal(walks, tmp_path / "whole.belief", tmp_path / "whole.log")
    assert whole.returncode == 0, whole.stderr
    assert "'mask smaller than 100 pixels': 2" in whole.stdout and "Taken(frames=7, masks=" in whole.stdout
    killed = run_mortal(walks, tmp_path / "site.belief", tmp_path / "site.log", "keep", number)
    assert killed.returncode == -signal.SIGKILL
    resumed = run_mortal(walks, tmp_path / "site.belief", tmp_path / "site.log")
    assert resumed.returncode == 0, resumed.stderr
    assert resumed.stdout == whole.stdout


def test_a_walk_becomes_a_memory_with_a_report(walk, tmp_path, capsys):
    assert main(["map", str(walk), "-o", str(tmp_path / "site.belief"), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["frames"], report["objects"], report["recordings"][0]["skipped"]) == (6, 3, {})
    memory = ObjectMemory.open(tmp_path / "site.belief")
    assert sorted(node.concepts[0].label for node in memory.objects) == ["blue box", "green box", "red box"]
    red = next(node for node in memory.objects if node.concepts[0].label == "red box")
    # The camera stands 0.1 m ahead of the base; the boxes' faces are 1.6 m before it, the red one at y = -0.5 m.
    assert red.centroid == pytest.approx([1.7, -0.5, 1.0], abs=0.04)
    assert report["content_hash"] == memory.content_hash
    assert set(report["seconds"]) == {"read", "perceive", "acquire", "keep", "build", "seal"}
    assert report["seconds"]["build"] > 0 and report["seconds"]["seal"] > 0


def alarmed(walk, tmp_path, capsys, *more: str) -> str:
    """What `map` prints where every thing over 0.2 m counts as suspiciously long."""
    (tmp_path / "strict.toml").write_text("extent_alarm_m = 0.2\n")
    arguments = ["map", str(walk), "-o", str(tmp_path / "site.belief"), "--parameters", str(tmp_path / "strict.toml")]
    assert main([*arguments, "--force", *more]) == 0
    return capsys.readouterr().out


def test_objects_longer_than_their_views_explain_are_named(walk, tmp_path, capsys):
    [blue, *_] = [line for line in alarmed(walk, tmp_path, capsys).splitlines() if "(blue box)" in line]
    assert "may be several things: 0.3 m long, over 0.2 m" in blue
    alarms = json.loads(alarmed(walk, tmp_path, capsys, "--json"))["extent_alarms"]
    assert {alarm["label"] for alarm in alarms} == {"red box", "green box", "blue box"}
    assert all(alarm["extent_m"] > 0.2 for alarm in alarms)


def test_walls_are_long_by_nature_and_not_named(make_walk, words, tmp_path, capsys):
    made = make_walk(6)
    for mask in made.masks:
        mask["phrase"] = mask["phrase"].replace("blue box", "wall")
    made.write_perception(tmp_path / "walk.perception.jsonl")
    printed = alarmed(made.write(tmp_path / "walk.mcap"), tmp_path, capsys)
    assert "(red box) may be" in printed and "(wall)" not in printed


def test_of_many_long_objects_five_are_printed_and_the_others_counted():
    alarms = [{"object_id": i, "label": "sofa\x1b[2J", "extent_m": 5.0, "because": "5.0 m long"} for i in range(7)]
    lines = alarm_lines(alarms)
    assert len(lines) == 6 and lines[-1].startswith("and 2 more") and not any("\x1b" in line for line in lines)


def test_what_was_skipped_is_printed_with_its_reason_and_kept_in_the_memory(make_walk, words, tmp_path, capsys):
    made = make_walk(6)
    made.write_perception(tmp_path / "walk.perception.jsonl")
    made.drop("/camera/depth/image_rect_raw", made.stamps[2])
    path = made.write(tmp_path / "walk.mcap")
    assert main(["map", str(path), "-o", str(tmp_path / "site.belief")]) == 0
    assert "skipped 1 x no depth image at its stamp (first: image 2: No depth image within" in capsys.readouterr().out
    skipped = [f for f in ObjectMemory.open(tmp_path / "site.belief").frames if f.skipped]
    assert [f.stamp_ns for f in skipped] == [made.stamps[2]]


def late_depth(made) -> None:
    """A depth camera whose images come 16 ms after the colour's."""
    for topic, _, message in made.messages:
        if topic == "/camera/depth/image_rect_raw":
            stamp = message.header.stamp
            message.header = header(stamp.sec * 10**9 + stamp.nanosec + 16_000_000, message.header.frame_id)


@pytest.mark.parametrize("option", ["--pair-tolerance-s=0.02", "--depth-offset-s=0.016"])
def test_depth_that_comes_late_is_refused_with_the_option_that_maps_it(make_walk, words, tmp_path, capsys, option):
    made = make_walk(6)
    made.write_perception(tmp_path / "walk.perception.jsonl")
    late_depth(made)
    command = ["map", str(made.write(tmp_path / "walk.mcap")), "-o", str(tmp_path / "site.belief")]
    assert main(command) == 1
    refused = capsys.readouterr().err
    assert "+16.0 ms away" in refused and option.split("=")[0] in refused
    assert main([*command, option]) == 0
    assert len([f for f in ObjectMemory.open(tmp_path / "site.belief").frames if not f.skipped]) == 6


@pytest.mark.parametrize("value", ["nan", "-1", "soon"])
def test_a_tolerance_that_is_no_time_is_wrong_usage(walk, tmp_path, value):
    with pytest.raises(SystemExit) as ended:
        main(["map", str(walk), "-o", str(tmp_path / "site.belief"), f"--pair-tolerance-s={value}"])
    assert ended.value.code == 2


def test_what_a_person_should_know_is_told_and_kept_in_the_report(make_walk, words, tmp_path, capsys):
    """A walk played twice into one file."""
    made = make_walk(6)
    made.write_perception(tmp_path / "walk.perception.jsonl")
    made.messages += [(topic, at + 10_000_000_000, message) for topic, at, message in made.messages]
    path = made.write(tmp_path / "walk.mcap")
    assert main(["map", str(path), "-o", str(tmp_path / "site.belief"), "--json"]) == 0
    said = capsys.readouterr()
    assert "clock was set back by" in said.err
    assert any("clock was set back" in note for note in json.loads(said.out)["recordings"][0]["notes"])


def test_a_truncated_recording_is_mapped_as_far_as_it_goes_and_said_to_be_damaged(make_walk, words, tmp_path, capsys):
    made = make_walk(12)
    made.write_perception(tmp_path / "walk.perception.jsonl")
    path = made.write(tmp_path / "walk.mcap")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert main(["map", str(path), "-o", str(tmp_path / "site.belief")]) == 0
    printed = capsys.readouterr().out
    assert "is damaged: the file ends in the middle of a record" in printed
    assert 0 < len(ObjectMemory.open(tmp_path / "site.belief").frames) < 12


def test_two_walks_become_one_memory_however_many_frames_are_acquired_at_once(make_walk, words, tmp_path, capsys):
    paths = []
    for name, count in (("a", 4), ("b", 6)):
        made = make_walk(count)
        made.write_perception(tmp_path / f"{name}.perception.jsonl")
        paths.append(str(made.write(tmp_path / f"{name}.mcap")))
    reports = []
    for jobs in ("1", "2"):
        assert main(["map", *paths, "-o", str(tmp_path / f"{jobs}.belief"), "--jobs", jobs, "--json"]) == 0
        out, err = capsys.readouterr()
        assert "a.mcap: 4 of 4 frames" in err and "b.mcap: 6 of 6 frames" in err
        reports.append(json.loads(out))
    one, two = reports
    assert (one["frames"], one["objects"]) == (10, 3)
    told_alike = set(one) - {"memory", "seconds"}
    assert {key: one[key] for key in told_alike} == {key: two[key] for key in told_alike}
    assert two["seconds"]["acquire"] > 0


def test_a_partial_file_is_resumed_by_the_same_job_only(make_walk, walk, tmp_path, capsys, monkeypatch):
    out = tmp_path / "site.belief"
    with monkeypatch.context() as patch:  # an interruption while the memory is built
        patch.setattr("openbelief.memory.associate", lambda *_, **__: (_ for _ in ()).throw(KeyboardInterrupt))
        assert main(["map", str(walk), "-o", str(out)]) == 130
    (tmp_path / "p.toml").write_text("alpha = 0.25\n")
    assert main(["map", str(walk), "-o", str(out), "--parameters", str(tmp_path / "p.toml")]) == 1
    error = capsys.readouterr().err.splitlines()[-1]
    assert "site.belief.partial was begun with other parameters: repeat" in error and "or delete it" in error
    make_walk(6).write_perception(tmp_path / "other.jsonl", note="another")
    assert main(["map", str(walk), "-o", str(out), "--perception", f"recorded:{tmp_path / 'other.jsonl'}"]) == 1
    assert "begun with other perception:" in capsys.readouterr().err
    assert main(["map", str(walk), "-o", str(out), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert (report["frames"], report["frames_resumed"]) == (6, 6)


REFUSED = [
    (["{tmp}/nothing.mcap", "--perception", "recorded:{tmp}/walk.perception.jsonl"], "nothing.mcap is not there"),
    (["{tmp}/nothing.mcap"], "nothing.mcap is not there"),
    (["{tmp}/walk.mcap", "--rooms", "{tmp}/no.json"], "no.json cannot be read"),
    (["{tmp}/walk.mcap", "--perception", "recorded:{tmp}/no.jsonl"], "no.jsonl cannot be read"),
    (["{tmp}/walk.mcap", "{tmp}/walk.mcap"], "named twice"),
    (["{tmp}/walk.mcap", "--map-frame", "world"], "gives no frame: 6 x no transform to the map"),
    (["{tmp}/walk.mcap", "--parameters", "{tmp}/no.toml"], "no.toml"),
    (["{tmp}/walk.mcap", "--color-topic", "/rear"], "no colour topic '/rear'"),
]


@pytest.mark.parametrize(("arguments", "said"), REFUSED)
def test_wrong_input_is_refused_in_one_line_and_leaves_nothing_behind(walk, tmp_path, capsys, arguments, said):
    arguments = [argument.format(tmp=tmp_path) for argument in arguments]
    assert main(["map", *arguments, "-o", str(tmp_path / "site.belief")]) == 1
    assert said in capsys.readouterr().err.splitlines()[-1]
    assert not list(tmp_path.glob("site.belief*"))


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--perception", "clip:x"], "argument --perception: should be recorded:FILE.jsonl"),
        (["--perception", "bogus"], "argument --perception: should be recorded:FILE.jsonl"),
        (["--stride", "0"], "argument --stride: a whole number from 1"),
        (["--jobs", "0"], "argument --jobs: a whole number from 1"),
        (["--perception", "recorded:a", "--perception", "recorded:b"], "Give one --perception, or one for each"),
    ],
)
def test_wrong_usage_exits_2_and_leaves_nothing_behind(walk, tmp_path, capsys, arguments, said):
    with pytest.raises(SystemExit) as ended:
        main(["map", str(walk), *arguments, "-o", str(tmp_path / "site.belief")])
    assert ended.value.code == 2 and said in capsys.readouterr().err
    assert not list(tmp_path.glob("site.belief*"))


def test_a_walk_is_mapped_into_rooms_and_the_content_hash_does_not_change_by_them(walk, tmp_path, capsys):
    rooms = [{"name": name, "polygon": [[1, y], [3, y], [3, y + 1], [1, y + 1]]} for name, y in (("a", -1), ("b", 9))]
    (tmp_path / "rooms.json").write_text(json.dumps(rooms))
    reports = []
    for more in ([], ["--rooms", str(tmp_path / "rooms.json")]):
        assert main(["map", str(walk), "-o", str(tmp_path / "site.belief"), "--force", "--json", *more]) == 0
        reports.append(json.loads(capsys.readouterr().out))
    assert reports[0]["content_hash"] == reports[1]["content_hash"]
    assert reports[0]["rooms"] == [{"name": None, "objects": 3}]
    assert [(room["name"], room["objects"]) for room in reports[1]["rooms"]] == [("a", 1), ("b", 0), (None, 2)]
    placed = {node.label: node.room for node in ObjectMemory.open(tmp_path / "site.belief").objects}
    assert placed == {"red box": "a", "green box": None, "blue box": None}


def test_an_existing_memory_is_not_overwritten_unless_told_to(walk, tmp_path, capsys):
    out = tmp_path / "site.belief"
    out.write_text("precious")
    assert main(["map", str(walk), "-o", str(out)]) == 1
    assert "--force" in capsys.readouterr().err and out.read_text() == "precious"
    assert main(["map", str(walk), "-o", str(out), "--force"]) == 0
    assert ObjectMemory.open(out).objects


def test_perception_of_another_recording_is_noticed(walk, tmp_path, capsys):
    lines = (tmp_path / "walk.perception.jsonl").read_text().replace('"stamp_ns": ', '"stamp_ns": 7')
    (tmp_path / "other.jsonl").write_text(lines)
    spec = f"recorded:{tmp_path / 'other.jsonl'}"
    assert main(["map", str(walk), "--perception", spec, "-o", str(tmp_path / "site.belief")]) == 1
    assert "no mask for any of its frames; is it of another recording?" in capsys.readouterr().err
    assert not list(tmp_path.glob("site.belief*"))


def test_features_of_another_text_space_are_refused(make_walk, walk, tmp_path, capsys):
    make_walk(6).write_perception(tmp_path / "x.jsonl", feature_text_aligned=True, text_space="MobileCLIP2-S4")
    arguments = ["--perception", f"recorded:{tmp_path / 'x.jsonl'}", "-o", str(tmp_path / "site.belief")]
    assert main(["map", str(walk), *arguments]) == 1
    assert "live in the text space of MobileCLIP2-S4" in capsys.readouterr().err


@pytest.mark.recordings
def test_part_of_the_kitchen_becomes_a_memory(tmp_path, capsys):
    if not (RECORDINGS / "kitchen.mcap").is_file():
        pytest.skip("the shared recordings folder is not beside the checkout")
    out = str(tmp_path / "kitchen.belief")
    assert main(["map", os.fspath(RECORDINGS / "kitchen.mcap"), "--stride", "10", "-o", out, "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["frames"] == 10 and report["objects"] > 5
    labels = {concept.label for node in ObjectMemory.open(out).objects for concept in node.concepts}
    assert any("chair" in label for label in labels)


def test_tau_v_is_of_the_feature_space_and_a_file_wins(tmp_path):
    from openbelief import Parameters
    from robot_app.verbs.map import MOBILENET_TAU_V, _parameters

    assert _parameters(None, []) == _parameters(None, ["scripted:flat"]) == Parameters()
    assert _parameters(None, ["detector:models"]) == Parameters(tau_v=MOBILENET_TAU_V)
    file = tmp_path / "parameters.toml"
    file.write_text("tau_v = 0.9\ntau_g = 0.8\n")
    assert _parameters(file, ["detector:models"]) == Parameters(tau_v=0.9, tau_g=0.8)
