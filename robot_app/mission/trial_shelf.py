"""The trials of a folder as one list: each is read once, and again only where its file changed.

What was read is kept in `.trials-index.json` beside them, so that two thousand trials are listed at once.
"""

from __future__ import annotations

import json
import re
import secrets
import threading
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from logs.mcap_io.reader import LogError, LogReader
from logs.trial.records import RECORDS, Checks, Chosen, Ended, Exclusion, Query, Record
from openbelief.documents import from_json
from robot_app.mission.trials import stories_of

INDEX = ".trials-index.json"
FORMAT = 1
TOPICS = frozenset(kind.topic for kind in (Query, Chosen, Checks, Exclusion, Ended))
NAME = re.compile(r"[A-Za-z0-9][\w.-]{0,120}\.mcap", re.ASCII)


class TrialShelf:
    """Thread-safe. `rows` never reads a trial; `read_new` does, a few at a time."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._lock = threading.Lock()
        self._known: dict[str, dict[str, Any]] = _stored(folder / INDEX)

    def rows(self) -> list[dict[str, Any]]:
        """One for each trial, the newest first; {"name", "size", "reading": True} where it was not read yet."""
        found = []
        with self._lock:
            for path, stamp in self._files():
                known = self._known.get(path.name)
                if known is None or known["stamp"] != stamp:
                    found.append(
                        {"name": path.name, "size": stamp[1], "started_ms": stamp[0] // 1_000_000, "reading": True}
                    )
                elif not known["row"].get("other"):
                    found.append({"name": path.name, "size": stamp[1], **known["row"]})
        return sorted(found, key=lambda row: (row["started_ms"], row["name"]), reverse=True)

    def read_new(self, limit: int = 20) -> int:
        """Read some of the trials that are new or changed, the newest first; how many are left."""
        with self._lock:
            new = [
                (path, stamp) for path, stamp in self._files() if self._known.get(path.name, {}).get("stamp") != stamp
            ]
        new.sort(key=lambda entry: entry[1], reverse=True)
        for path, stamp in new[:limit]:
            row = row_of(path, stamp[0] // 1_000_000)
            with self._lock:
                self._known[path.name] = {"stamp": stamp, "row": row}
        if new:
            self._store()
        return max(0, len(new) - limit)

    def path(self, name: str) -> Path | None:
        """The trial of that name in this folder, None where it is no name of one."""
        path = self.folder / name
        return path if NAME.fullmatch(name) and path.is_file() and not path.is_symlink() else None

    def _files(self) -> Iterable[tuple[Path, list[int]]]:
        for path in self.folder.glob("*.mcap"):
            if NAME.fullmatch(path.name) and not path.is_symlink():
                try:
                    found = path.stat()
                except FileNotFoundError:
                    continue  # it was moved away meanwhile
                yield path, [found.st_mtime_ns, found.st_size]

    def _store(self) -> None:
        with self._lock:
            text = json.dumps({"format": FORMAT, "trials": self._known})
        unfinished = self.folder / f"{INDEX}.{secrets.token_hex(4)}.partial"  # another console may list them, too
        try:
            unfinished.write_text(text, encoding="utf-8")
            unfinished.replace(self.folder / INDEX)
        except OSError:
            unfinished.unlink(missing_ok=True)  # a folder that is not ours to write in: it is read again next time


def row_of(path: Path, written_ms: int) -> dict[str, Any]:
    """What the list says of one file. broken: why it cannot be read. other: it is a recording of something else.

    written_ms: its time where it says none itself; a file that was moved away meanwhile has no other.
    """
    try:
        found, started_ns = _records(path)
    except (LogError, OSError) as error:
        return {"started_ms": written_ms, "broken": str(error)}
    query = next((record for record in found if isinstance(record, Query)), None)
    if query is None:
        return {"started_ms": 0, "other": True}
    ended = next((record for record in reversed(found) if isinstance(record, Ended)), None)
    return {
        "started_ms": started_ns // 1_000_000,
        "sentence": query.sentence,
        "who": query.who,
        "outcome": ended.end if ended else "UNFINISHED",
        "reason": ended.reason if ended else "cut off before its end",
        "visits": ended.visits if ended else 0,
        "candidates": [list(story) for story in stories_of(found).values()],
    }


def _records(path: Path) -> tuple[list[Record], int]:
    """The records that the list needs, and when the first was written; images are passed over."""
    found: list[Record] = []
    started_ns = 0
    for message in LogReader(path).messages(TOPICS):
        started_ns = started_ns or message.log_time_ns
        try:
            found.append(RECORDS[message.topic].model_validate_json(message.payload))
        except ValidationError as error:
            raise LogError(f"a record on {message.topic} cannot be read: {str(error).splitlines()[0]}") from error
    return found, started_ns


def _stored(path: Path) -> dict[str, dict[str, Any]]:
    """The index of last time; none where it is another version's, or no index."""
    try:
        stored = from_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return stored["trials"] if isinstance(stored, dict) and stored.get("format") == FORMAT else {}
