"""The recorder: what was written is read back, nothing is overwritten, files are whole by themselves."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from mcap.reader import make_reader
from pydantic import BaseModel
from rosbags.highlevel import AnyReader

from drivers.ros.messages import WireError, encode, header, make
from logs.mcap_io.reader import LogReader
from logs.mcap_io.recover import recover
from logs.record.recorder import LATCHED, McapRecorder, Rotation
from support.clocks import HandClock
from support.words import STRING, said, word

NOW_NS = 1_000_000_000_000
TF = "tf2_msgs/msg/TFMessage"


class Verdict(BaseModel):
    object_id: int
    reason: str
    score: float | None = None


def test_what_was_written_is_read_back_with_its_stamps(tmp_path: Path) -> None:
    clock = HandClock(NOW_NS)
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder:
        recorder.metadata("run", {"commit": "abc", "operator": "Zoë"})
        recorder.write_cdr("/words", STRING, 5, word("one"))
        clock.sleep(1.0)
        recorder.write_json("/openbelief/verdict", Verdict(object_id=7, reason="wrong\nthing"), 6)
        recorder.attach("robot.toml", "application/toml", b"speed = 1\n")
    log = LogReader(tmp_path / "a.mcap")
    first, second = log
    assert (first.topic, first.type_name, first.encoding, first.stamp_ns) == ("/words", STRING, "cdr", 5)
    assert second.log_time_ns - first.log_time_ns == 1_000_000_000
    assert Verdict.model_validate(second.json()) == Verdict(object_id=7, reason="wrong\nthing")
    assert log.metadata() == {"run": {"commit": "abc", "operator": "Zoë"}}
    assert [(a.name, a.media_type, a.data) for a in log.attachments()] == [
        ("robot.toml", "application/toml", b"speed = 1\n")
    ]
    assert log.topics() == {"/words": STRING, "/openbelief/verdict": "openbelief/Verdict"}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.mcap"]


def test_json_records_carry_the_schema_that_describes_them(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS)) as recorder:
        recorder.write_json("/openbelief/verdict", Verdict(object_id=7, reason="far"), 6)
    with (tmp_path / "a.mcap").open("rb") as file:
        [(schema, channel, message)] = make_reader(file, validate_crcs=True).iter_messages()
    assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
    assert json.loads(schema.data)["properties"].keys() == json.loads(message.data).keys()


def test_rosbags_opens_the_file_and_decodes_nested_types(tmp_path: Path) -> None:
    image = make("sensor_msgs/msg/CameraInfo", header=header(17, "camera"), width=640, height=480)
    transform = make("geometry_msgs/msg/TransformStamped", header=header(18, "map"), child_frame_id="base_link")
    with McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS)) as recorder:
        recorder.write_cdr("/camera_info", "sensor_msgs/msg/CameraInfo", 17, encode(image))
        recorder.write_cdr("/tf_static", TF, 18, encode(make(TF, transforms=[transform])))
    with AnyReader([tmp_path / "a.mcap"]) as bag:
        decoded = {c.topic: bag.deserialize(data, c.msgtype) for c, _, data in bag.messages()}
        durability = {c.topic: c.ext.offered_qos_profiles[0].durability.name for c in bag.connections}
    assert decoded["/camera_info"].width == 640
    assert decoded["/tf_static"].transforms[0].child_frame_id == "base_link"
    assert durability == {"/camera_info": "VOLATILE", "/tf_static": "TRANSIENT_LOCAL"}


def test_log_times_never_run_backwards_when_the_clock_does(tmp_path: Path) -> None:
    clock = HandClock(NOW_NS)
    with McapRecorder(tmp_path / "a.mcap", clock) as recorder:
        for step_s in (1.0, -3600.0, 1.0):
            clock.sleep(step_s)
            recorder.write_cdr("/words", STRING, 5, word("x"))
    times = [m.log_time_ns for m in LogReader(tmp_path / "a.mcap")]
    assert times == sorted(times)


def test_an_unknown_type_is_refused_and_the_recording_goes_on(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS)) as recorder:
        with pytest.raises(WireError, match="No definition of no_such/msg/Type"):
            recorder.write_cdr("/x", "no_such/msg/Type", 1, b"")
        recorder.write_cdr("/words", STRING, 5, word("on"))
    assert said(tmp_path / "a.mcap") == ["on"]


def test_a_message_too_big_for_any_reader_is_refused_by_name(tmp_path: Path) -> None:
    with (
        McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS)) as recorder,
        pytest.raises(ValueError, match="message on /words has 33554433 bytes"),
    ):
        recorder.write_cdr("/words", STRING, 5, bytes((32 << 20) + 1))


def test_a_recording_is_never_overwritten(tmp_path: Path) -> None:
    for name in ("a.mcap", "b.mcap.partial"):
        (tmp_path / name).write_bytes(b"evidence")
    for name in ("a.mcap", "b.mcap"):
        recorder = McapRecorder(tmp_path / name, HandClock(NOW_NS))
        with pytest.raises(FileExistsError, match="never overwritten"), recorder:
            pass
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {
        "a.mcap": b"evidence",
        "b.mcap.partial": b"evidence",
    }


@pytest.mark.parametrize(
    ("left", "sentence"),
    [
        ("walk_002.mcap", "walk_002.mcap exists, and this recording would go on under such names: move it away"),
        ("walk_1000.mcap.partial", "walk_1000.mcap.partial exists, and this recording would go on"),
        ("walk.events.jsonl", "walk.events.jsonl exists: the events of an earlier recording of that name. Move it"),
    ],
)
def test_what_an_old_recording_left_in_the_way_is_refused_by_name_before_anything_is_written(
    tmp_path: Path, left: str, sentence: str
) -> None:
    (tmp_path / left).write_bytes(b"evidence")
    with (
        pytest.raises(FileExistsError, match=sentence),
        McapRecorder(tmp_path / "walk.mcap", HandClock(NOW_NS), rotation=Rotation()),
    ):
        pass
    assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == {left: b"evidence"}


def test_a_file_that_appears_meanwhile_is_passed_over_and_neither_lost_nor_the_end(tmp_path: Path) -> None:
    clock = HandClock(NOW_NS)
    with McapRecorder(tmp_path / "walk.mcap", clock, rotation=Rotation(every_s=10.0)) as recorder:
        for k in range(4):
            recorder.write_cdr("/words", STRING, k, word(str(k)))
            (tmp_path / "walk_002.mcap").write_bytes(b"evidence")
            clock.sleep(11.0)
    assert [p.name for p in recorder.paths] == ["walk.mcap", "walk_001.mcap", "walk_003.mcap", "walk_004.mcap"]
    assert [w for path in recorder.paths for w in said(path)] == list("0123")
    assert (tmp_path / "walk_002.mcap").read_bytes() == b"evidence"


def test_a_missing_folder_is_told_with_the_remedy(tmp_path: Path) -> None:
    with (
        pytest.raises(FileNotFoundError, match="nowhere is no folder: make it"),
        McapRecorder(tmp_path / "nowhere" / "a.mcap", HandClock(NOW_NS)),
    ):
        pass


def test_a_recorder_that_was_not_started_says_so(tmp_path: Path) -> None:
    recorder = McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS))
    assert recorder.state == "idle" and not list(tmp_path.iterdir())
    with pytest.raises(ValueError, match="not started"):
        recorder.write_cdr("/words", STRING, 5, word("x"))


def test_threads_may_write_at_once_and_nothing_is_lost(tmp_path: Path) -> None:
    with McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS)) as recorder:

        def write(who: int) -> None:
            for k in range(200):
                recorder.write_cdr(f"/words_{who}", STRING, k, word(f"{who} {k}"))

        threads = [threading.Thread(target=write, args=(who,)) for who in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    stamps: dict[str, list[int]] = {}
    for message in LogReader(tmp_path / "a.mcap"):
        stamps.setdefault(message.topic, []).append(message.stamp_ns)
    assert stamps == {f"/words_{who}": list(range(200)) for who in range(4)}


def test_every_file_of_a_rotated_recording_stands_alone(tmp_path: Path) -> None:
    clock = HandClock(NOW_NS)
    transform = make("geometry_msgs/msg/TransformStamped", header=header(18, "base"), child_frame_id="camera")
    static = encode(make(TF, transforms=[transform]))
    with McapRecorder(tmp_path / "walk.mcap", clock, rotation=Rotation(every_s=10.0)) as recorder:
        recorder.metadata("run", {"id": "1"})
        recorder.attach("mount.toml", "application/toml", b"x = 1", calibration=True)
        recorder.write_cdr("/tf_static", TF, 3, static)
        for k in range(5):
            clock.sleep(5.0)
            recorder.write_cdr("/words", STRING, k, word(str(k)))
    assert [p.name for p in recorder.paths] == ["walk.mcap", "walk_001.mcap", "walk_002.mcap"]
    assert [w for path in recorder.paths for w in said(path)] == list("01234")
    for path in recorder.paths:
        log = LogReader(path)
        assert [(m.stamp_ns, m.payload) for m in log.messages({"/tf_static"})] == [(3, static)]
        assert log.metadata()["run"] == {"id": "1"}
        assert [a.data for a in log.attachments()] == [b"x = 1"]


def test_the_size_too_begins_a_new_file(tmp_path: Path) -> None:
    noise = os.urandom(60_000).hex()
    with McapRecorder(tmp_path / "a.mcap", HandClock(NOW_NS), rotation=Rotation(every_bytes=100_000)) as recorder:
        for k in range(6):
            recorder.write_cdr("/words", STRING, k, word(noise))
            recorder.flush()
    assert len(recorder.paths) > 1
    assert sum(len(said(path)) for path in recorder.paths) == 6


def test_only_the_newest_map_is_kept_for_the_next_file(tmp_path: Path) -> None:
    clock = HandClock(NOW_NS)
    with McapRecorder(tmp_path / "a.mcap", clock, rotation=Rotation(every_s=10.0)) as recorder:
        for k in range(3):
            recorder.write_cdr("/map", STRING, k, word(f"map {k}"))
        clock.sleep(11.0)
        recorder.write_cdr("/words", STRING, 9, word("next"))
    assert LATCHED["/map"] == 1
    assert [m.stamp_ns for m in LogReader(recorder.paths[1]).messages({"/map"})] == [2]


@pytest.mark.parametrize("parts", [(), ("message",), ("metadata",), ("attachment",), ("message", "recover")], ids=str)
def test_an_independent_doctor_passes_a_recording_whatever_it_lacks(tmp_path: Path, parts: tuple[str, ...]) -> None:
    path = tmp_path / "a.mcap"
    with McapRecorder(path, HandClock(NOW_NS)) as recorder:
        if "message" in parts:
            recorder.write_cdr("/words", STRING, 5, word("one"))
        if "metadata" in parts:
            recorder.metadata("run", {"commit": "abc"})
        if "attachment" in parts:
            recorder.attach("robot.toml", "application/toml", b"x = 1")
    if "recover" in parts:
        recover(path, tmp_path / "b.mcap", lambda share: None)
        path = tmp_path / "b.mcap"
    doctor = Path(sys.executable).with_name("pymcap-cli")
    done = subprocess.run([doctor, "doctor", path, "--format", "jsonl"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
