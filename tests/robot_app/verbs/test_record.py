"""`openbelief record` over simulated sources, a replayed one, a full disk and Ctrl-C: what lies on the disk then."""

from __future__ import annotations

import itertools
import json
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from drivers.ros.messages import decode
from logs.frames.reader import FrameReader
from logs.mcap_io.reader import LogMessage, LogReader
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from openbelief.arrays import Array
from openbelief.g1 import T_BASE_CAMERA, T_BASE_LIDAR
from robot_app.app import open_robot
from robot_app.cli import main
from robot_app.config import load_config
from robot_app.record.monitor import RecordingMonitor, RecordingStatus, StreamStatus
from robot_app.record.recording import RecordingResult, RecordJob, record, start_taps
from robot_app.record.status_line import line
from robot_app.verbs.record import failure_of, story
from support.events import read_events

SENSED = {
    "/camera/color/image_raw/compressed",
    "/camera/aligned_depth_to_color/image_raw",
    "/camera/color/camera_info",
    "/livox/lidar",
    "/livox/imu",
    "/camera/imu",
    "/tf",
    "/tf_static",
    "/map",
}


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("site") / "robot.toml"
    path.write_text("[recording]\nwarn_bytes = 0\nstop_bytes = 0\nevery_s = 2.0\n")
    return path


