"""Recover: every whole chunk comes back from any cut and any flip, and never a message that was not written."""

from __future__ import annotations

import json
import random
import zlib
from dataclasses import replace
from pathlib import Path

import pytest

from logs.mcap_io import chunk
from logs.mcap_io.checksum import KEY, ChecksumError, without_checksum
from logs.mcap_io.chunk import chunk_records
from logs.mcap_io.reader import LogError, LogMessage, LogReader
from logs.mcap_io.recover import recover
from logs.mcap_io.recovery_report import RecoveryReport
from logs.mcap_io.scan import PositionedFile, record_at


def recovered(damaged: Path) -> tuple[RecoveryReport, list[LogMessage]]:
    """The messages that come back from a damaged file; the output must itself be whole."""
    output = damaged.with_suffix(".out")
    report = recover(damaged, output, lambda share: None)
    messages = list(LogReader(output))
    output.unlink()
    assert report.messages == len(messages)
    return report, messages


def counts_of(path: Path) -> list[int]:
    """How many messages each chunk holds."""
    with PositionedFile(path) as source:
        return [
            sum(each.opcode == 5 for each in chunk_records(record_at(source, begin))) for begin, _ in chunks_of(path)
        ]


def chunks_of(path: Path) -> list[tuple[int, int]]:
    """(begin, end) of every chunk."""
    spans, offset = [], 8
    with PositionedFile(path) as source:
        while True:
            raw = record_at(source, offset)
            if raw.opcode == 15:
                return spans
            if raw.opcode == 6:
                spans.append((offset, raw.end))
            offset = raw.end


def places(path: Path, *, stride: int) -> list[int]:
    """Every byte of the data, and every `stride`th of the index behind it."""
    index = chunks_of(path)[-1][1]
    return [*range(index), *range(index, path.stat().st_size, stride)]


def is_part_of(part: list[LogMessage], whole: list[LogMessage]) -> bool:
    """In order, nothing twice, nothing that was not there."""
    rest = iter(whole)
    return all(message in rest for message in part)


def test_a_whole_file_comes_back_whole(small_recording: Path) -> None:
    report, messages = recovered(small_recording)
    assert report.complete and report.messages_lost == 0 and report.unverified_messages == 0
    assert messages == list(LogReader(small_recording))


def test_a_file_cut_anywhere_gives_back_every_chunk_before_the_cut(small_recording: Path, scratch: Path) -> None:
    whole, data = list(LogReader(small_recording)), small_recording.read_bytes()
    chunks, cut = chunks_of(small_recording), scratch / "cut.mcap"
    counts = counts_of(small_recording)
    for size in places(small_recording, stride=7):
        cut.write_bytes(data[:size])
        expected = sum(count for (_, end), count in zip(chunks, counts, strict=True) if end <= size)
        try:
            report, messages = recovered(cut)
        except LogError as error:
            assert expected == 0 and "nothing to keep" in str(error), f"cut at {size}"
            continue
        assert messages == whole[:expected], f"cut at {size}"
        assert not report.complete


def test_a_flip_anywhere_costs_at_most_its_own_chunk(small_recording: Path, scratch: Path) -> None:
    whole, data = list(LogReader(small_recording)), small_recording.read_bytes()
    chunks, flipped = chunks_of(small_recording), scratch / "flipped.mcap"
    counts = counts_of(small_recording)
    for position in places(small_recording, stride=3):
        bits = bytearray(data)
        bits[position] ^= 1 << (position * 3 % 8)
        flipped.write_bytes(bits)
        report, messages = recovered(flipped)
        hit = [count for (begin, end), count in zip(chunks, counts, strict=True) if begin <= position < end]
        assert is_part_of(messages, whole), f"flip at {position}"
        assert len(messages) >= len(whole) - sum(hit), f"flip at {position}"
        assert not report.complete, f"flip at {position} went unnoticed"
        assert report.unverified_messages == 0


def test_many_faults_at_once_never_make_a_message(small_recording: Path, scratch: Path) -> None:
    """Cuts, flips, swapped and zeroed stretches, with and without the index at the end."""
    whole, data = list(LogReader(small_recording)), small_recording.read_bytes()
    rng, damaged = random.Random(3), scratch / "damaged.mcap"
    for case in range(400):
        bits = bytearray(data[: rng.choice([len(data), rng.randrange(len(data))])])
        for _ in range(rng.randrange(1, 5)):
            if bits:
                bits[rng.randrange(len(bits))] ^= 1 << rng.randrange(8)
        if rng.random() < 0.3 and len(bits) > 100:
            begin = rng.randrange(len(bits) - 50)
            bits[begin : begin + rng.randrange(50)] = bytes(rng.randrange(80))
        damaged.write_bytes(bits)
        try:
            _, messages = recovered(damaged)
        except LogError:
            continue
        assert is_part_of(messages, whole), f"case {case}"


def test_the_messages_of_an_attached_recording_are_never_taken_for_the_files_own(
    nested_recording: Path, tmp_path: Path, scratch: Path
) -> None:
    whole, data = list(LogReader(nested_recording)), nested_recording.read_bytes()
    begin = data.index(b"robot.toml") - 29
    end = begin + len((tmp_path / "inner.mcap").read_bytes())
    damaged = scratch / "damaged.mcap"
    for position in [*range(begin - 20, begin + 60), *range(begin + 80, end, 97)]:
        for bits in (data[:position], data[:position] + bytes([data[position] ^ 4]) + data[position + 1 :]):
            damaged.write_bytes(bits)
            _, messages = recovered(damaged)
            assert is_part_of(messages, whole), f"at {position}"


