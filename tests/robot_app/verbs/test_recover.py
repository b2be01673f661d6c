"""`openbelief recover`: the result as JSON or as a story, failures in one line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivers.clock import SystemClock
from drivers.ros.messages import encode, make
from logs.mcap_io.reader import LogReader
from logs.record.recorder import McapRecorder
from robot_app.cli import main


@pytest.fixture
def cut_off(tmp_path: Path) -> Path:
    """A recording whose end is missing, as a killed recorder leaves it."""
    with McapRecorder(tmp_path / "walk.mcap", SystemClock()) as recorder:
        for k in range(6):
            recorder.write_cdr("/words", "std_msgs/msg/String", k, encode(make("std_msgs/msg/String", data=str(k))))
            recorder.flush()
    data = (tmp_path / "walk.mcap").read_bytes()
    (tmp_path / "walk.mcap").unlink()
    partial = tmp_path / "walk.mcap.partial"
    partial.write_bytes(data[: data.index(b"zstd", len(data) // 3)])
    return partial


def test_json_tells_what_was_kept_and_the_new_file_is_whole(cut_off: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["recover", str(cut_off), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    messages = list(LogReader(report["output"]))
    assert report["output"] == str(cut_off.with_name("walk.recovered.mcap"))
    assert 0 < report["messages"] == len(messages) < 6 and not report["complete"]


def test_the_original_name_can_be_given_back(cut_off: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = cut_off.with_name("walk.mcap")
    assert main(["recover", str(cut_off), "-o", str(output)]) == 0
    text = capsys.readouterr().out
    assert "lost: an unknown number of messages" in text and "ends in the middle of a record" in text
    assert cut_off.exists() and list(LogReader(output))


@pytest.mark.parametrize(
    ("name", "content", "cause"),
    [("none.mcap", None, "is not there"), ("text.mcap", b"hello", "nothing to keep")],
)
def test_failures_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: bytes | None, cause: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert main(["recover", str(tmp_path / name)]) == 1
    error = capsys.readouterr().err
    assert cause in error and error.count("\n") == 1


def test_an_existing_output_is_kept(cut_off: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (cut_off.with_name("walk.mcap")).write_bytes(b"evidence")
    assert main(["recover", str(cut_off), "-o", str(cut_off.with_name("walk.mcap"))]) == 1
    assert "never overwritten" in capsys.readouterr().err
    assert cut_off.with_name("walk.mcap").read_bytes() == b"evidence"
