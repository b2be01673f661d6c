"""The .belief file (SQLite): crash-safe appends while mapping, one sealed read-only file afterwards.

While mapping the file is in WAL mode and every frame is one transaction; `finish` writes the partition and the phrase
embeddings, seals the content and returns to journal_mode=DELETE, so that the one file is all there is to copy.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from openbelief import surroundings_rows
from openbelief.arrays import Array
from openbelief.evidence import Evidence, FrameRecord, canonical_order
from openbelief.observation import Observation, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.rooms import rooms_of
from openbelief.store_rows import COLUMNS, SCHEMA, blob, floats, from_row, seal, to_row
from openbelief.surroundings import CameraView, StoreyMap, Surroundings, ViewImages
from openbelief.taken import Taken

APPLICATION_ID = 0x4F42454C  # "OBEL", in the SQLite header
FORMAT = 1  # user_version; raised when an older reader would misread


class BeliefFileError(ValueError):
    """A .belief file that cannot be used; the message names the cause and the remedy in one line."""


class BeliefStore:
    """The writable file while mapping. Use as a context manager, or call `close`."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._db, self.path = connection, path
        meta = _read_meta(connection)
        self.text_encoder_id: str = meta["text_encoder_id"]
        self.text_dim: int = meta["text_dim"]
        self.feature_text_aligned: bool = meta["feature_text_aligned"]
        self.parameters = Parameters.from_dict(meta["parameters"])
        self.about: dict[str, Any] = meta["about"]
        self.taken = Taken.of_json(meta.get("counts", {}))
        self._mapped: dict[str, set[int]] = {}
        for recording, stamp_ns in connection.execute("SELECT recording, stamp_ns FROM frames NOT INDEXED"):
            self._mapped.setdefault(recording, set()).add(stamp_ns)
        self._left_out: list[FrameRecord] = []

    @classmethod
    def create(
        cls,
        path: str | os.PathLike[str],
        *,
        text_encoder_id: str,
        text_dim: int,
        parameters: Parameters,
        feature_text_aligned: bool,
        about: Mapping[str, Any],
    ) -> Self:
        """A new file; raises FileExistsError where there is one, ValueError where `about` is not JSON.

        Raises BeliefFileError where it cannot be written, as does all that writes to it.
        """
        target = Path(path)
        if target.exists():
            raise FileExistsError(f"{target} exists already: choose another name, or remove it first.")
        meta = {
            "text_encoder_id": text_encoder_id,
            "text_dim": int(text_dim),
            "parameters": parameters.to_dict(),
            "feature_text_aligned": bool(feature_text_aligned),
            "about": dict(about),
        }
        rows = [(key, json.dumps(value, allow_nan=False)) for key, value in meta.items()]
        with _unwritten(target):
            db = _connect_for_writing(target)
            db.executescript(
                f"PRAGMA application_id={APPLICATION_ID}; PRAGMA user_version={FORMAT}; "
                f"BEGIN; {SCHEMA} {surroundings_rows.SCHEMA}"
            )
            db.executemany("INSERT INTO meta VALUES (?, ?)", rows)
            db.execute("COMMIT")  # before WAL: the header alone must say whose file this is
            db.execute("PRAGMA journal_mode=WAL")
        return cls(db, target)

    @classmethod
    def resume(cls, path: str | os.PathLike[str]) -> Self:
        """The file of an interrupted mapping, or a finished one that shall hold more. Raises BeliefFileError."""
        target = Path(path)
        _refuse_foreign(target)
        with _one_line_errors(target):
            db = _connect_for_writing(target)
            _refuse_other_formats(db, target)
            db.execute("PRAGMA journal_mode=WAL")
            db.executescript(surroundings_rows.SCHEMA)  # a file from before there were any
            return cls(db, target)

    def holds(self, recording: str, stamp_ns: int) -> bool:
        """Whether this frame has been mapped already: what was seen in it is kept, or why nothing could be."""
        return stamp_ns in self._mapped.get(recording, ())

    def unmapped(self, frames: Iterable[RgbdFrame]) -> Iterator[RgbdFrame]:
        """Those of the frames that the store does not hold."""
        return (frame for frame in frames if not self.holds(frame.recording, frame.stamp_ns))

    def frames_done(self, recording: str) -> frozenset[int]:
        """Stamps (ns) of the frames that the store `holds`, so that a reader need not decode them again."""
        return frozenset(self._mapped.get(recording, ()))

    def frames(self) -> tuple[FrameRecord, ...]:
        """What mapping dealt with so far, and what was left out."""
        return tuple(sorted([*_read_frames(self._db), *self._left_out]))

    def add_frame(
        self,
        recording: str,
        stamp_ns: int,
        observations: Iterable[Observation],
        refused: Iterable[str] = (),
        skipped: str | None = None,
        view: tuple[CameraView, ViewImages] | None = None,
    ) -> None:
        """One frame, all of it or nothing. ValueError: a frame done already, or another recording's evidence.

        refused: why masks of it gave no observation. skipped: why nothing could be seen in it. Both are counted in
        `taken`, which a run that goes on finds again. view: where it was taken and what it showed, for a keyframe.
        """
        rows = [to_row(o) for o in observations]
        if strangers := {row[0] for row in rows} - {recording}:
            raise ValueError(f"Observations of recording {strangers.pop()!r} given as a frame of {recording!r}.")
        if self.holds(recording, stamp_ns):
            raise ValueError(f"Frame {stamp_ns} of recording {recording!r} is in {self.path} already.")
        taken = self.taken.and_a_frame(len(rows), refused, skipped)
        with self._transaction():
            self._db.execute("DELETE FROM meta WHERE key IN ('content_hash', 'seal')")
            self._db.execute("INSERT INTO frames VALUES (?, ?, ?)", (recording, int(stamp_ns), skipped))
            self._insert(rows)
            if view is not None:
                surroundings_rows.insert_view(self._db, *view)
            self._set_meta("counts", taken.as_json())
        self.taken = taken
        self._mapped.setdefault(recording, set()).add(int(stamp_ns))

    def leave_out(self, recording: str, stamp_ns: int, because: str) -> None:
        """An image that gave no frame. Told by every run that reads it, and written when the file is finished."""
        if not self.holds(recording, stamp_ns):
            self._left_out.append(FrameRecord(recording, int(stamp_ns), because))

    def last_view_pose(self, recording: str, stamp_ns: int) -> Array | None:
        """(4, 4) T_map_camera of the recording's latest keyframe before a stamp; None where there is none."""
        return surroundings_rows.last_pose(self._db, recording, stamp_ns)

    def add_map(self, storey_map: StoreyMap) -> None:
        """A recording's navigation map of one height; one that is there already is replaced."""
        with self._transaction():
            self._db.execute("DELETE FROM meta WHERE key IN ('content_hash', 'seal')")
            surroundings_rows.insert_map(self._db, storey_map)

    def surroundings(self) -> Surroundings:
        """Keyframes and maps so far; their images can be read while the store is open."""
        return surroundings_rows.read_surroundings(self._db, lambda key: surroundings_rows.read_images(self._db, key))

    def observations(self) -> list[Observation]:
        """All evidence so far, in the order it was added."""
        return _read_observations(self._db)

    def finish(self, evidence: Evidence) -> None:
        """Write how the store's observations were partitioned, seal and close. ValueError: it is of other evidence."""
        order, digests = canonical_order(_read_observations(self._db))
        if tuple(digests) != evidence.digests or evidence.text_encoder_id != self.text_encoder_id:
            raise ValueError(f"The memory was not built from the evidence and the text encoder of {self.path}.")
        row_ids = [row_id for (row_id,) in self._db.execute("SELECT id FROM observations ORDER BY id")]
        objects = [(int(o), row_ids[i]) for i, o in zip(order, evidence.partition, strict=True)]
        phrases = [(phrase, blob(row)) for phrase, row in sorted(evidence.embeddings.items())]
        with self._transaction():
            self._db.executemany("INSERT OR IGNORE INTO frames VALUES (?, ?, ?)", map(_frame_row, self._left_out))
            self._db.executemany("UPDATE observations SET object = ? WHERE id = ?", objects)
            self._db.execute("DELETE FROM phrases")
            self._db.executemany("INSERT INTO phrases VALUES (?, ?)", phrases)
            self._set_meta("parameters", evidence.parameters.to_dict())
            self._set_meta("rooms", [room.as_json() for room in evidence.rooms])
            self._set_meta("content_hash", evidence.content_hash)
            self._set_meta("surroundings_seal", surroundings_rows.seal_surroundings(self._db))
            self._set_meta("seal", seal(self._db))
        self._db.execute("PRAGMA journal_mode=DELETE")  # a WAL file copied without its companion is broken
        self.close()

    def close(self) -> None:
        self._db.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with _unwritten(self.path):
            self._db.execute("BEGIN IMMEDIATE")
            try:
                yield
                self._db.execute("COMMIT")
            except BaseException:
                if self._db.in_transaction:  # a full disk has ended it already
                    self._db.execute("ROLLBACK")
                raise

    def _set_meta(self, key: str, value: Any) -> None:
        self._db.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (key, json.dumps(value, allow_nan=False)))

    def _insert(self, rows: list[tuple[Any, ...]]) -> None:
        self._db.executemany(f"INSERT INTO observations ({COLUMNS}) VALUES ({'?, ' * 11}?)", rows)


