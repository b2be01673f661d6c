"""MCAP records as they lie in a file, read so strictly that damage is an exception and never other data.

The library's own readers pass over short reads, take a missing record for the end, and expand a 17 kB file to 1 GB;
here every length is checked against the file, every record must write back to the bytes it came from, every checksum
that is there must match, and sizes are capped.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode

MAGIC = b"\x89MCAP0\r\n"
PREFIX = struct.Struct("<BQ")  # opcode, length of the body
MESSAGE = struct.Struct("<HIQQ")  # channel id, sequence, log time, publish time
MAX_CHUNK_BYTES = 64 << 20  # expanded; rosbag2 and we write 1 MB, a raw 4K image is 25 MB
MAX_ATTACHMENT_BYTES = 1 << 30  # lies in the file as it is, so the file must be as big: no bomb
MAX_BODY_BYTES = {
    Opcode.CHUNK: MAX_CHUNK_BYTES,
    Opcode.MESSAGE: MAX_CHUNK_BYTES,
    Opcode.ATTACHMENT: MAX_ATTACHMENT_BYTES,
}
MAX_OTHER_BYTES = 16 << 20
READERS: dict[int, Any] = {
    Opcode.HEADER: records.Header.read,
    Opcode.FOOTER: records.Footer.read,
    Opcode.SCHEMA: records.Schema.read,
    Opcode.CHANNEL: records.Channel.read,
    Opcode.CHUNK: records.Chunk.read,
    Opcode.MESSAGE_INDEX: records.MessageIndex.read,
    Opcode.CHUNK_INDEX: records.ChunkIndex.read,
    Opcode.ATTACHMENT: records.Attachment.read,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex.read,
    Opcode.STATISTICS: records.Statistics.read,
    Opcode.METADATA: records.Metadata.read,
    Opcode.METADATA_INDEX: records.MetadataIndex.read,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset.read,
    Opcode.DATA_END: records.DataEnd.read,
}


class Damage(Exception):
    """The bytes are not what a writer wrote, or not what this reader is willing to expand; the text says which."""


@dataclass(frozen=True, slots=True)
class RawRecord:
    """One record: where it begins, what it says it is, and its bytes."""

    offset: int
    opcode: int
    body: bytes

    @property
    def end(self) -> int:
        return self.offset + PREFIX.size + len(self.body)

    @property
    def whole(self) -> bytes:
        return PREFIX.pack(self.opcode, len(self.body)) + self.body


@dataclass
class Summary:
    """The index at the end of a file whose checksum holds. chunk_offsets: None where the writer kept no chunk index."""

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    chunk_offsets: set[int] | None = None
    statistics: records.Statistics | None = None


class Source:
    """A file read by position. The context manager owns the handle."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> Source:
        self._file = self.path.open("rb")
        self.size = self._file.seek(0, 2)
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, offset: int, length: int) -> bytes:
        """Exactly `length` bytes, else Damage."""
        self._file.seek(offset)
        data = self._file.read(length) if 0 <= length <= self.size - offset else b""
        if len(data) != length:
            raise Damage(f"the file ends in the middle of a record, at byte {offset}")
        return data

    def crc(self, start: int, end: int, window: int = 1 << 22) -> int:
        value = 0
        for at in range(start, end, window):
            value = zlib.crc32(self.read(at, min(window, end - at)), value)
        return value

    def find(self, needle: bytes, start: int, window: int = 1 << 22) -> int | None:
        """The first position of `needle` at or after `start`, else None."""
        while start < self.size:
            at = self.read(start, min(window, self.size - start)).find(needle)
            if at >= 0:
                return start + at
            start += window - len(needle) + 1
        return None


def record_at(source: Source, offset: int) -> RawRecord:
    """The record that begins at `offset`; Damage where it does not fit into the file or its size limit."""
    opcode, length = PREFIX.unpack(source.read(offset, PREFIX.size))
    if length > source.size - offset - PREFIX.size:
        raise Damage(f"the file ends in the middle of a record, at byte {offset}")
    limit = MAX_BODY_BYTES.get(opcode, MAX_OTHER_BYTES)
    if length > limit:
        raise Damage(f"a record at byte {offset} has {length} bytes, more than the limit of {limit}")
    return RawRecord(offset, opcode, source.read(offset + PREFIX.size, length))