@pytest.fixture(scope="module")
def walk(config: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three simulated seconds of a walk, in two files."""
    path = tmp_path_factory.mktemp("walk") / "walk.mcap"
    assert main(["record", "-o", str(path), "--config", str(config), "--minutes", "0.05"]) == 0
    return path


def test_every_file_of_a_walk_holds_all_that_a_reader_of_it_alone_needs(walk: Path) -> None:
    files = sorted(walk.parent.iterdir())
    assert [file.name for file in files] == ["walk.mcap", "walk_001.mcap"]
    assert {message.topic for message in LogReader(walk)} == SENSED
    for file in files:
        log = LogReader(file)
        assert {"/tf_static", "/map"} <= set(log.topics())
        about = log.metadata()["openbelief.recording"]
        assert about["commit"] and about["run_id"] and (about["operator"], about["site"]) == ("unknown", "unknown")
        sheets = {attachment.name: attachment.data for attachment in log.attachments()}
        assert set(sheets) == {"robot.toml", "calibration.json"}
        calibration = json.loads(sheets["calibration.json"])
        assert calibration["camera_info"]["/camera/color/camera_info"]["width"] == 640
        assert {mount["child"] for mount in calibration["static_transforms"]} >= {"camera_link", "livox_frame"}
        assert list(FrameReader(file)), f"{file.name} gives no frame"


@pytest.mark.parametrize(("topic", "T_base_imu"), [("/livox/imu", T_BASE_LIDAR), ("/camera/imu", T_BASE_CAMERA)])
def test_each_imu_comes_at_200_hz_and_feels_the_floor_push_upwards(walk: Path, topic: str, T_base_imu: Array) -> None:
    messages = [message for message in LogReader(walk) if message.topic == topic]
    steps_ns = {b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(messages)}
    assert steps_ns == {5_000_000}
    felt = decode(messages[0].payload, "sensor_msgs/msg/Imu").linear_acceleration
    assert T_base_imu[:3, :3] @ [felt.x, felt.y, felt.z] == pytest.approx([0.0, 0.0, 9.81], abs=0.1)


def test_independent_tools_accept_the_recording(walk: Path) -> None:
    doctor = Path(sys.executable).with_name("pymcap-cli")
    for file in walk.parent.iterdir():
        done = subprocess.run(
            [doctor, "doctor", file, "--format", "jsonl"], capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
    with AnyReader(sorted(walk.parent.iterdir())) as bag:
        kinds = {c.msgtype for c, _, payload in bag.messages() if bag.deserialize(payload, c.msgtype)}
    assert {"sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/CompressedImage", "tf2_msgs/msg/TFMessage"} <= kinds


def test_json_tells_what_was_recorded(config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "still.mcap"
    assert main(["record", "-o", str(path), "--config", str(config), "--minutes", "0.02", "--stand", "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["paths"] == [str(path)] and result["dropped"] == 0 and result["failure"] is None
    counted = {name: stream["written"] for name, stream in result["streams"].items() if stream["written"]}
    found: dict[str, int] = {}
    for message in LogReader(path):
        found[message.topic] = found.get(message.topic, 0) + 1
    assert counted == found
    assert 0 < result["coverage"] < 1


def test_a_replayed_recording_is_recorded_again_with_its_poses(walk: Path, tmp_path: Path) -> None:
    config = tmp_path / "robot.toml"
    config.write_text(
        '[ports]\ncamera = "replay"\nlidar = "replay"\npose = "replay"\nmap = "replay"\nnavigator = "sim"\n'
        f'[replay]\nrecording = "{walk}"\n[recording]\nwarn_bytes = 0\nstop_bytes = 0\n'
    )
    again = tmp_path / "again.mcap"
    assert main(["record", "-o", str(again), "--config", str(config), "--minutes", "0.03", "--stand"]) == 0
    [first, *_], [ours, *_] = list(FrameReader(walk)), list(FrameReader(again))
    assert ours.T_map_camera == pytest.approx(first.T_map_camera, abs=1e-6)
    assert (ours.depth_m == first.depth_m).all()
    for topic in ("/livox/imu", "/camera/imu", "/livox/lidar"):
        before, after = of_topic(walk, topic), of_topic(again, topic)
        moved_ns = after[0].stamp_ns - before[0].stamp_ns
        assert len(after) > 2 and [m.stamp_ns - moved_ns for m in after] == [m.stamp_ns for m in before[: len(after)]]
    felt, now = (decode(of_topic(file, "/livox/imu")[9].payload, "sensor_msgs/msg/Imu") for file in (walk, again))
    assert felt.header.frame_id == now.header.frame_id == "livox_frame"
    assert (felt.angular_velocity, felt.linear_acceleration) == (now.angular_velocity, now.linear_acceleration)
    images = {m.stamp_ns for m in of_topic(again, "/camera/aligned_depth_to_color/image_raw")}
    assert images < {m.stamp_ns for m in of_topic(again, "/tf")}, "an image without its pose"


def of_topic(path: Path, topic: str) -> list[LogMessage]:
    return list(LogReader(path).messages({topic}))


def test_who_recorded_where_and_their_notes_are_in_the_file(config: Path, tmp_path: Path) -> None:
    told = tmp_path / "robot.toml"
    told.write_text(config.read_text() + 'operator = "Ada"\nrobot_serial = "G1-7"\nfirmware = "1.4.2"\n')
    (tmp_path / "notes.md").write_text("Two people in the kitchen.\n")
    path = tmp_path / "walk.mcap"
    words = ["--minutes", "0.005", "--stand", "--operator", "Zoë", "--site", "Lab 3", "--sheet", f"{tmp_path}/notes.md"]
    assert main(["record", "-o", str(path), "--config", str(told), *words]) == 0
    log = LogReader(path)
    about = log.metadata()["openbelief.recording"]
    assert {key: about[key] for key in ("operator", "site", "robot_serial", "firmware", "camera")} == {
        "operator": "Zoë",
        "site": "Lab 3",
        "robot_serial": "G1-7",
        "firmware": "1.4.2",
        "camera": "sim",
    }
    sheets = {attachment.name: attachment.data.decode() for attachment in log.attachments()}
    assert sheets["trial_sheet.md"] == "Two people in the kitchen.\n"
    assert 'operator = "Zo' in sheets["robot.toml"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["-o", "{0}/no/walk.mcap"], "{0}/no is no folder: make it first, or name a file elsewhere"),
        (["-o", "{0}/walk.mcap", "--sheet", "{0}/none.md"], "{0}/none.md: No such file or directory"),
        (["-o", "{0}/walk.mcap", "--operator", "a\nb"], "[recording] operator: "),
    ],
)
def test_what_cannot_begin_is_one_line_with_its_cause(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], line: str
) -> None:
    assert main(["record", "--config", str(config), *(word.format(tmp_path) for word in words)]) == 1
    error = capsys.readouterr().err
    assert line.format(tmp_path) in error and error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_recording_is_never_overwritten(walk: Path, config: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = walk.read_bytes()
    assert main(["record", "-o", str(walk), "--config", str(config)]) == 1
    assert "never overwritten" in capsys.readouterr().err
    assert walk.read_bytes() == before


def test_a_full_disk_ends_it_visibly_with_the_file_whole_and_the_event_kept(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    full = tmp_path / "full.toml"
    full.write_text(config.read_text().replace("stop_bytes = 0", f"stop_bytes = {1 << 60}"))
    path = tmp_path / "walk.mcap"
    assert main(["record", "-o", str(path), "--config", str(full), "--minutes", "0.1"]) == 1
    assert "recording stopped: only" in capsys.readouterr().err
    LogReader(path).metadata()  # whole
    assert read_events(tmp_path / "walk.events.jsonl")[0]["event"] == "disk_full"


def test_a_disk_that_refuses_ends_it_visibly_and_what_was_written_comes_back(
    config: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    endless = tmp_path / "robot.toml"
    endless.write_text(config.read_text().replace("every_s = 2.0", "every_s = 60.0"))
    path, before = tmp_path / "walk.mcap", resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1_500_000, before[1]))  # a full disk, without one
    try:
        assert main(["record", "-o", str(path), "--config", str(endless), "--minutes", "0.5"]) == 1
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert (
        "recording stopped: File too large; keep what was written with: openbelief recover" in capsys.readouterr().err
    )
    assert read_events(tmp_path / "walk.events.jsonl")[0]["event"] == "recording_failed"
    assert main(["recover", f"{path}.partial", "-o", str(path)]) == 0
    assert {message.topic for message in LogReader(path)} >= {"/map", "/tf_static", "/livox/lidar"}


def test_a_source_that_falls_silent_is_told_and_is_no_success(config: Path, tmp_path: Path) -> None:
    settings = load_config(config)
    with ExitStack() as opened:
        robot = opened.enter_context(open_robot(settings))
        recorder = opened.enter_context(McapRecorder(tmp_path / "walk.mcap", robot.clock))
        queue = opened.enter_context(QueuedRecorder(recorder, robot.clock))
        gauge = RecordingMonitor(robot, queue, recorder, start_taps(robot, settings, queue))
        simulation = robot.wiring.simulation
        assert simulation is not None
        robot.clock.sleep(3.0)
        before = gauge.status()
        simulation.graph.sensor_faults.muted.add("/livox/lidar")
        robot.clock.sleep(14.0)
        queue.drain()
        after = gauge.status()
    assert before.gone == ()
    [sentence] = after.gone
    assert sentence.startswith("nothing on /livox/lidar for ") and sentence in line(after)
    recorded = RecordingResult((tmp_path / "walk.mcap",), after, None)
    assert failure_of(recorded) == f"a source ended before the recording, which is kept: {sentence}"
    assert failure_of(replace(recorded, status=before)) is None
    assert after.as_json()["gone"] == [sentence]


def test_the_line_and_the_story_name_what_was_lost_by_where() -> None:
    stream = StreamStatus(29.5, 100, 2, "the disk did not keep up", {"packets lost on the network": 3}, 1, 1.34, 4)
    status = RecordingStatus(61.0, {"/livox/lidar": stream}, 10**6, 0, 10**9, None, 0.0, ("The camera has failed.",))
    assert line(status) == (
        "01:01 livox/lidar 29.5/s | dropped 2 | lost 3: livox/lidar 3 packets lost on the network"
        " | holes up to 1.3 s: livox/lidar 1 | stamps not after the one before: livox/lidar 4"
        " | 1 MB taken, 1 GB free | The camera has failed."
    )
    told = story(RecordingResult((Path("walk.mcap"),), status, None))[1]
    for words in (
        "3 packets lost",
        "2 dropped (the disk",
        "1 holes in the stamps (longest 1.34 s)",
        "4 stamps not after",
    ):
        assert words in told
    assert status.as_json()["lost"] == 3
    assert status.as_json()["streams"]["/livox/lidar"]["lost"] == {"packets lost on the network": 3}


def test_a_stop_ends_the_recording_in_good_order(config: Path, tmp_path: Path) -> None:
    stop, shown = threading.Event(), []

    def show(status: Callable[[], RecordingStatus]) -> None:
        shown.append(line(status()))
        if len(shown) == 80:
            stop.set()

    job = RecordJob(load_config(config), tmp_path / "walk.mcap", stand=True)
    recorded = record(job, stop, show, lambda sentence: None)
    assert recorded.failure is None and recorded.paths == (tmp_path / "walk.mcap",)
    assert recorded.status.dropped == 0 and recorded.status.written == sum(1 for _ in LogReader(recorded.paths[0]))
    assert all(f"{name} " in shown[-1] for name in ("colour", "depth", "livox/lidar", "tf", "map"))
    assert "dropped 0 |" in shown[-1] and "GB free" in shown[-1] and "floor seen" in shown[-1]


def largest(folder: Path) -> int:
    """The size of a recording's largest file, whatever it is called by now: each is renamed when it is whole.

    Not of its event log, whose room is reserved before anything is recorded.
    """
    sizes = [0]
    for file in folder.glob("*.mcap*"):
        with suppress(FileNotFoundError):
            sizes.append(file.stat().st_size)
    return max(sizes)


def test_ctrl_c_ends_the_program_with_the_file_renamed(config: Path, tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    command = [sys.executable, "-m", "robot_app.cli", "record", "-o", str(path), "--config", str(config), "--stand"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline_s = time.monotonic() + 120
    while largest(tmp_path) < 50_000:
        assert process.poll() is None and time.monotonic() < deadline_s, "nothing was recorded"
        threading.Event().wait(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    assert path.exists() and not list(tmp_path.glob("*.partial"))
    assert sum(1 for _ in LogReader(path)) > 0
