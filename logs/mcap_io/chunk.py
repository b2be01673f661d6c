"""A chunk of an MCAP file: expanded within bounds and checked as a whole before a record of it is given."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from logs.mcap_io.scan import LARGE_CHUNK_BYTES, MAX_CHUNK_BYTES, PREFIX, Damage, RawRecord

FIELDS = struct.Struct("<QQQII")  # first and last log time, expanded size and checksum, length of the compressor's name
LENGTH = struct.Struct("<Q")
LARGE_CHUNK_RATIO = 100  # between a large chunk and what it expands to, at most
MAX_CHUNK_RECORDS = 1 << 20  # of less than 64 bytes on average in a chunk of the largest size: no message is so small


def chunk_records(raw: RawRecord) -> ChunkRecords:
    """The records in a chunk, all checked before the first is given: checksum, sizes, opcodes."""
    data = _expand(chunk_of(raw), raw.offset)
    starts, at = 0, 0
    while at < len(data):
        if len(data) - at < PREFIX.size:
            raise Damage(f"the chunk at byte {raw.offset} ends in the middle of a record")
        at += PREFIX.size + PREFIX.unpack_from(data, at)[1]
        starts += 1
        if starts > MAX_CHUNK_RECORDS:
            raise Damage(f"the chunk at byte {raw.offset} holds more than {MAX_CHUNK_RECORDS} records, the limit")
    if at != len(data):
        raise Damage(f"the chunk at byte {raw.offset} ends in the middle of a record")
    return ChunkRecords(data, raw.exact)


@dataclass(frozen=True, slots=True)
class Chunk:
    """A chunk that is not expanded yet. crc: of what it expands to, 0 where its writer left it out."""

    size: int
    crc: int
    compression: str
    data: memoryview


def chunk_of(raw: RawRecord) -> Chunk:
    """As strict as `parse`, of the one kind of record that is too large to be written back for a comparison."""
    body = memoryview(raw.body)
    try:
        _, _, size, crc, width = FIELDS.unpack_from(body)
        begin = FIELDS.size + width + LENGTH.size
        compression = str(body[FIELDS.size : FIELDS.size + width], "utf-8")
        [length] = LENGTH.unpack_from(body, FIELDS.size + width)
    except (struct.error, UnicodeDecodeError) as error:
        raise Damage(f"the record at byte {raw.offset} cannot be read") from error
    if length > len(body) - begin or (raw.exact and length < len(body) - begin):
        raise Damage(f"the record at byte {raw.offset} is not as it was written")
    return Chunk(size, crc, compression, body[begin : begin + length])


@dataclass(frozen=True)
class ChunkRecords:
    """The records of a checked chunk, as often as wanted, one at a time: many small ones are large as objects."""

    data: bytes
    exact: bool

    def __iter__(self) -> Iterator[RawRecord]:
        view, at = memoryview(self.data), 0
        while at < len(view):
            opcode, length = PREFIX.unpack_from(view, at)
            begin = at + PREFIX.size
            yield RawRecord(at, opcode, view[begin : begin + length], self.exact)
            at = begin + length


def _expand(chunk: Chunk, offset: int) -> bytes:
    size = chunk.size
    limit = max(MAX_CHUNK_BYTES, min(LARGE_CHUNK_BYTES, LARGE_CHUNK_RATIO * len(chunk.data)))
    if size > limit:
        raise Damage(
            f"the chunk at byte {offset} would expand to {size} bytes, more than the limit of {limit}: "
            "record with smaller chunks, or rewrite the file with smaller ones"
        )
    if chunk.compression not in EXPANDERS:
        raise Damage(f"the chunk at byte {offset} is compressed with {chunk.compression!r}, which is unknown")
    try:
        data = EXPANDERS[chunk.compression](chunk.data, size)
    except Exception as error:  # each compressor raises its own kinds, and all mean the same here
        raise Damage(f"the chunk at byte {offset} cannot be decompressed") from error
    if len(data) != size:
        raise Damage(f"the chunk at byte {offset} holds {len(data)} bytes and promised {size}")
    if chunk.crc not in (0, zlib.crc32(data)):
        raise Damage(f"the checksum of the chunk at byte {offset} does not match")
    return data


def _expand_zstd(data: bytes, size: int) -> bytes:
    import zstandard

    return bytes(zstandard.ZstdDecompressor().stream_reader(data).read(size + 1))  # never more than was promised


def _expand_lz4(data: bytes, size: int) -> bytes:
    import lz4.frame  # type: ignore[import-untyped]

    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=size + 1))


EXPANDERS: dict[str, Any] = {"": lambda data, _size: bytes(data), "zstd": _expand_zstd, "lz4": _expand_lz4}
