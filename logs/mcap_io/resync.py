"""Where the next record begins, past a place where one cannot be read."""

from __future__ import annotations

import struct

from mcap.opcode import Opcode

from logs.mcap_io.scan import MAX_BODY_BYTES, MAX_OTHER_BYTES, PREFIX, READERS, Damage, PositionedFile, Summary

CHUNK_MARKS = (b"\x04\x00\x00\x00zstd", b"\x03\x00\x00\x00lz4")  # a chunk's compressor, with its length before it
MARK_AT = PREFIX.size + 28  # where that stands in a chunk: after two times, the size and the checksum
LAYOUT: dict[int, tuple[int | str, ...]] = {  # bytes of fixed size, or the width of a length and then that much
    Opcode.HEADER: ("I", "I"),
    Opcode.CHUNK: (28, "I", "Q"),
    Opcode.MESSAGE_INDEX: (2, "I"),
    Opcode.ATTACHMENT: (16, "I", "I", "Q", 4),
    Opcode.METADATA: ("I", "I"),
}


def next_record(source: PositionedFile, offset: int, summary: Summary | None) -> int:
    """The nearest end that the damaged record at `offset` declares and a record follows, else the next chunk.

    A record says its length twice, in front and by the lengths of its fields, so one wrong length loses nothing else.
    A record that both ways ends beyond the file was cut short: what lies inside it (an attached recording, say) is no
    record of this file. Returns the file's size where nothing follows.
    """
    ends = _declared_ends(source, offset)
    if len(ends) == 2 and ends[0] == ends[1] > source.size:
        return source.size
    plausible = [end for end in ends if offset < end <= source.size and _could_begin(source, end)]
    return min(plausible) if plausible else _next_chunk(source, offset, summary)


def _declared_ends(source: PositionedFile, offset: int) -> list[int]:
    ends = []
    try:
        opcode, length = PREFIX.unpack(source.read(offset, PREFIX.size))
        ends.append(offset + PREFIX.size + length)
        at = offset + PREFIX.size
        for part in LAYOUT[opcode]:
            at += part if isinstance(part, int) else _sized(source, at, part)
        ends.append(at)
    except (Damage, KeyError):
        return ends  # fewer candidates, that is all
    return ends


def _sized(source: PositionedFile, at: int, width: str) -> int:
    size = struct.calcsize(f"<{width}")
    return size + int(struct.unpack(f"<{width}", source.read(at, size))[0])


def _could_begin(source: PositionedFile, offset: int) -> bool:
    """A known kind and a sane length: random bytes pass once in 10^11."""
    if source.size - offset < PREFIX.size:
        return True
    opcode, length = PREFIX.unpack(source.read(offset, PREFIX.size))
    return opcode in READERS and length <= MAX_BODY_BYTES.get(opcode, MAX_OTHER_BYTES)


def _next_chunk(source: PositionedFile, offset: int, summary: Summary | None) -> int:
    if summary is not None and summary.chunk_offsets is not None:
        return min((at for at in summary.chunk_offsets if at > offset), default=source.size)
    marks = [source.find(mark, offset + 1 + MARK_AT) for mark in CHUNK_MARKS]
    return min((at - MARK_AT for at in marks if at is not None), default=source.size)