def parse(raw: RawRecord) -> Any:
    """The record as mcap's dataclass. It must write back to the same bytes, which finds every short read."""
    try:
        record = READERS[raw.opcode](ReadDataStream(BytesIO(raw.body)))
        builder = RecordBuilder()
        record.write(builder)
    except (KeyError, McapError, struct.error, ValueError, OverflowError, MemoryError) as error:
        raise Damage(f"the record at byte {raw.offset} cannot be read") from error
    written = builder.end()
    if raw.opcode == Opcode.ATTACHMENT and raw.body[-4:] == bytes(4):
        written = written[:-4] + bytes(4)  # a writer may leave the attachment's checksum out
    if written != raw.whole:
        raise Damage(f"the record at byte {raw.offset} is not as it was written")
    return record


def chunk_records(raw: RawRecord) -> Iterator[RawRecord]:
    """The records in a chunk, all checked before the first is given: checksum, sizes, opcodes."""
    data = _expand(parse(raw), raw.offset)
    inside, at = [], 0
    while at < len(data):
        if at + PREFIX.size > len(data):
            raise Damage(f"the chunk at byte {raw.offset} ends in the middle of a record")
        opcode, length = PREFIX.unpack_from(data, at)
        body = data[at + PREFIX.size : at + PREFIX.size + length]
        if len(body) != length:
            raise Damage(f"the chunk at byte {raw.offset} ends in the middle of a record")
        inside.append(RawRecord(at, opcode, body))
        at += PREFIX.size + length
    return iter(inside)


def message_of(raw: RawRecord) -> records.Message:
    if len(raw.body) < MESSAGE.size:
        raise Damage(f"the message at byte {raw.offset} is too short")
    channel_id, sequence, log_time, publish_time = MESSAGE.unpack_from(raw.body)
    return records.Message(
        channel_id=channel_id,
        sequence=sequence,
        log_time=log_time,
        publish_time=publish_time,
        data=raw.body[MESSAGE.size :],
    )


def summary_of(source: Source) -> Summary:
    """The summary section; Damage where the end of the file, the footer or the checksum is not as written."""
    tail = PREFIX.size + 20 + len(MAGIC)
    if source.size < len(MAGIC) + tail or source.read(source.size - len(MAGIC), len(MAGIC)) != MAGIC:
        raise Damage("it has no end: the recorder was killed, or the copy was cut short")
    footer_raw = record_at(source, source.size - tail)
    if footer_raw.opcode != Opcode.FOOTER:
        raise Damage("its footer is damaged")
    footer = parse(footer_raw)
    start = footer.summary_start or footer_raw.offset
    if not len(MAGIC) <= start <= footer_raw.offset:
        raise Damage("its footer is damaged")
    checked = source.read(start, footer_raw.offset - start) + footer_raw.whole[:-4]
    if footer.summary_crc not in (0, zlib.crc32(checked)):
        raise Damage("the checksum of its index does not match")
    return _read_summary(source, start, footer_raw.offset)


def _read_summary(source: Source, offset: int, end: int) -> Summary:
    summary, chunks = Summary(), set()
    while offset < end:
        raw = record_at(source, offset)
        offset = raw.end
        record = parse(raw) if raw.opcode in READERS else None
        if isinstance(record, records.Schema):
            summary.schemas[record.id] = record
        elif isinstance(record, records.Channel):
            summary.channels[record.id] = record
        elif isinstance(record, records.ChunkIndex):
            chunks.add(record.chunk_start_offset)
        elif isinstance(record, records.Statistics):
            summary.statistics = record
    if chunks or (summary.statistics is not None and summary.statistics.chunk_count == 0):
        summary.chunk_offsets = chunks
    return summary


def _expand(chunk: records.Chunk, offset: int) -> bytes:
    size = chunk.uncompressed_size
    if size > MAX_CHUNK_BYTES:
        raise Damage(
            f"the chunk at byte {offset} would expand to {size} bytes, more than the limit of {MAX_CHUNK_BYTES}"
        )
    if chunk.compression not in EXPANDERS:
        raise Damage(f"the chunk at byte {offset} is compressed with {chunk.compression!r}, which is unknown")
    try:
        data = EXPANDERS[chunk.compression](chunk.data, size)
    except Exception as error:  # each compressor raises its own kinds, and all mean the same here
        raise Damage(f"the chunk at byte {offset} cannot be decompressed") from error
    if len(data) != size:
        raise Damage(f"the chunk at byte {offset} holds {len(data)} bytes and promised {size}")
    if chunk.uncompressed_crc not in (0, zlib.crc32(data)):
        raise Damage(f"the checksum of the chunk at byte {offset} does not match")
    return data


def _expand_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    return bytes(zstandard.ZstdDecompressor().stream_reader(data).read(size + 1))  # never more than was promised


def _expand_lz4(data: bytes, size: int) -> bytes:
    import lz4.frame  # type: ignore[import-untyped]

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))


EXPANDERS: dict[str, Any] = {"": lambda data, _size: data, "zstd": _expand_zstd, "lz4": _expand_lz4}