def read(path: str | os.PathLike[str]) -> Evidence:
    """What a finished file holds, opened so that nothing can change it. Raises BeliefFileError with one clear line."""
    target = Path(path)
    _refuse_foreign(target)
    _refuse_unfinished(target)
    with _one_line_errors(target), closing(_connect_frozen(target)) as db:
        _refuse_other_formats(db, target)
        meta = _read_meta(db)
        if "seal" not in meta:
            raise BeliefFileError(_unfinished(target))
        if meta["seal"] != seal(db):
            raise BeliefFileError(damaged(target, "its content does not match its seal"))
        evidence = _read_all(db, meta, target)
        if evidence.content_hash != meta["content_hash"]:
            raise BeliefFileError(damaged(target, "its content hash is not what its evidence gives"))
        return evidence


def write(path: str | os.PathLike[str], evidence: Evidence) -> None:
    """A finished file, all of it or nothing; one that is there already is replaced.

    Raises BeliefFileError where it cannot be written, ValueError where `about` is not JSON.
    """
    target = Path(path)
    if target.is_dir():
        raise BeliefFileError(f"{target} is a folder: name the file to write in it.")
    if not target.parent.is_dir():
        raise BeliefFileError(f"The folder {target.parent} does not exist: create it, or write to another.")
    with _unwritten(target):
        _write(target, evidence)


