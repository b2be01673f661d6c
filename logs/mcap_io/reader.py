"""Read a recording so that every byte given was checked; a damaged file is refused with the way to mend it."""

from __future__ import annotations

import zlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mcap import records
from mcap.opcode import Opcode

from logs.mcap_io.checksum import ChecksumError, without_checksum
from logs.mcap_io.chunk import chunk_records
from logs.mcap_io.file import DEFINITION
from logs.mcap_io.scan import (
    MAGIC,
    PREFIX,
    Damage,
    PositionedFile,
    RawRecord,
    Summary,
    is_unknown,
    message_fields,
    message_of,
    parse,
    record_at,
    summary_of,
)
from openbelief.documents import from_json

PRIVATE_OPCODES = 0x80  # from here on: other people's records, to be passed over
DATA_OPCODES = frozenset(
    {
        Opcode.HEADER,
        Opcode.SCHEMA,
        Opcode.CHANNEL,
        Opcode.MESSAGE,
        Opcode.CHUNK,
        Opcode.MESSAGE_INDEX,
        Opcode.ATTACHMENT,
        Opcode.METADATA,
        Opcode.DATA_END,
    }
)


class LogError(ValueError):
    """The file is no recording, or a damaged one; the text is one line with the cause and the remedy."""


@dataclass(frozen=True, slots=True)
class LogMessage:
    """One message. stamp_ns: when it was published (its sensor's stamp); log_time_ns: when the recorder took it."""

    topic: str
    type_name: str  # e.g. sensor_msgs/msg/Image, or openbelief/Model for our JSON records
    encoding: str  # "cdr" or "json"
    stamp_ns: int
    log_time_ns: int
    sequence: int
    payload: bytes

    def json(self) -> Any:
        """The parsed record of a JSON message."""
        return from_json(self.payload)


@dataclass(frozen=True, slots=True)
class LogAttachment:
    name: str
    media_type: str
    log_time_ns: int
    data: bytes


class LogReader:
    """Iterate it as often as wanted: each pass opens the file, reads it in file order and checks it again.

    A message is given only after its chunk's checksum held; at the end of a pass the checksum over the whole file is
    compared too. `prefix=True` reads a damaged or unfinished file up to the damage; after the pass `.damage` names it.
    Raises LogError; holds one chunk in memory.
    """

    def __init__(self, path: str | Path, *, prefix: bool = False) -> None:
        self.path = Path(path)
        self.prefix = prefix
        self.damage: str | None = None

    def __iter__(self) -> Iterator[LogMessage]:
        return self.messages()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        """All messages, or those of some topics, in the order in which they were recorded."""
        definitions = Definitions()
        with self._source() as (source, summary):
            for raw in checked_records(source, summary):
                for inner in chunk_records(raw) if raw.opcode == Opcode.CHUNK else (raw,):
                    definitions.add(inner)
                    if inner.opcode != Opcode.MESSAGE:
                        continue
                    channel = definitions.channel(inner)
                    if topics is None or channel.topic in topics:
                        yield definitions.name(inner)

    def attachments(self) -> Iterator[LogAttachment]:
        with self._source() as (source, summary):
            for raw in checked_records(source, summary):
                if raw.opcode == Opcode.ATTACHMENT:
                    record = parse(raw)
                    yield LogAttachment(record.name, record.media_type, record.log_time, record.data)

    def metadata(self) -> dict[str, dict[str, str]]:
        """Name -> values; a later record of the same name replaces an earlier one."""
        found = {}
        with self._source() as (source, summary):
            for raw in checked_records(source, summary):
                if raw.opcode == Opcode.METADATA:
                    record = parse(raw)
                    found[record.name] = without_checksum(record.name, record.metadata)
        return {name: values for name, values in found.items() if not name.startswith(DEFINITION)}  # those: for recover

    def topics(self) -> dict[str, str]:
        """Topic -> type name, without reading the messages where the file has an index."""
        with self._source() as (_, summary):
            if summary is not None and summary.channels:
                names = {key: schema.name for key, schema in summary.schemas.items()}
                return {each.topic: names.get(each.schema_id, "") for each in summary.channels.values()}
        return {message.topic: message.type_name for message in self}

    @contextmanager
    def _source(self) -> Iterator[tuple[PositionedFile, Summary | None]]:
        """The open file and its summary (None when reading a prefix); Damage becomes a refusal, or `.damage`."""
        if not self.path.is_file():
            raise LogError(self._missing())
        with PositionedFile(self.path) as source:
            if source.size < len(MAGIC) or source.read(0, len(MAGIC)) != MAGIC:
                raise LogError(f"{self.path} is not an MCAP recording, or its first bytes are damaged")
            try:
                yield source, self._summary(source)
            except (Damage, ChecksumError) as error:
                if not self.prefix:
                    raise LogError(
                        f"{self.path} is damaged: {error}. "
                        f"Keep what it still holds with: openbelief recover {self.path}"
                    ) from error
                self.damage = str(error)

    def _summary(self, source: PositionedFile) -> Summary | None:
        """The index; None where it is damaged and only a prefix is wanted."""
        try:
            return summary_of(source)
        except Damage as error:
            if not self.prefix:
                raise
            self.damage = str(error)
            return None

    def _missing(self) -> str:
        partial = self.path.with_name(self.path.name + ".partial")
        if partial.is_file():
            return f"{self.path} was never finished: openbelief recover {partial}"
        return f"{self.path} is not there, or not a file"


