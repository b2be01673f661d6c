"""The reader: every byte was checked, or the file is refused with one line that says what to do."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from pathlib import Path

import pytest
import zstandard
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.writer import CompressionType, Writer

from logs.mcap_io.chunk import chunk_of, chunk_records
from logs.mcap_io.reader import LogError, LogReader
from logs.mcap_io.scan import Damage, PositionedFile, RawRecord, parse, record_at

Everything = tuple[list[object], list[object], dict[str, dict[str, str]]]


def everything(path: Path) -> Everything:
    log = LogReader(path)
    return list(log), list(log.attachments()), log.metadata()


def test_a_flipped_bit_anywhere_is_found_or_changes_nothing(small_recording: Path, scratch: Path) -> None:
    whole, data = everything(small_recording), small_recording.read_bytes()
    damaged, found = scratch / "damaged.mcap", 0
    for position in range(len(data)):
        flipped = bytearray(data)
        flipped[position] ^= 1 << (position * 5 % 8)
        damaged.write_bytes(flipped)
        try:
            assert everything(damaged) == whole, f"byte {position}"
        except LogError as error:
            found += 1
            assert "\n" not in str(error) and str(damaged) in str(error)
    assert found > 0.99 * len(data)


def test_a_message_is_given_only_after_its_chunk_was_checked(small_recording: Path, scratch: Path) -> None:
    """A consumer that stops early, too, sees only what was written."""
    data, whole = small_recording.read_bytes(), list(LogReader(small_recording))
    damaged = scratch / "damaged.mcap"
    for position in range(0, len(data), 3):
        flipped = bytearray(data)
        flipped[position] ^= 0x10
        damaged.write_bytes(flipped)
        seen = []
        try:
            for message in LogReader(damaged):
                seen.append(message)  # noqa: PERF402  # what was seen before the refusal counts
        except LogError:
            pass
        assert seen == whole[: len(seen)], f"byte {position}"


def test_a_file_cut_anywhere_is_refused_with_the_remedy(small_recording: Path, scratch: Path) -> None:
    data, cut = small_recording.read_bytes(), scratch / "cut.mcap"
    for size in range(len(data)):
        cut.write_bytes(data[:size])
        with pytest.raises(LogError, match="is not an MCAP" if size < 8 else "openbelief recover"):
            everything(cut)


def test_the_prefix_of_a_cut_file_can_be_read_and_the_damage_is_named(small_recording: Path, scratch: Path) -> None:
    whole, data = list(LogReader(small_recording)), small_recording.read_bytes()
    cut = scratch / "cut.mcap"
    cut.write_bytes(data[: len(data) // 3])
    log = LogReader(cut, prefix=True)
    prefix = list(log)
    assert 0 < len(prefix) < len(whole) and prefix == whole[: len(prefix)]
    assert log.damage is not None and "ends in the middle" in log.damage


def test_a_prefix_of_a_flipped_file_is_right_as_far_as_it_goes_and_says_where_it_ends(
    small_recording: Path, scratch: Path
) -> None:
    data, whole = small_recording.read_bytes(), list(LogReader(small_recording))
    damaged = scratch / "damaged.mcap"
    for position in range(8, len(data), 2):
        flipped = bytearray(data)
        flipped[position] ^= 1 << (position % 8)
        damaged.write_bytes(flipped)
        log = LogReader(damaged, prefix=True)
        seen = list(log)
        assert seen == whole[: len(seen)], f"byte {position}"
        assert len(seen) == len(whole) or log.damage is not None, f"byte {position}"


def test_a_recording_that_was_never_finished_is_named(tmp_path: Path) -> None:
    (tmp_path / "walk.mcap.partial").write_bytes(b"x")
    with pytest.raises(LogError, match=r"never finished: openbelief recover .*walk\.mcap\.partial"):
        list(LogReader(tmp_path / "walk.mcap"))


@pytest.mark.parametrize("content", [b"", b"PNG\r\n", b"\x00" * 100])
def test_what_is_no_recording_is_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.mcap").write_bytes(content)
    with pytest.raises(LogError, match="not an MCAP recording"):
        list(LogReader(tmp_path / "a.mcap"))


def bomb(promised: int, expands_to: int) -> bytes:
    """A chunk of a few kB that expands to `expands_to` bytes and promises `promised`."""
    chunk = Chunk("zstd", zstandard.compress(bytes(expands_to), 19), 0, 0, 0, promised)
    builder = RecordBuilder()
    chunk.write(builder)
    return builder.end()


@pytest.mark.parametrize(
    ("promised", "cause"), [(200 << 20, "more than the limit"), (1000, "holds 1001 bytes and promised 1000")]
)
def test_a_small_file_that_would_expand_to_very_much_is_refused(tmp_path: Path, promised: int, cause: str) -> None:
    record = bomb(promised, 200 << 20)
    assert len(record) < 25_000
    (tmp_path / "bomb").write_bytes(record)
    with PositionedFile(tmp_path / "bomb") as source, pytest.raises(Damage, match=cause):
        chunk_records(record_at(source, 0))


def test_a_record_longer_than_the_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(struct.pack("<BQ", 6, 2**62) + b"x" * 50)
    with PositionedFile(tmp_path / "a") as source, pytest.raises(Damage, match="ends in the middle"):
        record_at(source, 0)


@pytest.mark.parametrize("compression", [CompressionType.NONE, CompressionType.LZ4, CompressionType.ZSTD])
@pytest.mark.parametrize("chunked", [True, False])
def test_files_of_other_writers_are_read(tmp_path: Path, compression: CompressionType, chunked: bool) -> None:
    stream = BytesIO()
    writer = Writer(stream, compression=compression, use_chunking=chunked, enable_data_crcs=False)
    writer.start("ros2", "somebody else")
    channel = writer.register_channel("/words", "json", 0)
    for k in range(3):
        writer.add_message(channel, k, b"%d" % k, k)
    writer.finish()
    (tmp_path / "a.mcap").write_bytes(stream.getvalue())
    assert [m.json() for m in LogReader(tmp_path / "a.mcap")] == [0, 1, 2]


def test_a_chunk_whose_checksum_was_made_right_again_still_fails_the_whole_file(
    small_recording: Path, scratch: Path
) -> None:
    """Metadata lies outside every chunk: only its own checksum and the file's protect it."""
    data = small_recording.read_bytes().replace(b"abc", b"abd", 1)
    assert zlib.crc32(data) != zlib.crc32(small_recording.read_bytes())
    (scratch / "b.mcap").write_bytes(data)
    with pytest.raises(LogError, match="metadata record does not match"):
        LogReader(scratch / "b.mcap").metadata()
    with pytest.raises(LogError, match="checksum over the whole file"):
        list(LogReader(scratch / "b.mcap"))


CHUNK_BODY = struct.pack("<QQQII", 1, 2, 5, 7, 4) + b"zstd" + struct.pack("<Q", 6) + b"packed"


@given(
    st.binary(max_size=80)
    | st.integers(0, len(CHUNK_BODY)).map(lambda end: CHUNK_BODY[:end])
    | st.binary(max_size=3).map(lambda more: CHUNK_BODY + more)
    | st.tuples(st.integers(0, len(CHUNK_BODY) - 1), st.integers(0, 255)).map(
        lambda at: CHUNK_BODY[: at[0]] + bytes([at[1]]) + CHUNK_BODY[at[0] + 1 :]
    ),
    st.booleans(),
)
def test_a_chunk_is_read_as_strictly_as_every_other_record(body: bytes, exact: bool) -> None:
    raw = RawRecord(100, Opcode.CHUNK, body, exact)
    try:
        written = parse(raw)
    except Damage:
        with pytest.raises(Damage):
            chunk_of(raw)
        return
    found = chunk_of(raw)
    assert (found.size, found.crc) == (written.uncompressed_size, written.uncompressed_crc)
    assert (found.compression, bytes(found.data)) == (written.compression, written.data)