def test_the_report_says_what_was_lost(small_recording: Path, scratch: Path) -> None:
    begin, end = chunks_of(small_recording)[1]
    data = bytearray(small_recording.read_bytes())
    data[(begin + end) // 2] ^= 1
    (scratch / "hit.mcap").write_bytes(data)
    report, messages = recovered(scratch / "hit.mcap")
    counts = counts_of(small_recording)
    assert (report.messages_lost, report.chunks) == (counts[1], len(counts) - 1)
    assert [loss.startswith(f"chunk at byte {begin}") for loss in report.losses] == [True]
    whole = [m.sequence for m in LogReader(small_recording) if m.topic == "/openbelief/note"]
    assert [m.sequence for m in messages if m.topic == "/openbelief/note"] != whole  # the gap stays visible


def test_an_unfinished_file_whose_first_chunk_is_damaged_still_gives_back_the_others(
    small_recording: Path, scratch: Path
) -> None:
    """The chunk that defined the channels is gone, and there is no index."""
    (begin, end), *_, (_, last) = chunks_of(small_recording)
    data = bytearray(small_recording.read_bytes()[:last])
    data[(begin + end) // 2] ^= 1
    (scratch / "hit.mcap").write_bytes(data)
    whole = list(LogReader(small_recording))
    _, messages = recovered(scratch / "hit.mcap")
    lost = counts_of(small_recording)[0]
    assert 0 < lost < len(whole) and messages == whole[lost:]


def test_attachments_and_metadata_come_back_too(small_recording: Path, scratch: Path) -> None:
    data = small_recording.read_bytes()
    (scratch / "cut.mcap").write_bytes(data[:-30])
    recover(scratch / "cut.mcap", scratch / "out.mcap", lambda share: None)
    log = LogReader(scratch / "out.mcap")
    assert [replace(a, log_time_ns=0).data for a in log.attachments()] == [b"speed = 1\n"]
    assert log.metadata()["run"] == {"commit": "abc"}
    assert log.metadata()["openbelief.recovered"]["from"] == "cut.mcap"


def test_a_damaged_metadata_record_is_dropped_and_told_whichever_byte_was_hit(
    small_recording: Path, scratch: Path
) -> None:
    """Its name, its values or its checksum: what comes back is what was written, or nothing."""
    data = small_recording.read_bytes()
    begin = data.index(b"\x03\x00\x00\x00run") + 4
    end = data.index(b"openbelief.crc32", begin) + len(b"openbelief.crc32") + 12
    for position in range(begin, end):
        for bit in range(8):
            bits = bytearray(data)
            bits[position] ^= 1 << bit
            (scratch / "hit.mcap").write_bytes(bits)
            report = recover(scratch / "hit.mcap", scratch / "out.mcap", lambda share: None)
            kept = LogReader(scratch / "out.mcap").metadata()
            (scratch / "out.mcap").unlink()
            assert set(kept) == {"openbelief.recovered"}, f"flip of bit {bit} at {position}"
            assert any(loss.startswith("metadata at byte") for loss in report.losses)


def test_a_name_that_no_recorder_of_ours_writes_is_dropped_from_files_of_before_names_were_checked() -> None:
    values = {"commit": "abc"}
    before = values | {KEY: f"{zlib.crc32(json.dumps(values, sort_keys=True).encode()):08x}"}
    assert without_checksum("openbelief.recording", before) == values
    assert without_checksum("openbelief.channel/12", before) == values
    for name in ("openbelief.recordifg", "openbelief.chbnnel/12", "openbelief.channel/x"):
        with pytest.raises(ChecksumError, match=f"no recorder of ours writes '{name}'"):
            without_checksum(name, before)


def test_nothing_is_left_behind_where_there_is_nothing_to_keep(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"no recording at all")
    with pytest.raises(LogError, match="nothing to keep"):
        recover(tmp_path / "a.mcap", tmp_path / "b.mcap", lambda share: None)
    assert [p.name for p in tmp_path.iterdir()] == ["a.mcap"]


def test_neither_the_source_nor_another_file_is_overwritten(small_recording: Path) -> None:
    before = small_recording.read_bytes()
    with pytest.raises(FileExistsError, match="never overwritten"):
        recover(small_recording, small_recording, lambda share: None)
    assert small_recording.read_bytes() == before


@pytest.mark.recordings
@pytest.mark.parametrize("name", ["apartment", "kitchen"])
def test_a_field_recording_cut_in_the_middle_comes_back_up_to_the_cut(name: str, scratch: Path) -> None:
    original = Path(__file__).resolve().parents[3].parent / "shared" / "recordings" / f"{name}.mcap"
    if not original.is_file():
        pytest.skip(f"{original} is not there: the shared recordings are needed")
    cut = scratch / f"{name}.mcap"
    with original.open("rb") as file:
        cut.write_bytes(file.read(5_000_000))
    _, messages = recovered(cut)
    assert len(messages) > 50
    assert all(ours == theirs for ours, theirs in zip(messages, LogReader(original), strict=False))


def test_a_chunk_of_more_records_than_any_recorder_writes_is_refused_before_they_are_objects(
    small_recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """6 kB of zstd hold seven million records, 800 MB as objects."""
    monkeypatch.setattr(chunk, "MAX_CHUNK_RECORDS", 2)
    report = recover(small_recording, tmp_path / "out.mcap", lambda share: None)
    assert report.messages < 9 and any("more than 2 records, the limit" in loss for loss in report.losses)
