"""A small recording with everything in it, for tests that damage it."""

from __future__ import annotations

import os
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from pydantic import BaseModel

from drivers.ros.messages import encode, make
from logs.record.recorder import McapRecorder
from support.clocks import HandClock


class Note(BaseModel):
    text: str


def record_small(path: Path, *, messages: int = 4, attachment: bytes = b"speed = 1\n") -> None:
    noise = random.Random(7)
    with McapRecorder(path, HandClock(1_700_000_000_000_000_000, step_ns=1_000_000)) as recorder:
        recorder.metadata("run", {"commit": "abc"})
        for k in range(messages):
            text = make("std_msgs/msg/String", data=f"word {k} {noise.random()}")
            recorder.write_cdr("/words", "std_msgs/msg/String", k, encode(text))
            recorder.write_json("/openbelief/note", Note(text=f"note {k}"), k)
            if k % 2:
                recorder.flush()
        recorder.attach("robot.toml", "application/toml", attachment)
        recorder.write_json("/openbelief/note", Note(text="last"), messages)


@pytest.fixture
def scratch() -> Iterator[Path]:
    """A folder in memory where the system has one: thousands of small files, each synced, are slow on a disk."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)


@pytest.fixture
def small_recording(tmp_path: Path) -> Path:
    """9 messages in 4 chunks, one metadata record, one attachment: about 4 kB."""
    record_small(tmp_path / "small.mcap")
    return tmp_path / "small.mcap"


@pytest.fixture
def nested_recording(tmp_path: Path) -> Path:
    """A recording that carries another, of other messages, as its attachment."""
    record_small(tmp_path / "inner.mcap", messages=6)
    record_small(tmp_path / "outer.mcap", attachment=(tmp_path / "inner.mcap").read_bytes())
    return tmp_path / "outer.mcap"
