"""A trial's file read back, every byte checked: records in order, each with its images, points, grid or sound."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from pydantic import ValidationError

from drivers.ros.messages import WireError, decode
from logs.mcap_io.reader import LogError, LogMessage, LogReader
from logs.trial import pictures
from logs.trial.header import (
    CONFIGURATION_NAME,
    FORMAT,
    MEMORY_NAME,
    SETTINGS_NAME,
    NoTrial,
    TrialError,
    TrialHeader,
)
from logs.trial.journal import Entry, Sound
from logs.trial.records import RECORDS, Cloud, Ended, Frame, MapUsed, Query, Record, Spoken
from openbelief.documents import from_json
from openbelief.settings import first_complaint
from openbelief.traversability import OccupancyGrid


class TrialReader:
    """A whole trial. Raises TrialError (or LogError) with one line where it is damaged, cut off or no trial.

    entries: every record in the order in which it was written, with its images or grid.
    """

    def __init__(self, path: Path) -> None:
        self.path, self._log = path, LogReader(path)
        metadata = self._log.metadata()
        identity = _known_format(path, metadata.get("trial", {}))
        self.versions, self.commit = metadata.get("versions", {}), identity.get("commit", "unknown")
        self.started_ns = int(identity["started_ns"])
        self._attachments = {a.name: a.data for a in self._log.attachments()}
        if SETTINGS_NAME not in self._attachments:
            raise TrialError(f"{path} lacks {SETTINGS_NAME}: it was edited; copy it from the robot again")
        self.about = TrialHeader.from_metadata(identity, from_json(self._attachments[SETTINGS_NAME]))
        self.entries = list(self._read())

    @property
    def memory_bytes(self) -> bytes | None:
        """The attached .belief file, None where only its hash was kept."""
        return self._attachments.get(MEMORY_NAME)

    @property
    def configuration(self) -> str | None:
        """The text of its robot.toml, None where it had none."""
        data = self._attachments.get(CONFIGURATION_NAME)
        return None if data is None else data.decode()

    @property
    def records(self) -> list[Record]:
        return [entry.record for entry in self.entries]

    @property
    def decisions(self) -> list[Record]:
        return [record for record in self.records if record.role == "decision"]

    @property
    def query(self) -> Query:
        found = next((record for record in self.records if isinstance(record, Query)), None)
        if found is None:
            raise TrialError(f"{self.path} holds no query: it was cut off before the mission began")
        return found

    @property
    def outcome(self) -> Ended | None:
        """None where the trial was cut off before its end."""
        return next((record for record in reversed(self.records) if isinstance(record, Ended)), None)

    def whole(self) -> TrialReader:
        """Itself; raises TrialError where the mission's end is missing."""
        if self.outcome is None:
            raise TrialError(f"{self.path} was cut off before the mission's end: it has no outcome to compare")
        return self

    def _read(self) -> Iterator[Entry]:
        entries = _Entries(self._attachments)
        for message in self._log:
            try:
                if message.topic in pictures.TOPICS:
                    entries.keep(message)
                elif message.topic in RECORDS:
                    yield entries.of(message)
            except LogError:
                raise
            except (ValidationError, WireError, KeyError, ValueError) as error:
                raise TrialError(
                    f"{self.path}: a record on {message.topic} cannot be read: {_first_words(error)}"
                ) from error


class _Entries:
    """Records joined with what was written before them. A grid is written once, and named by its hash after that."""

    def __init__(self, attachments: Mapping[str, bytes]) -> None:
        self._attachments = attachments
        self._pictures: pictures.Pictures = {}
        self._grids: dict[str, OccupancyGrid] = {}

    def keep(self, message: LogMessage) -> None:
        self._pictures[message.topic] = decode(message.payload, message.type_name)

    def of(self, message: LogMessage) -> Entry:
        record = RECORDS[message.topic].model_validate_json(message.payload)
        return replace(self._entry(record), log_time_ns=message.log_time_ns)

    def _entry(self, record: Record) -> Entry:
        if isinstance(record, Frame):
            return Entry(record, pictures.frame_of(record, self._pictures))
        if isinstance(record, Cloud):
            return Entry(record, pictures.lidar_cloud_of(record, self._pictures))
        if isinstance(record, MapUsed):
            if record.sha256 not in self._grids:
                self._grids[record.sha256] = pictures.grid_of(record, self._pictures)
            return Entry(record, self._grids[record.sha256])
        if isinstance(record, Spoken):
            return Entry(record, Sound(self._attachments[record.audio]))
        return Entry(record)


def _known_format(path: Path, identity: dict[str, str]) -> dict[str, str]:
    if "format" not in identity:
        raise NoTrial(f"{path} is no trial, but a recording of something else")
    if identity["format"] != FORMAT:
        raise TrialError(
            f"{path} is a trial of format {identity['format']}, and this openbelief replays {FORMAT}: replay it "
            f"with the commit that recorded it ({identity.get('commit', 'unknown')}), or add its migration "
            "(tests/replay/README.md says how)"
        )
    return identity


def _first_words(error: Exception) -> str:
    """One line; of pydantic's several, the field and what is wrong with it."""
    if isinstance(error, ValidationError):
        return first_complaint(error, "it")
    return str(error).splitlines()[0] if str(error) else type(error).__name__
