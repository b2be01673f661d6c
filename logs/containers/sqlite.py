"""rosbag2's sqlite3 storage (.db3), read without trusting it: real tables, bounded blobs, in the order of writing."""

from __future__ import annotations

import sqlite3
from collections.abc import Collection, Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from logs.mcap_io.reader import LogError, LogMessage
from logs.mcap_io.scan import MAX_CHUNK_BYTES

TABLES = ("topics", "messages")
MESSAGES = "SELECT id, topic_id, timestamp, data FROM messages WHERE topic_id IN ({}) ORDER BY id"


class SqliteBag:
    """A .db3: `Part`."""

    kind = "rosbag2 sqlite3 database"

    def __init__(self, path: Path) -> None:
        self.path = path
        self.damage: str | None = None

    def messages(self, topics: Collection[str] | None = None) -> Iterator[LogMessage]:
        try:
            with closing(self._open()) as db:
                known = {key: (name, kind, form) for key, name, kind, form in _topics(db)}
                wanted = [key for key, (name, *_) in known.items() if topics is None or name in topics]
                for at, key, time_ns, data in db.execute(MESSAGES.format(", ".join("?" * len(wanted))), wanted):
                    if not isinstance(time_ns, int) or not isinstance(data, bytes):
                        self.damage = f"message {at} is not what rosbag2 writes"
                        return
                    name, kind, form = known[key]
                    yield LogMessage(name, kind, form, time_ns, time_ns, at, data)
        except (sqlite3.Error, OverflowError) as error:
            self.damage = f"its database cannot be read on ({error}); sqlite3's .recover may help"

    def topics(self) -> dict[str, str]:
        try:
            with closing(self._open()) as db:
                return {name: kind for _, name, kind, _ in _topics(db)}
        except sqlite3.Error as error:
            self.damage = f"its database cannot be read ({error})"
            return {}

    def _open(self) -> sqlite3.Connection:
        """A database with a write-ahead log beside it was not closed: then its log is read too, if it can be."""
        log = self.path.with_name(self.path.name + "-wal")
        how = "" if log.is_file() and log.stat().st_size else "&immutable=1"
        db = sqlite3.connect(f"file:{quote(str(self.path.resolve()))}?mode=ro{how}", uri=True)
        try:
            db.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MAX_CHUNK_BYTES)
            db.execute("PRAGMA trusted_schema = OFF")
            held = dict(db.execute("SELECT name, sql FROM sqlite_master WHERE type = 'table'"))
            for table in TABLES:  # a view or a virtual table could compute for ever
                if not str(held.get(table, "")).upper().startswith("CREATE TABLE"):
                    raise LogError(f"{self.path} is an SQLite database, but no rosbag2: it has no table of {table}")
        except BaseException:
            db.close()
            raise
        return db


def _topics(db: sqlite3.Connection) -> list[tuple[int, str, str, str]]:
    rows = db.execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
    return [(key, str(name), str(kind), str(form)) for key, name, kind, form in rows]
