"""Zstandard around a recording: whole files (rosbag2's compression mode "file"), single messages (mode "message")."""

from __future__ import annotations

import shutil
import tempfile
import weakref
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO

from logs.containers.part import ZSTD
from logs.mcap_io.reader import LogError

MAX_MESSAGE_BYTES = 64 << 20  # a raw 4K image is 25 MB
READ_BYTES = 4096  # zstd can make 30 000 times as much of it
KEEP_FREE_BYTES = 1 << 30
BOMB_RATIO, BOMB_BYTES = 1000, 1 << 30  # real recordings shrink to a hundredth at most


class PayloadError(ValueError):
    """A compressed message that does not expand, or to more than the limit."""


def expanded_payload(payload: bytes) -> bytes:
    """The message inside a zstd frame; other payloads as they are (no CDR begins with zstd's four bytes)."""
    if not payload.startswith(ZSTD):
        return payload
    import zstandard

    try:
        with zstandard.ZstdDecompressor().stream_reader(payload) as stream:
            data = bytes(stream.read(MAX_MESSAGE_BYTES + 1))
    except zstandard.ZstdError as error:
        raise PayloadError(f"its zstd compression is damaged ({error})") from error
    if len(data) > MAX_MESSAGE_BYTES:
        raise PayloadError(f"it expands to more than the limit of {MAX_MESSAGE_BYTES} bytes")
    return data


class Expanded:
    """A file expanded into a temporary folder that goes with this object."""

    def __init__(self, source: Path) -> None:
        folder = tempfile.mkdtemp(prefix="openbelief-zstd-")
        self._remove = weakref.finalize(self, shutil.rmtree, folder, True)
        self.path = Path(folder, source.name.removesuffix(".zstd").removesuffix(".zst"))
        self.damage = _expand(source, self.path)


def expanded_file(path: Path) -> Expanded:
    """The expanded file, made once for as long as the original stays as it is. Raises LogError."""
    status = path.stat()
    return _expanded(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=64)
def _expanded(path: Path, _size: int, _mtime_ns: int) -> Expanded:
    return Expanded(path)


def _expand(source: Path, target: Path) -> str | None:
    """What cut it short, None where it is whole; raises LogError where it is too large or nothing comes of it."""
    import zstandard

    limit = BOMB_BYTES + BOMB_RATIO * source.stat().st_size
    written = 0
    try:
        with source.open("rb") as packed, target.open("wb") as plain:
            for block in _blocks(packed):
                written += len(block)
                if written > limit:
                    raise LogError(f"{source} expands to more than {limit} bytes: this is no recording's compression")
                if shutil.disk_usage(target.parent).free < KEEP_FREE_BYTES:
                    raise LogError(
                        f"{source} does not fit into {target.parent.parent} when it is expanded: "
                        "make room there, point TMPDIR elsewhere, or expand it yourself with: zstd -d"
                    )
                plain.write(block)
    except (zstandard.ZstdError, EOFError) as error:
        if not written:
            raise LogError(f"{source} is not whole zstd ({error}): copy it again") from error
        return f"its zstd compression breaks off after {written} bytes ({error})"
    return None


def _blocks(packed: BinaryIO) -> Iterator[bytes]:
    """All frames one after the other. Raises EOFError where the last one is cut: zstandard itself would not say so."""
    import zstandard

    frame, ended = zstandard.ZstdDecompressor().decompressobj(), False
    while block := packed.read(READ_BYTES):
        while block:
            yield frame.decompress(block)
            ended = bool(frame.eof)
            block = frame.unused_data if ended else b""
            if ended:
                frame = zstandard.ZstdDecompressor().decompressobj()
    if not ended:
        raise EOFError("the file ends in the middle")
