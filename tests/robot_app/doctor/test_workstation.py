"""What needs no robot: memory, disk, certificates."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np

from openbelief import ObjectMemory, Observation, Parameters
from robot_app.certs.folder import make_network
from robot_app.certs.zenoh import ZenohNetwork
from robot_app.config import Config, load_config
from robot_app.config_sections import PortsSection, ZenohSection
from robot_app.doctor.finding import Level
from robot_app.doctor.workstation import check_certificates, check_disk, check_memory
from support.encoders import WordEncoder

CONFIG = Config()
DAY_NS = 86_400 * 10**9


def test_a_memory_that_is_none_is_found(tmp_path: Path) -> None:
    (tmp_path / "site.belief").write_bytes(b"no database")
    for path in (tmp_path / "site.belief", tmp_path / "missing.belief"):
        [line] = check_memory(CONFIG.model_copy(update={"memory": path}), 0)
        assert line.level == Level.FAIL and path.name in line.said and line.remedy
    [none] = check_memory(CONFIG, 0)
    assert none.level == Level.WARN and "openbelief map" in none.remedy


def test_a_memory_of_another_text_encoder_is_found(tmp_path: Path) -> None:
    points = np.random.default_rng(1).normal(0, 0.1, (200, 3)).astype(np.float32)
    feature = np.eye(8, dtype=np.float32)[0]
    seen = Observation(frame=0, mask=0, phrase="chair", confidence=0.9, points=points, feature=feature)
    ObjectMemory.build([seen], WordEncoder(8, "another-encoder"), Parameters()).save(tmp_path / "site.belief")
    memory, encoder = check_memory(CONFIG.model_copy(update={"memory": tmp_path / "site.belief"}), 0)
    assert memory.level == Level.OK and encoder.level == Level.FAIL
    assert "another-encoder" in encoder.said and "map again" in encoder.remedy


def test_a_disk_that_is_nearly_full_is_found(tmp_path: Path) -> None:
    recording = CONFIG.recording.model_copy(update={"stop_bytes": 1 << 60})
    full = CONFIG.model_copy(update={"trials": tmp_path / "not" / "there", "recording": recording})
    [line] = check_disk(full, 0)
    assert line.level == Level.FAIL and "make room" in line.remedy


def test_certificates_near_and_past_their_end_are_found(tmp_path: Path) -> None:
    now_ns = time.time_ns()
    make_network(tmp_path / "site", ZenohNetwork("127.0.0.1"), [], now_ns, days=30)
    config = load_config(tmp_path / "site" / "workstation" / "robot.toml")
    levels = [{line.level for line in check_certificates(config, now_ns + days * DAY_NS)} for days in (0, 20, 40)]
    assert levels == [{Level.OK}, {Level.WARN}, {Level.FAIL}]
    missing = Config(
        ports=PortsSection(camera="ros"),
        zenoh=ZenohSection(endpoint="tls/h:1", ca=tmp_path, certificate=tmp_path, key=tmp_path),
    )
    assert {line.level for line in check_certificates(missing, now_ns)} == {Level.FAIL}