def _write(target: Path, evidence: Evidence) -> None:
    partial = target.with_name(f".{target.name}.partial")
    partial.unlink(missing_ok=True)
    try:
        with BeliefStore.create(
            partial,
            text_encoder_id=evidence.text_encoder_id,
            text_dim=evidence.text_dim,
            parameters=evidence.parameters,
            feature_text_aligned=evidence.feature_text_aligned,
            about=evidence.about,
        ) as store:
            with store._transaction():
                store._db.executemany("INSERT INTO frames VALUES (?, ?, ?)", map(_frame_row, evidence.frames))
                store._insert([to_row(o) for o in evidence.observations])
                surroundings_rows.insert_all(store._db, evidence.surroundings)
            store.finish(evidence)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def _connect_for_writing(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, isolation_level=None, timeout=0.2)
    db.execute("PRAGMA locking_mode=EXCLUSIVE")  # a second mapper on the same file is refused
    return db


def _connect_frozen(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)


def read_surroundings(path: Path) -> Surroundings:
    """The keyframes and maps of a finished file. Raises BeliefFileError."""
    _refuse_foreign(path)
    with _one_line_errors(path), closing(_connect_frozen(path)) as db:
        return _read_surroundings(db, _read_meta(db), path)


def read_images(path: Path, key: tuple[str, int]) -> ViewImages:
    """Depth and picture of one keyframe of a finished file. Raises BeliefFileError."""
    _refuse_foreign(path)
    with _one_line_errors(path), closing(_connect_frozen(path)) as db:
        return surroundings_rows.read_images(db, key)


def _read_surroundings(db: sqlite3.Connection, meta: dict[str, Any], path: Path) -> Surroundings:
    if not surroundings_rows.has_surroundings(db):
        return Surroundings()  # a file from before there were any
    if meta.get("surroundings_seal") != surroundings_rows.seal_surroundings(db):
        raise BeliefFileError(damaged(path, "its keyframes and maps do not match their seal"))
    return surroundings_rows.read_surroundings(db, lambda key: read_images(path, key))


