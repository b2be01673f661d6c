"""Files of a later MCAP: longer records and records of unknown kinds are passed over, as the format demands.

The inputs follow the format's public conformance set (its combinations of features), built here.
"""

from __future__ import annotations

import struct
import zlib
from itertools import product
from pathlib import Path

import pytest
from mcap import records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode

from logs.mcap_io.reader import LogError, LogReader
from logs.mcap_io.recover import recover
from logs.mcap_io.scan import MAGIC

FEATURES = ("chunk", "pad", "unknown", "private", "index", "statistics", "repeat", "summary", "crc")
EXTRA = b"\x01\x02\x03"


def written(record, pad: bool) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    whole = builder.end()
    if not pad or whole[0] in (Opcode.MESSAGE, Opcode.HEADER, Opcode.DATA_END, Opcode.FOOTER):
        return whole
    body = whole[9:] + EXTRA
    return struct.pack("<BQ", whole[0], len(body)) + body


def build(features: frozenset[str], messages: int, attachment: bool = False) -> bytes:
    pad, crc = "pad" in features, "crc" in features

    def put(record) -> bytes:
        return written(record, pad)

    def strangers() -> bytes:
        found = b""
        for feature, opcode in (("unknown", 0x7E), ("private", 0x99)):
            if feature in features:
                found += struct.pack("<BQ", opcode, len(EXTRA)) + EXTRA
        return found

    schema = records.Schema(id=1, name="Example", encoding="c", data=b"\4\5\6")
    channel = records.Channel(id=1, schema_id=1, topic="example", message_encoding="a", metadata={"foo": "bar"})
    inside = put(schema) + strangers() + put(channel)
    inside += b"".join(
        put(records.Message(channel_id=1, sequence=i, log_time=i, publish_time=i, data=bytes([i])))
        for i in range(messages)
    )
    out = MAGIC + put(records.Header(profile="", library="")) + strangers()
    chunk_at = len(out)
    if "chunk" in features:
        check = zlib.crc32(inside) if crc else 0
        chunk = records.Chunk(
            message_start_time=0,
            message_end_time=messages,
            uncompressed_size=len(inside),
            uncompressed_crc=check,
            compression="",
            data=inside,
        )
        out += put(chunk)
        chunk_length = len(out) - chunk_at
        out += put(records.MessageIndex(channel_id=1, records=[(i, 0) for i in range(messages)]))
    else:
        out += inside
    if attachment:
        out += put(records.Attachment(create_time=1, log_time=2, name="file", media_type="t", data=b"\1\2\3"))
        out += put(records.Metadata(name="m", metadata={"a": "b"}))
    out += put(records.DataEnd(data_section_crc=zlib.crc32(out) if crc else 0))
    start, summary = len(out), b""
    if "repeat" in features:
        summary += put(schema) + put(channel)
    if "statistics" in features:
        summary += put(
            records.Statistics(
                message_count=messages,
                schema_count=1,
                channel_count=1,
                attachment_count=int(attachment),
                metadata_count=int(attachment),
                chunk_count=int("chunk" in features),
                message_start_time=0,
                message_end_time=messages,
                channel_message_counts={1: messages},
            )
        )
    if {"index", "chunk"} <= features:
        summary += put(
            records.ChunkIndex(
                message_start_time=0,
                message_end_time=messages,
                chunk_start_offset=chunk_at,
                chunk_length=chunk_length,
                message_index_offsets={},
                message_index_length=0,
                compression="",
                compressed_size=len(inside),
                uncompressed_size=len(inside),
            )
        )
    summary += strangers()
    if "summary" in features:
        summary += put(records.SummaryOffset(group_opcode=3, group_start=start, group_length=1))
    footer = records.Footer(summary_start=start if summary else 0, summary_offset_start=0, summary_crc=0)
    out += summary + written(footer, False)
    return out + MAGIC


SETS = [
    frozenset(name for name, on in zip(FEATURES, chosen, strict=True) if on)
    for chosen in product((False, True), repeat=len(FEATURES))
]


@pytest.mark.parametrize("messages", [0, 1, 10])
@pytest.mark.parametrize("attachment", [False, True])
def test_every_combination_of_features_gives_its_messages(tmp_path: Path, messages: int, attachment: bool) -> None:
    """512 files each."""
    path = tmp_path / "walk.mcap"
    for features in SETS:
        path.write_bytes(build(features, messages, attachment))
        log = LogReader(path)
        assert [m.payload for m in log] == [bytes([i]) for i in range(messages)], sorted(features)
        assert [a.data for a in log.attachments()] == [b"\1\2\3"] * attachment, sorted(features)
        assert log.metadata() == ({"m": {"a": "b"}} if attachment else {}), sorted(features)


@pytest.mark.parametrize("features", [frozenset(FEATURES), frozenset(FEATURES) - {"chunk"}, frozenset({"pad"})])
def test_recover_keeps_all_of_such_a_file_and_calls_nothing_lost(tmp_path: Path, features: frozenset[str]) -> None:
    source = tmp_path / "walk.mcap"
    source.write_bytes(build(features, 10, attachment=True))
    report = recover(source, tmp_path / "out.mcap", lambda share: None)
    assert (report.messages, report.attachments, report.metadata, report.losses) == (10, 1, 1, [])
    assert len(list(LogReader(tmp_path / "out.mcap"))) == 10


def test_in_our_own_files_a_longer_record_and_an_unknown_kind_are_damage(small_recording: Path) -> None:
    """No version of ours writes them: a flipped bit does."""
    good = small_recording.read_bytes()
    for opcode in (0x7E, 0x04):
        stranger = struct.pack("<BQ", opcode, 3) + EXTRA
        at = good.index(b"\x06", 9)  # before the first chunk
        small_recording.write_bytes(good[:at] + stranger + good[at:])
        with pytest.raises(LogError, match="damaged"):
            list(LogReader(small_recording))
