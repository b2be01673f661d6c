"""`openbelief record` over simulated sources, a replayed one, a full disk and Ctrl-C: what lies on the disk then."""

from __future__ import annotations

import itertools
import json
import resource
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from drivers.ros_messages import decode
from logs.event_log import read_events
from logs.frames import FrameReader
from logs.reader import LogReader
from robot_app.cli import main
from robot_app.config import load_config
from robot_app.record_gauge import Status
from robot_app.record_line import line
from robot_app.recording import RecordJob, record

SENSED = {
    "/camera/color/image_raw/compressed",
    "/camera/aligned_depth_to_color/image_raw",
    "/camera/color/camera_info",
    "/livox/lidar",
    "/livox/imu",
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
        assert "commit" in log.metadata()["openbelief.recording"]
        assert [attachment.name for attachment in log.attachments()] == ["robot.toml"]
        assert list(FrameReader(file)), f"{file.name} gives no frame"


def test_the_imu_comes_at_200_hz_with_gravity_upwards_in_the_hanging_lidar(walk: Path) -> None:
    messages = [message for message in LogReader(walk) if message.topic == "/livox/imu"]
    steps_ns = {b.stamp_ns - a.stamp_ns for a, b in itertools.pairwise(messages)}
    assert steps_ns == {5_000_000}
    felt = decode(messages[0].payload, "sensor_msgs/msg/Imu").linear_acceleration
    assert felt.z == pytest.approx(-9.81, abs=0.1)


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


def test_a_stop_ends_the_recording_in_good_order(config: Path, tmp_path: Path) -> None:
    stop, shown = threading.Event(), []

    def show(status: Callable[[], Status]) -> None:
        shown.append(line(status()))
        if len(shown) == 80:
            stop.set()

    job = RecordJob(load_config(config), tmp_path / "walk.mcap", stand=True)
    recorded = record(job, stop, show, lambda sentence: None)
    assert recorded.failure is None and recorded.paths == (tmp_path / "walk.mcap",)
    assert recorded.status.dropped == 0 and recorded.status.written == sum(1 for _ in LogReader(recorded.paths[0]))
    assert all(f"{name} " in shown[-1] for name in ("colour", "depth", "livox/lidar", "tf", "map"))
    assert "dropped 0 |" in shown[-1] and "GB free" in shown[-1] and "floor seen" in shown[-1]


def test_ctrl_c_ends_the_program_with_the_file_renamed(config: Path, tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    command = [sys.executable, "-m", "robot_app.cli", "record", "-o", str(path), "--config", str(config), "--stand"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    partial = path.with_name("walk.mcap.partial")
    for _ in range(600):
        if partial.exists() and partial.stat().st_size > 50_000:
            break
        threading.Event().wait(0.05)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert path.exists() and not partial.exists()
    assert sum(1 for _ in LogReader(path)) > 0
