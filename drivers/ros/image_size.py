"""How large a compressed image says it is, before anything of that size is allocated."""

from __future__ import annotations

import struct

PNG = b"\x89PNG\r\n\x1a\n"
JPEG = b"\xff\xd8"
START_OF_FRAME = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # the JPEG markers that carry a size
START_OF_SCAN, FILL = 0xDA, 0xFF


def declared_size(data: bytes) -> tuple[int, int]:
    """(width, height) from the header of a PNG or JPEG; raises ValueError where there is none."""
    try:
        if data.startswith(PNG):
            width, height = struct.unpack_from(">II", data, 16)
            return width, height
        if data.startswith(JPEG):
            return _jpeg_size(data)
    except (struct.error, IndexError) as error:
        raise ValueError("the header is cut off") from error
    raise ValueError("neither JPEG nor PNG")


def _jpeg_size(data: bytes) -> tuple[int, int]:
    """Walk the segments up to the frame's header."""
    at = len(JPEG)
    while True:
        if data[at] != FILL:
            raise ValueError("a JPEG segment is out of place")
        marker = data[at + 1]
        if marker == FILL:  # padding
            at += 1
            continue
        if marker in START_OF_FRAME:
            height, width = struct.unpack_from(">HH", data, at + 5)
            return width, height
        if marker == START_OF_SCAN:
            raise ValueError("a JPEG scan comes before its size")
        at += 2 + int(struct.unpack_from(">H", data, at + 2)[0])
