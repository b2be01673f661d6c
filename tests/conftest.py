"""A walk small enough for any test: a camera that drives past three coloured boxes in front of a wall."""

from __future__ import annotations

import base64
import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from drivers.ros.convert import transforms_message
from drivers.ros.image_messages import camera_info_message, depth_message, jpeg_message
from drivers.ros.messages import Message, codec, encode
from openbelief.observation import Intrinsics
from openbelief.pose import T_CAMERA_LINK_OPTICAL, transform
from openbelief.run_lengths import encode_rle
from support.resident import ResidentMemory
from support.waiting import until

MS = 1_000_000
START_NS = 1_000_000_000
COLOR, DEPTH, INFO = "/camera/color/image_raw/compressed", "/camera/depth/image_rect_raw", "/camera/color/camera_info"
OPTICAL = "camera_color_optical_frame"
BOXES = {"red box": (-0.5, (220, 30, 30)), "green box": (0.2, (30, 200, 30)), "blue box": (0.9, (30, 30, 220))}
WALL_M, BOX_M, HALF_M = 2.0, 1.6, 0.15


@dataclass
class Walk:
    """The messages of a walk as (topic, log_time_ns, message); tests change them, then `write`."""

    intrinsics: Intrinsics
    messages: list[tuple[str, int, Message]] = field(default_factory=list)
    stamps: list[int] = field(default_factory=list)
    masks: list[dict] = field(default_factory=list)

    def drop(self, topic: str, stamp_ns: int) -> None:
        """Take away the message of that header stamp."""
        self.messages = [m for m in self.messages if not (m[0] == topic and stamp_of(m[2]) == stamp_ns)]

    def replace(self, topic: str, stamp_ns: int, message: Message) -> None:
        self.messages = [
            (t, at, message) if t == topic and stamp_of(m) == stamp_ns else (t, at, m) for t, at, m in self.messages
        ]

    def write(self, path: Path) -> Path:
        """A ros2 MCAP with small zstd chunks and checksums."""
        with path.open("wb") as file:
            writer = Writer(file, chunk_size=20_000, compression=CompressionType.ZSTD, enable_data_crcs=True)
            writer.start(profile="ros2", library="test")
            channels: dict[str, int] = {}
            for topic, at_ns, message in sorted(self.messages, key=lambda m: m[1]):
                if topic not in channels:
                    name = message.__msgtype__
                    schema = writer.register_schema(name, "ros2msg", codec().definition(name).encode())
                    channels[topic] = writer.register_channel(topic, "cdr", schema)
                payload = message if isinstance(message, bytes) else encode(message)
                writer.add_message(channels[topic], log_time=at_ns, publish_time=at_ns, data=payload)
            writer.finish()
        return path

    def write_perception(self, path: Path, **header: object) -> Path:
        """What a perfect perception says of the boxes, as *.perception.jsonl."""
        first = {"format": "openbelief.perception/1", "feature_dim": 4, "feature_text_aligned": False} | header
        path.write_text("\n".join(json.dumps(line) for line in [first, *self.masks]) + "\n")
        return path


def stamp_of(message: Message) -> int | None:
    head = getattr(message, "header", None)
    return head.stamp.sec * 1_000_000_000 + head.stamp.nanosec if head else None


def _picture(camera: Intrinsics, y_m: float) -> tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]:
    """Colour, depth and one mask per box, seen from y_m along the wall looking along map x."""
    v, u = np.mgrid[: camera.height, : camera.width]
    depth, color, masks = np.full(u.shape, WALL_M), np.full((*u.shape, 3), 128, np.uint8), {}
    for name, (box_y, rgb) in BOXES.items():
        left_m, up_m = -(u - camera.cx) / camera.fx * BOX_M, -(v - camera.cy) / camera.fy * BOX_M
        inside = (np.abs(left_m + y_m - box_y) <= HALF_M) & (np.abs(up_m) <= HALF_M)
        depth[inside], color[inside] = BOX_M, rgb
        if inside.sum() > 100:
            masks[name] = inside
    return color, depth, masks


def _line(stamp_ns: int, index: int, name: str, mask: np.ndarray) -> dict:
    feature = np.eye(4, dtype="<f2")[list(BOXES).index(name)]
    return {
        "stamp_ns": stamp_ns,
        "mask_index": index,
        "phrase": name,
        "confidence": 0.9,
        "bbox": [0.5, 0, 10, 10],
        "rle": encode_rle(mask),
        "feature": base64.b64encode(feature.tobytes()).decode(),
    }


