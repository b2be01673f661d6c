"""One MCAP file being written: `PATH.partial` until it is whole, on the disk and renamed."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib.metadata import version
from pathlib import Path

from mcap.records import SummaryOffset
from mcap.writer import CompressionType, Writer

from logs.mcap_io.checksum import with_checksum
from openbelief.documents import from_json

CHUNK_BYTES = 1 << 20  # what a crash can lose at most, and what a reader must decompress at once
PROFILE = "ros2"
DEFINITION = "openbelief.channel/"  # and its number: the metadata record that says again what a channel is


@dataclass(frozen=True)
class ChannelSpec:
    """What a channel says about its messages. `schema`: ros2msg text or JSON Schema."""

    topic: str
    encoding: str  # "cdr" or "json"
    schema_name: str
    schema_encoding: str  # "ros2msg" or "jsonschema"
    schema: bytes
    metadata: Mapping[str, str] = field(default_factory=dict, compare=False)


def definition_values(channel_id: int, spec: ChannelSpec) -> dict[str, str]:
    """A channel as metadata: its definition in the first chunk must not be the only one an unfinished file has."""
    return {
        "id": str(channel_id),
        "topic": spec.topic,
        "encoding": spec.encoding,
        "schema_name": spec.schema_name,
        "schema_encoding": spec.schema_encoding,
        "schema": spec.schema.decode("latin-1"),  # any bytes, and text stays readable
        "metadata": json.dumps(dict(spec.metadata)),
    }


def definition_of(values: Mapping[str, str]) -> tuple[int, ChannelSpec]:
    """The inverse of `definition_values`; their checksum was verified before."""
    spec = ChannelSpec(
        values["topic"],
        values["encoding"],
        values["schema_name"],
        values["schema_encoding"],
        values["schema"].encode("latin-1"),
        from_json(values["metadata"]),
    )
    return int(values["id"]), spec


class WholeWrites:
    """An unbuffered file where a write lands whole or not at all, so that a full disk leaves whole records."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        self._end = 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[os.write(self._fd, rest) :]
        except OSError:
            os.ftruncate(self._fd, self._end)
            os.lseek(self._fd, self._end, os.SEEK_SET)
            raise
        self._end += len(data)
        return len(data)

    def tell(self) -> int:
        return self._end

    def flush(self) -> None:
        """Nothing is buffered here; `sync` is what reaches the disk."""

    def sync(self) -> None:
        os.fsync(self._fd)

    def close(self) -> None:
        fd, self._fd = self._fd, -1  # closed once: by then the number may be another file's
        if fd >= 0:
            os.close(fd)


class McapFile:
    """Writes channels, messages, attachments and metadata; raises OSError when the disk refuses."""

    def __init__(self, path: Path, unfinished: str = ".partial") -> None:
        """unfinished: what the name ends in until the file is whole."""
        self.path = path
        self.partial = path.with_name(path.name + unfinished)
        self.pending = 0  # messages in the open chunk, not yet given to the disk
        self._channels: dict[ChannelSpec, int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._sequences: dict[int, int] = {}

    def open(self, profile: str = PROFILE) -> McapFile:
        """Create the file; what exists is never overwritten (FileExistsError), its folder is there (or OSError)."""
        require_free(self.path, self.partial)
        self._sink = WholeWrites(self.partial)
        self._writer = Writer(
            self._sink,  # type: ignore[arg-type]  # it asks only for write, tell and flush
            chunk_size=CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_crcs=True,
            enable_data_crcs=True,
        )
        self._writer._Writer__summary_offsets = _FullGroups()  # type: ignore[attr-defined]
        self._writer.start(profile=profile, library=_library())
        _sync_folder(self.path.parent)
        return self

    @property
    def bytes_written(self) -> int:
        return self._sink.tell()

    def write(
        self, spec: ChannelSpec, *, log_time_ns: int, stamp_ns: int, payload: bytes, sequence: int | None = None
    ) -> None:
        """`sequence` counts each channel's messages from 1, unless a number from before is to be kept."""
        channel = self._channels.get(spec) or self._register(spec)
        self._sequences[channel] = self._sequences.get(channel, 0) + 1 if sequence is None else sequence
        written = self.bytes_written
        self.pending += 1
        self._writer.add_message(channel, log_time_ns, payload, stamp_ns, self._sequences[channel] & 0xFFFFFFFF)
        if self.bytes_written > written:
            self.pending = 0  # that message filled the chunk

    def _register(self, spec: ChannelSpec) -> int:
        key = (spec.schema_name, spec.schema_encoding, spec.schema)
        schema_id = 0  # MCAP's word for "no schema"
        if any(key):
            schema_id = self._schemas.get(key) or self._writer.register_schema(*key)
            self._schemas[key] = schema_id
        channel = self._writer.register_channel(spec.topic, spec.encoding, schema_id, dict(spec.metadata))
        self._channels[spec] = channel
        self._finish_chunk()
        name = f"{DEFINITION}{channel}"
        self._writer.add_metadata(name, with_checksum(name, definition_values(channel, spec)))
        return channel

    def attach(self, name: str, media_type: str, data: bytes, *, log_time_ns: int) -> None:
        """The open chunk is finished first, so that the file's order is the order of events."""
        self._finish_chunk()
        self._writer.add_attachment(log_time_ns, log_time_ns, name, media_type, data)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """MCAP gives metadata no checksum of its own: one is added, the reader checks it and takes it away."""
        self._finish_chunk()
        self._writer.add_metadata(name, with_checksum(name, values))

    def flush(self) -> None:
        """Finish the open chunk and put everything on the disk."""
        self._finish_chunk()
        self._sink.sync()

    def _finish_chunk(self) -> None:
        self._writer.flush()
        self.pending = 0

    def finish(self) -> Path:
        """Write the index, sync, and give the file its name."""
        self._finish_chunk()
        self._writer.finish()
        self._sink.sync()
        self._sink.close()
        self.partial.rename(self.path)
        _sync_folder(self.path.parent)
        return self.path

    def abandon(self) -> Path:
        """Close without an index (the disk refused): the whole records written so far stay in `.partial`."""
        try:
            self._sink.sync()
        finally:
            self._sink.close()
        return self.partial


class _FullGroups(list[SummaryOffset]):
    """The summary's groups: mcap 1.6.0 also points at groups with nothing in them, which the format has no room for."""

    def append(self, offset: SummaryOffset) -> None:
        if offset.group_length:
            super().append(offset)


def require_free(*paths: Path) -> None:
    """Raises FileExistsError, or FileNotFoundError where the folder is missing: one line with the remedy."""
    for path in paths:
        if not path.parent.is_dir():
            raise FileNotFoundError(f"{path.parent} is no folder: make it first, or name a file elsewhere")
        if path.exists():
            raise FileExistsError(f"{path} exists and is never overwritten: move it away, or name another file")


@cache
def _library() -> str:
    return f"openbelief {version('openbelief')}"


def _sync_folder(folder: Path) -> None:
    fd = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(fd)
    finally:
        os.close(fd)
