"""What every container of a recording gives, and the table of them by their first bytes."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Protocol

from logs.mcap_io.reader import LogError, LogMessage
from logs.mcap_io.scan import MAGIC

MCAP, ZSTD, SQLITE, ROS1 = MAGIC, b"\x28\xb5\x2f\xfd", b"SQLite format 3\0", b"#ROSBAG V"
# First bytes -> what it is and the way out, of what cannot be read
FOREIGN = {
    b"\x1f\x8b": "is compressed with gzip: gunzip it first",
    b"PK\x03\x04": "is a zip archive: unpack it first",
    b"\xfd7zXZ": "is compressed with xz: unxz it first",
    b"BZh": "is compressed with bzip2: bunzip2 it first",
    b"\x04\x22\x4d\x18": "is compressed with lz4: unlz4 it first",
    b"\x89HDF": "is an HDF5 file, not a recording of ROS messages",
    b"version https://git-lfs": "is a Git LFS pointer, not the recording itself: git lfs pull",
}


class Part(Protocol):
    """One file of a recording, read in file order, as often as wanted, up to its first damage."""

    path: Path

    @property
    def kind(self) -> str:
        """For a person: "MCAP", "rosbag2 sqlite3 database", "ROS 1 bag"."""
        ...

    @property
    def damage(self) -> str | None: ...

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]: ...

    def topics(self) -> dict[str, str]:
        """Topic -> type name."""
        ...


def first_bytes(path: Path) -> bytes:
    """Raises LogError where the file cannot be read."""
    try:
        with path.open("rb") as file:
            return file.read(32)
    except OSError as error:
        raise LogError(f"{path} cannot be read: {error.strerror}") from error


def refuse_foreign(path: Path, head: bytes) -> None:
    """Raises LogError on a file that is known for something else."""
    for magic, words in FOREIGN.items():
        if head.startswith(magic):
            raise LogError(f"{path} {words}")