@pytest.fixture
def make_walk() -> Callable[..., Walk]:
    """make_walk(frames=6): 5 Hz along map y at 0.5 m/s, /tf at 20 Hz between the camera's stamps, base 1 m up."""

    def make(frames: int = 6) -> Walk:
        camera = Intrinsics(160, 120, 120.0, 120.0, 79.5, 59.5)
        walk = Walk(camera)
        mount = transform([0.1, 0.0, 1.0], [0, 0, 0, 1]) @ T_CAMERA_LINK_OPTICAL
        static = transforms_message(START_NS, [("base_link", OPTICAL, mount)])
        walk.messages.append(("/tf_static", START_NS - 500 * MS, static))
        for k in range(-3, frames * 4 + 3):
            at = START_NS + k * 50 * MS
            T = transform([0.0, 0.025 * k, 0.0], [0, 0, 0, 1])
            walk.messages.append(("/tf", at + MS, transforms_message(at, [("map", "base_link", T)])))
        for i in range(frames):
            at = START_NS + i * 200 * MS + 25 * MS
            color, depth, masks = _picture(camera, 0.5 * (at - START_NS) / 1e9)
            walk.stamps.append(at)
            walk.messages += [
                (COLOR, at + 20 * MS, jpeg_message(at, OPTICAL, color)),
                (DEPTH, at + 30 * MS, depth_message(at, OPTICAL, depth)),
                (INFO, at + 15 * MS, camera_info_message(at, OPTICAL, camera)),
            ]
            walk.masks += [_line(at, k, name, mask) for k, (name, mask) in enumerate(masks.items())]
        return walk

    return make


class VlmServer:
    """A stand-in model server in a process of its own (sim_fakes.wire.vlm_server): killed, and started again."""

    def __init__(self, folder: Path, port: int = 0, answers: dict[str, str] | None = None, **options: object) -> None:
        self.log = folder / "requests.jsonl"
        self._arguments = ["--log", str(self.log)]
        if answers is not None:
            (folder / "answers.json").write_text(json.dumps(answers))
            self._arguments += ["--answers", str(folder / "answers.json")]
        for name, value in options.items():
            self._arguments += [f"--{name.replace('_', '-')}", str(value)]
        self.start(port)

    def start(self, port: int = 0, *more: str) -> None:
        command = [sys.executable, "-m", "sim_fakes.wire.vlm_server", *self._arguments, "--port", str(port), *more]
        self._process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert self._process.stdout is not None
        self.endpoint = self._process.stdout.readline().strip()
        self.port = int(self.endpoint.rsplit(":", 1)[1].split("/")[0])

    def kill(self) -> None:
        self._process.kill()
        self._process.communicate()

    def restart_when_dead(self) -> None:
        self._process.wait()
        self.restart()

    def restart(self) -> None:
        """On the same port, with nothing to misbehave left."""
        self.start(self.port, "--behave", "")

    @property
    def asked(self) -> list[dict]:
        """What it was asked, in order."""
        return [line for line in self._lines() if "behaviour" in line]

    @property
    def answered(self) -> list[str]:
        """The pictures whose answer was sent to its end."""
        return [line["picture"] for line in self._lines() if "answered" in line]

    def _lines(self) -> list[dict]:
        return [json.loads(line) for line in self.log.read_text().splitlines()] if self.log.exists() else []


@pytest.fixture
def start_vlm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., VlmServer]]:
    """start_vlm(answers={sha256: reply}, behave="status:500|ok", key=..., model=..., delay_s=...)."""
    servers: list[VlmServer] = []

    def start(**options: object) -> VlmServer:
        servers.append(VlmServer(tmp_path_factory.mktemp("vlm"), **options))  # type: ignore[arg-type]
        return servers[-1]

    yield start
    for server in servers:
        server.kill()


@pytest.fixture(scope="session")
def resident_memory() -> ResidentMemory:
    return ResidentMemory()


@pytest.fixture(scope="module", autouse=True)
def memory_is_given_back(resident_memory: ResidentMemory) -> Iterator[None]:
    """Set up before any other fixture of a module, so that it comes last, when what those made is gone."""
    yield
    resident_memory.give_back()


@pytest.fixture
def eventually() -> Callable[..., None]:
    """Wait, in wall time, for what real threads and processes bring about."""
    return until
