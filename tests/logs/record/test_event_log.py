"""The event log: its room is taken before it is needed."""

from __future__ import annotations

from pathlib import Path

from logs.record.event_log import RESERVED_BYTES, EventLog
from support.events import read_events


def test_its_room_is_taken_in_advance_and_given_back(tmp_path: Path) -> None:
    log = EventLog(tmp_path / "a.jsonl")
    log.open()
    assert log.path.stat().st_blocks * 512 >= RESERVED_BYTES
    log.write(1, "disk_low", sentence="3 GB are free")
    assert read_events(log.path) == [
        {"stamp_ns": 1, "event": "disk_low", "sentence": "3 GB are free"}
    ]  # as after a crash
    log.close()
    assert log.path.stat().st_size < 100
    assert len(read_events(log.path)) == 1


def test_without_an_event_no_file_remains(tmp_path: Path) -> None:
    log = EventLog(tmp_path / "a.jsonl")
    log.open()
    log.close()
    assert not list(tmp_path.iterdir())


def test_it_never_outgrows_its_reserve(tmp_path: Path) -> None:
    log = EventLog(tmp_path / "a.jsonl")
    log.open()
    for k in range(20):
        log.write(k, "noise", text="x" * 8000)
    log.close()
    assert log.path.stat().st_size <= RESERVED_BYTES
    assert log.dropped + len(read_events(log.path)) == 20 and log.dropped > 0
