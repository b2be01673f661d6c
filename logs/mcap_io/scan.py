"""MCAP records as they lie in a file, read so strictly that damage is an exception and never other data.

The library's own readers pass over short reads, take a missing record for the end, and expand a 17 kB file to 1 GB;
here every length is checked against the file, every record must write back to the bytes it came from, every checksum
that is there must match, and sizes are capped.

A later version of MCAP may add fields at a record's end and records of new kinds: as the format demands, both are
passed over. In our own files there are none, so there they are damage (a length or a kind hit by a flipped bit).
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from mcap import records
from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode

OURS = "openbelief "  # our library's name in the header
MAGIC = b"\x89MCAP0\r\n"
PREFIX = struct.Struct("<BQ")  # opcode, length of the body
MESSAGE = struct.Struct("<HIQQ")  # channel id, sequence, log time, publish time
MAX_CHUNK_BYTES = 64 << 20  # expanded; rosbag2 and we write 1 MB, a raw 4K image is 25 MB
MAX_ATTACHMENT_BYTES = 1 << 30  # lies in the file as it is, so the file must be as big: no bomb
LARGE_CHUNK_BYTES = 1 << 30  # where the file holds a hundredth of it
MAX_BODY_BYTES = {
    Opcode.CHUNK: LARGE_CHUNK_BYTES,
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
    """One record: where it begins, what it says it is, and its bytes. exact: nothing may follow the known fields.

    body: of a record in a chunk a view of the chunk, for pictures are large.
    """

    offset: int
    opcode: int
    body: bytes | memoryview
    exact: bool = True

    @property
    def end(self) -> int:
        return self.offset + PREFIX.size + len(self.body)

    @property
    def whole(self) -> bytes:
        return PREFIX.pack(self.opcode, len(self.body)) + bytes(self.body)


@dataclass
class Summary:
    """The index at the end of a file whose checksum holds. chunk_offsets: None where the writer kept no chunk index."""

    schemas: dict[int, records.Schema] = field(default_factory=dict)
    channels: dict[int, records.Channel] = field(default_factory=dict)
    chunk_offsets: set[int] | None = None
    statistics: records.Statistics | None = None


class PositionedFile:
    """A file read by position. The context manager owns the handle."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.exact = True

    def __enter__(self) -> PositionedFile:
        self._file = self.path.open("rb")
        self.size = self._file.seek(0, 2)
        self.exact = _is_ours(self)
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


def record_at(source: PositionedFile, offset: int) -> RawRecord:
    """The record that begins at `offset`; Damage where it does not fit into the file or its size limit."""
    opcode, length = PREFIX.unpack(source.read(offset, PREFIX.size))
    if length > source.size - offset - PREFIX.size:
        raise Damage(f"the file ends in the middle of a record, at byte {offset}")
    limit = MAX_BODY_BYTES.get(opcode, MAX_OTHER_BYTES)
    if length > limit:
        raise Damage(f"a record at byte {offset} has {length} bytes, more than the limit of {limit}")
    return RawRecord(offset, opcode, source.read(offset + PREFIX.size, length), source.exact)


def parse(raw: RawRecord) -> Any:
    """The record as mcap's dataclass. It must write back to the bytes it came from, which finds every short read."""
    body = bytes(raw.body)
    try:
        record = READERS[raw.opcode](ReadDataStream(BytesIO(body)))
        builder = RecordBuilder()
        record.write(builder)
    except (KeyError, McapError, struct.error, ValueError, OverflowError, MemoryError) as error:
        raise Damage(f"the record at byte {raw.offset} cannot be read") from error
    written = builder.end()[PREFIX.size :]
    if raw.opcode == Opcode.ATTACHMENT and body[len(written) - 4 : len(written)] == bytes(4):
        written = written[:-4] + bytes(4)  # a writer may leave the attachment's checksum out
    if not body.startswith(written) or (raw.exact and len(written) < len(body)):
        raise Damage(f"the record at byte {raw.offset} is not as it was written")
    return record


def attachment_crc(raw: RawRecord) -> bytes:
    """The checksum of an attachment, zero where its writer left it out; fields of a later version may follow it."""
    builder = RecordBuilder()
    parse(raw).write(builder)
    end = len(builder.end()) - PREFIX.size
    return bytes(raw.body[end - 4 : end])


def is_unknown(opcode: int) -> bool:
    """A kind of record that this version does not know: a later version's below 0x80, somebody's own from there on."""
    return opcode not in READERS and opcode != Opcode.MESSAGE


def message_fields(raw: RawRecord) -> tuple[int, int, int, int]:
    """Channel id, sequence, log time and publish time."""
    if len(raw.body) < MESSAGE.size:
        raise Damage(f"the message at byte {raw.offset} is too short")
    return MESSAGE.unpack_from(raw.body)


def message_of(raw: RawRecord) -> records.Message:
    channel_id, sequence, log_time, publish_time = message_fields(raw)
    return records.Message(
        channel_id=channel_id,
        sequence=sequence,
        log_time=log_time,
        publish_time=publish_time,
        data=bytes(raw.body[MESSAGE.size :]),
    )


def summary_of(source: PositionedFile) -> Summary:
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


def _is_ours(source: PositionedFile) -> bool:
    """Whether our recorder wrote it, as its header says; what cannot be read is taken for ours, and read strictly."""
    at = len(MAGIC)
    source.exact = False  # a header may have fields of a later version, too
    try:
        head = record_at(source, at)
        return str(parse(head).library).startswith(OURS) if head.opcode == Opcode.HEADER else True
    except Damage:
        return True


def _read_summary(source: PositionedFile, offset: int, end: int) -> Summary:
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