def _read_all(db: sqlite3.Connection, meta: dict[str, Any], path: Path) -> Evidence:
    rows = db.execute(f"SELECT {COLUMNS}, object FROM observations ORDER BY id").fetchall()
    observations = [from_row(row[:-1]) for row in rows]
    order, digests = canonical_order(observations)
    return Evidence(
        observations=[observations[i] for i in order],
        digests=digests,
        partition=[rows[i][-1] for i in order],
        embeddings={phrase: floats(row) for phrase, row in db.execute("SELECT phrase, embedding FROM phrases")},
        frames=_read_frames(db),
        rooms=rooms_of(meta.get("rooms", [])),  # older files name none
        about=meta["about"],
        parameters=Parameters.from_dict(meta["parameters"]),
        text_encoder_id=meta["text_encoder_id"],
        text_dim=meta["text_dim"],
        feature_text_aligned=meta["feature_text_aligned"],
        surroundings=_read_surroundings(db, meta, path),
    )


def _read_observations(db: sqlite3.Connection) -> list[Observation]:
    return [from_row(row) for row in db.execute(f"SELECT {COLUMNS} FROM observations ORDER BY id")]


def _frame_row(frame: FrameRecord) -> tuple[str, int, str | None]:
    return frame.recording, frame.stamp_ns, frame.skipped


def _read_frames(db: sqlite3.Connection) -> tuple[FrameRecord, ...]:
    rows = db.execute("SELECT recording, stamp_ns, skipped FROM frames NOT INDEXED ORDER BY recording, stamp_ns")
    return tuple(FrameRecord(*row) for row in rows)


def _read_meta(db: sqlite3.Connection) -> dict[str, Any]:
    return {key: json.loads(value) for key, value in db.execute("SELECT key, value FROM meta")}


def _refuse_foreign(path: Path) -> None:
    """Look at the 100-byte SQLite header before SQLite does: what is it, and is all of it there?"""
    if path.is_dir():
        raise BeliefFileError(f"{path} is a folder, not a memory: name the file that `openbelief map` made in it.")
    if not path.is_file():
        raise BeliefFileError(f"{path} does not exist: build it with `openbelief map`.")
    with path.open("rb") as file:
        header = file.read(100)
    if not header:
        raise BeliefFileError(f"{path} is empty, not an OpenBelief memory: build it again with `openbelief map`.")
    if not header.startswith(b"SQLite format 3\0"[: len(header)]) or (
        len(header) == 100 and int.from_bytes(header[68:72]) != APPLICATION_ID
    ):
        raise BeliefFileError(f"{path} is not an OpenBelief memory: give a file made by `openbelief map`.")
    pages = 0 if 2 in header[18:20] else int.from_bytes(header[28:32])  # in WAL mode the count may run ahead
    if len(header) < 100 or path.stat().st_size < pages * int.from_bytes(header[16:18]):
        raise BeliefFileError(damaged(path, f"it is cut short at {path.stat().st_size} bytes"))


def _refuse_unfinished(path: Path) -> None:
    with path.open("rb") as file:
        if 2 in file.read(20)[18:20]:  # the header's WAL marks
            raise BeliefFileError(_unfinished(path))


def _refuse_other_formats(db: sqlite3.Connection, path: Path) -> None:
    found = db.execute("PRAGMA user_version").fetchone()[0]
    if found > FORMAT:
        raise BeliefFileError(
            f"{path} was written by a newer OpenBelief (format {found}; this one reads {FORMAT}): update OpenBelief."
        )
    if found < FORMAT:
        raise BeliefFileError(damaged(path, f"it claims format {found}, which never existed"))


@contextmanager
def _one_line_errors(path: Path) -> Iterator[None]:
    """Whatever damage breaks the reading (SQLite, JSON, shapes) becomes one BeliefFileError."""
    try:
        yield
    except BeliefFileError:
        raise
    except sqlite3.OperationalError as error:
        if "locked" in str(error):
            raise BeliefFileError(f"{path} is being written by another process: wait until it has finished.") from error
        raise BeliefFileError(damaged(path, str(error))) from error
    except (sqlite3.Error, ValueError, KeyError, TypeError, OverflowError) as error:
        raise BeliefFileError(damaged(path, str(error))) from error


@contextmanager
def _unwritten(path: Path) -> Iterator[None]:
    """What the disk refuses becomes one BeliefFileError."""
    try:
        yield
    except (OSError, sqlite3.Error) as error:
        if isinstance(error, FileExistsError):
            raise
        raise BeliefFileError(f"{path} cannot be written: {error}.") from error


def damaged(path: Path, how: str) -> str:
    return f"{path} is damaged ({how}): copy it again from its source, or build it again with `openbelief map`."


def _unfinished(path: Path) -> str:
    return f"{path} is an unfinished mapping: run the same `openbelief map` command again, it goes on where it stopped."
