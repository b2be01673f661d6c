"""One recording, whatever holds it: MCAP, sqlite3, a ROS 1 bag, any of them as zstd, or a folder of such files."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import cached_property
from pathlib import Path

from logs.containers.folder import files_of
from logs.containers.part import MCAP, ROS1, SQLITE, ZSTD, Part, first_bytes, refuse_foreign
from logs.containers.ros1 import Ros1Bag, as_ros2
from logs.containers.sqlite import SqliteBag
from logs.containers.zstd import PayloadError, expanded_file, expanded_payload
from logs.mcap_io.reader import LogError, LogMessage, LogReader

ID_WINDOW_BYTES = 1 << 20
UNPACKED = "zstd"  # the encoding of a message that could not be expanded


class McapPart(LogReader):
    """An MCAP file up to its first damage: `Part`."""

    kind = "MCAP"

    def __init__(self, path: Path) -> None:
        super().__init__(path, prefix=True)


class Recording:
    """Read in the order of its files, as often as wanted; after a pass `damage` says what could not be read.

    Messages that rosbag2 compressed one by one come out plain, those of ROS 1 as CDR. Raises LogError where the path
    holds no recording.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    @cached_property
    def parts(self) -> list[Part]:
        return [open_part(path) for path in self._files[0]]

    @property
    def kind(self) -> str:
        """What it is, for a person."""
        kinds = " and ".join(dict.fromkeys(part.kind for part in self.parts))
        return f"folder of {kinds}" if self.path.is_dir() else kinds

    @property
    def damage(self) -> str | None:
        said = [f"{self._files[1][0]} is listed in metadata.yaml and is not there"] if self._files[1] else []
        several = len(self.parts) > 1
        said += [f"{p.path.name}: {p.damage}" if several else p.damage for p in self.parts if p.damage]
        return "; ".join(said) or None

    def require(self) -> None:
        """Raises LogError where there is no recording."""
        assert self.parts

    def __iter__(self) -> Iterator[LogMessage]:
        return self.messages()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        for part in self.parts:
            for message in part.messages(topics):
                yield _plain(message)

    def topics(self) -> dict[str, str]:
        """Topic -> type name."""
        return {topic: kind for part in self.parts for topic, kind in part.topics().items()}

    @cached_property
    def _files(self) -> tuple[list[Path], list[str]]:
        return files_of(self.path) if self.path.is_dir() else ([self.path], [])


def open_part(path: Path) -> Part:
    """Raises LogError where the file is not there, or none of the containers that can be read."""
    if not path.is_file():
        raise LogError(_missing(path))
    head = first_bytes(path)
    if head.startswith(ZSTD):
        return PackedPart(path)
    if head.startswith(SQLITE):
        return SqliteBag(path)
    if head.startswith(ROS1):
        return Ros1Bag(path)
    if not head.startswith(MCAP):
        refuse_foreign(path, head)
        raise LogError(f"{path} is not an MCAP recording, or its first bytes are damaged")
    return McapPart(path)


def recording_id(path: str | Path) -> str:
    """The name's stem and a short hash of its size, first and last MiB: the same wherever it lies."""
    where = Path(path)
    if where.is_dir():
        digest = hashlib.sha256("".join(map(_digest, files_of(where)[0])).encode())
        return f"{where.resolve().name}-{digest.hexdigest()[:8]}"
    return f"{where.stem}-{_digest(where)[:8]}"


def _digest(path: Path) -> str:
    size = path.stat().st_size
    digest = hashlib.sha256(str(size).encode())
    with path.open("rb") as file:
        digest.update(file.read(ID_WINDOW_BYTES))
        file.seek(max(size - ID_WINDOW_BYTES, 0))
        digest.update(file.read(ID_WINDOW_BYTES))
    return digest.hexdigest()


class PackedPart:
    """A file that is zstd as a whole, read from its expanded copy: `Part`."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._expanded = expanded_file(path)
        try:
            self._inner = open_part(self._expanded.path)
        except LogError as error:
            why = self._expanded.damage or "what it expands to is no recording that can be read"
            raise LogError(f"{path}: {why}") from error
        self.kind = f"{self._inner.kind} in zstd"

    @property
    def damage(self) -> str | None:
        return self._expanded.damage or self._inner.damage

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        return self._inner.messages(topics)

    def topics(self) -> dict[str, str]:
        return self._inner.topics()


def _missing(path: Path) -> str:
    partial = path.with_name(path.name + ".partial")
    if partial.is_file():
        return f"{path} was never finished: openbelief recover {partial}"
    return f"{path} is not there, or not a file"


def _plain(message: LogMessage) -> LogMessage:
    """The message as ROS 2 sends it, where it can be made so."""
    if message.encoding == "cdr" and message.payload.startswith(ZSTD):
        try:
            return replace(message, payload=expanded_payload(message.payload))
        except PayloadError:
            return replace(message, encoding=UNPACKED)
    if message.encoding == "ros1":
        return as_ros2(message)
    return message