class Definitions:
    """The schemas and channels seen so far; one that changes its meaning is Damage."""

    def __init__(self, summary: Summary | None = None) -> None:
        self.schemas: dict[int, records.Schema] = dict(summary.schemas) if summary else {}
        self.channels: dict[int, records.Channel] = dict(summary.channels) if summary else {}

    def add(self, raw: RawRecord) -> None:
        if raw.opcode not in (Opcode.SCHEMA, Opcode.CHANNEL):
            return
        record = parse(raw)
        known: dict[int, Any] = self.schemas if raw.opcode == Opcode.SCHEMA else self.channels
        if known.setdefault(record.id, record) != record:
            raise Damage(f"two different definitions carry the number {record.id}")

    def channel(self, raw: RawRecord) -> records.Channel:
        """Of a message; Damage where it is not defined with all that it names."""
        channel_id = message_fields(raw)[0]
        channel = self.channels.get(channel_id)
        if channel is None:
            raise Damage(f"a message belongs to channel {channel_id}, which is nowhere defined")
        if channel.schema_id and channel.schema_id not in self.schemas:
            raise Damage(f"channel {channel.topic} names schema {channel.schema_id}, which is nowhere defined")
        return channel

    def name(self, raw: RawRecord) -> LogMessage:
        """The message with its channel's topic and type (type_name "" where the channel has no schema)."""
        channel, message = self.channel(raw), message_of(raw)
        type_name = self.schemas[channel.schema_id].name if channel.schema_id else ""
        stamps = message.publish_time, message.log_time, message.sequence
        return LogMessage(channel.topic, type_name, channel.message_encoding, *stamps, message.data)


def checked_records(source: PositionedFile, summary: Summary | None) -> Iterator[RawRecord]:
    """The records of the data section, up to its end, whose checksum must hold; Damage at the first that is wrong."""
    crc, offset = zlib.crc32(source.read(0, len(MAGIC))), len(MAGIC)
    chunks = summary.chunk_offsets if summary else None
    in_chunks = bool(chunks)
    while True:
        raw = record_at(source, offset)
        if chunks is not None and (raw.opcode == Opcode.CHUNK) != (offset in chunks):
            raise Damage(f"the record at byte {offset} is not what the index says")
        in_chunks |= raw.opcode == Opcode.CHUNK
        if raw.opcode == Opcode.MESSAGE and in_chunks:
            raise Damage(f"a message stands outside its chunk at byte {offset}")
        known = not is_unknown(raw.opcode) or (source.exact and raw.opcode < PRIVATE_OPCODES)
        if known and raw.opcode not in DATA_OPCODES:
            raise Damage(f"a record of kind {raw.opcode} does not belong at byte {offset}")
        if raw.opcode == Opcode.DATA_END:
            if parse(raw).data_section_crc not in (0, crc):
                raise Damage("the checksum over the whole file does not match")
            return
        yield raw
        crc = zlib.crc32(raw.body, zlib.crc32(PREFIX.pack(raw.opcode, len(raw.body)), crc))
        offset = raw.end
