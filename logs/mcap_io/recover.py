"""Rewrite what a truncated or damaged recording still holds; what cannot be proven whole is left out and reported.

The rule: a chunk is taken when its checksum holds, an attachment and a metadata record likewise. Records are found one
after the other; past damage the walk continues at the next place that can only be a record.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap import records
from mcap.opcode import Opcode

from logs.mcap_io.checksum import KEY, ChecksumError, without_checksum
from logs.mcap_io.chunk import chunk_of, chunk_records
from logs.mcap_io.file import DEFINITION, PROFILE, ChannelSpec, McapFile, definition_of
from logs.mcap_io.reader import Definitions, LogError
from logs.mcap_io.recovery_report import RecoveryReport
from logs.mcap_io.resync import next_record
from logs.mcap_io.scan import (
    MAGIC,
    OURS,
    READERS,
    Damage,
    PositionedFile,
    RawRecord,
    Summary,
    attachment_crc,
    is_unknown,
    message_of,
    parse,
    record_at,
    summary_of,
)

KNOWN_PROFILES = ("ros1", "ros2", "")


def recover(source_path: Path, output_path: Path, progress: Callable[[float], None]) -> RecoveryReport:
    """Write a new, finished recording from what `source_path` still holds.

    Raises LogError where there is nothing to keep, FileExistsError rather than overwrite, OSError from the disk; then
    no output is left. `progress` hears the share of the file that has been read.
    """
    if not source_path.is_file():
        raise LogError(f"{source_path} is not there, or not a file")
    report = RecoveryReport(str(source_path), str(output_path))
    with PositionedFile(source_path) as source:
        output = McapFile(output_path, unfinished=".recovering").open(_profile(source))
        try:
            _Recovery(source, output, report).run(progress)
            if not (report.messages or report.attachments or report.metadata):
                raise LogError(f"{source_path} holds no whole chunk, attachment or metadata: there is nothing to keep")
            output.metadata("openbelief.recovered", {"from": source_path.name, "losses": str(report.loss_count)})
            output.finish()
        except BaseException:
            output.abandon().unlink()
            raise
    return report


class _Recovery:
    """One pass over the source."""

    def __init__(self, source: PositionedFile, output: McapFile, report: RecoveryReport) -> None:
        self.source, self.output, self.report = source, output, report
        self.summary = self._summary()
        self.definitions = Definitions(self.summary)
        self.specs: dict[int, ChannelSpec] = {}
        self.loose_definitions = False
        self.ours = _library(source).startswith(OURS)
        self.keepers: dict[int, Callable[[RawRecord], Any]] = {
            Opcode.HEADER: parse,
            Opcode.CHUNK: self._keep_chunk,
            Opcode.MESSAGE_INDEX: parse,
            Opcode.ATTACHMENT: self._keep_attachment,
            Opcode.METADATA: self._keep_metadata,
            Opcode.SCHEMA: self._keep_definition,
            Opcode.CHANNEL: self._keep_definition,
            Opcode.MESSAGE: self._keep_loose_message,
            Opcode.DATA_END: self._end,
        }

    def run(self, progress: Callable[[float], None]) -> None:
        offset, self.ended = len(MAGIC), False
        if self.source.size < len(MAGIC) or self.source.read(0, len(MAGIC)) != MAGIC:
            self.report.lost("first bytes: they do not say that this is an MCAP file")
        while offset < self.source.size and not self.ended:
            offset = self._take(offset)
            progress(offset / self.source.size)
        progress(1.0)
        if self.summary is not None and self.summary.statistics is not None:
            self.report.messages_lost = self.summary.statistics.message_count - self.report.messages

    def _summary(self) -> Summary | None:
        try:
            return summary_of(self.source)
        except Damage as error:
            self.report.lost(f"index: {error}")
            return None

    def _take(self, offset: int) -> int:
        """Keep the record at `offset`, or report it; returns where the next one begins."""
        where = ""
        try:
            raw = record_at(self.source, offset)
            where = f"{_name(raw.opcode)} at byte {offset}: "
            self._keep(raw)
            return raw.end
        except (Damage, ChecksumError) as error:
            self.report.lost(f"{where}{error}")
            return next_record(self.source, offset, self.summary)

    def _keep(self, raw: RawRecord) -> None:
        indexed = self.summary.chunk_offsets if self.summary else None
        if indexed is not None and raw.offset in indexed and raw.opcode != Opcode.CHUNK:
            raise Damage("the index says that this is a chunk")
        if is_unknown(raw.opcode) and not raw.exact:
            self.report.unknown_records += 1  # of a later version, or somebody's own
            return
        if raw.opcode not in self.keepers:
            raise Damage(f"a record of kind {raw.opcode} does not belong here")
        self.keepers[raw.opcode](raw)

    def _keep_chunk(self, raw: RawRecord) -> None:
        self.report.chunks_seen += 1
        inside = chunk_records(raw)
        for each in inside:
            self.definitions.add(each)
            if each.opcode == Opcode.MESSAGE:
                message_of(each)  # the chunk is kept whole or not at all
        verified = chunk_of(raw).crc != 0 and not self.loose_definitions
        messages = (message_of(each) for each in inside if each.opcode == Opcode.MESSAGE)
        nameless = sum(not self._write(each, verified=verified) for each in messages)
        self.report.chunks += 1
        if nameless:
            self.report.lost(
                f"{nameless} messages of the chunk at byte {raw.offset}: nothing says any more what they are"
            )

    def _write(self, message: records.Message, *, verified: bool) -> bool:
        """False where nothing says any more what the message is."""
        spec = self.specs.get(message.channel_id) or self._spec(message.channel_id)
        if spec is None:
            return False
        self.output.write(
            spec,
            log_time_ns=message.log_time,
            stamp_ns=message.publish_time,
            payload=message.data,
            sequence=message.sequence,
        )
        self.report.messages += 1
        self.report.unverified_messages += not verified
        return True

    def _spec(self, channel_id: int) -> ChannelSpec | None:
        channel = self.definitions.channels.get(channel_id)
        schema = self.definitions.schemas.get(channel.schema_id) if channel else None
        if channel is None or (channel.schema_id and schema is None):
            return None
        described = (schema.name, schema.encoding, schema.data) if schema else ("", "", b"")
        self.specs[channel_id] = ChannelSpec(channel.topic, channel.message_encoding, *described, channel.metadata)
        return self.specs[channel_id]

    def _keep_attachment(self, raw: RawRecord) -> None:
        record = parse(raw)
        self.output.attach(record.name, record.media_type, record.data, log_time_ns=record.log_time)
        self.report.attachments += 1
        self.report.unverified_records += attachment_crc(raw) == bytes(4)

    def _keep_metadata(self, raw: RawRecord) -> None:
        record = parse(raw)
        values = without_checksum(record.name, record.metadata)
        if self.ours and KEY not in record.metadata:
            raise ChecksumError(f"the checksum of a metadata record is gone (its name reads {record.name!r})")
        if record.name.startswith(DEFINITION) and KEY in record.metadata:
            channel_id, spec = definition_of(values)
            self.specs.setdefault(channel_id, spec)
            return
        self.output.metadata(record.name, values)
        self.report.metadata += 1
        self.report.unverified_records += KEY not in record.metadata

    def _keep_definition(self, raw: RawRecord) -> None:
        """Outside a chunk no checksum protects it, nor what it names."""
        self.definitions.add(raw)
        self.loose_definitions = True

    def _keep_loose_message(self, raw: RawRecord) -> None:
        """Some writers use no chunks at all; in a file that has them, such a record is a damaged something else."""
        if self.report.chunks_seen or (self.summary and self.summary.chunk_offsets):
            raise Damage("a message outside its chunk")
        if not self._write(message_of(raw), verified=False):
            raise Damage("a message of a channel that is nowhere defined")

    def _end(self, raw: RawRecord) -> None:
        expected = parse(raw).data_section_crc
        self.ended = True
        if expected and self.report.complete and expected != self.source.crc(0, raw.offset):
            self.report.lost("the checksum over the whole file does not match: its index is wrong, its messages hold")


def _profile(source: PositionedFile) -> str:
    """The source's profile where it is one that exists: nothing protects the header of an unfinished file."""
    head = _header(source)
    return head.profile if head is not None and head.profile in KNOWN_PROFILES else PROFILE


def _library(source: PositionedFile) -> str:
    head = _header(source)
    return head.library if head is not None else ""


def _header(source: PositionedFile) -> records.Header | None:
    try:
        raw = record_at(source, len(MAGIC))
        return parse(raw) if raw.opcode == Opcode.HEADER else None
    except Damage:
        return None


def _name(opcode: int) -> str:
    return Opcode(opcode).name.lower().replace("_", " ") if opcode in READERS else "unknown record"
