"""The .belief file (SQLite): crash-safe appends while mapping, one sealed read-only file afterwards.

While mapping the file is in WAL mode and every frame is one transaction; `finish` writes the partition and the phrase
embeddings, seals the content and returns to journal_mode=DELETE, so that the one file is all there is to copy.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import numpy as np

from openbelief import surroundings_rows
from openbelief.arrays import Array
from openbelief.belief_file import column_of, pieces_made_by, read_frames, read_meta
from openbelief.columns import SCHEMA as COLUMNS_SCHEMA
from openbelief.columns import write_columns
from openbelief.evidence import Evidence, FrameRecord, digest, in_order
from openbelief.file_checks import (
    APPLICATION_ID,
    FORMAT,
    BeliefFileError,
    file_format,
    one_line_errors,
    refuse_computed,
    refuse_foreign,
    unwritten,
)
from openbelief.lifetime import Lifetime
from openbelief.node_columns import BELIEF
from openbelief.node_table import COLUMNS as NODE_COLUMNS
from openbelief.node_table import NodeTable
from openbelief.observation import Observation, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.store_rows import COLUMNS, SCHEMA, from_row, row_digest, seal, to_row
from openbelief.surroundings import CameraView, StoreyMap, Surroundings, ViewImages
from openbelief.taken import Taken

__all__ = ["FORMAT", "BeliefFileError", "BeliefStore", "write"]


class BeliefStore(Lifetime):
    """The writable file while mapping. Use as a context manager, or call `close`."""

    def __init__(self, connection: sqlite3.Connection, path: Path) -> None:
        self._db, self.path = connection, path
        meta = read_meta(connection)
        self.text_encoder_id, self.text_dim = meta.text_encoder_id, meta.text_dim
        self.feature_text_aligned = meta.feature_text_aligned
        self.parameters, self.about = Parameters.from_dict(meta.parameters), meta.about
        self.taken = Taken.of_json(meta.counts)
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
        with unwritten(target):
            db = _connect_for_writing(target)
            db.executescript(
                f"PRAGMA application_id={APPLICATION_ID}; PRAGMA user_version={FORMAT}; "
                f"BEGIN; {SCHEMA} {COLUMNS_SCHEMA} {surroundings_rows.SCHEMA}"
            )
            db.executemany("INSERT INTO meta VALUES (?, ?)", rows)
            db.execute("COMMIT")  # before WAL: the header alone must say whose file this is
            db.execute("PRAGMA journal_mode=WAL")
        return cls(db, target)

    @classmethod
    def resume(cls, path: str | os.PathLike[str]) -> Self:
        """The file of an interrupted mapping, or a finished one that shall hold more. Raises BeliefFileError."""
        target = Path(path)
        refuse_foreign(target)
        with one_line_errors(target):
            db = _connect_for_writing(target)
            file_format(db, target)
            refuse_computed(db, target)
            db.execute("PRAGMA journal_mode=WAL")
            db.executescript(COLUMNS_SCHEMA + surroundings_rows.SCHEMA)  # a file from before there were any
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
        return tuple(sorted([*read_frames(self._db), *self._left_out]))

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

    def view_poses(self, recording: str) -> list[tuple[int, Array]]:
        """(stamp_ns, (4, 4) T_map_camera) of the recording's keyframes so far."""
        return surroundings_rows.poses(self._db, recording)

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
        return [from_row(row) for row in self._db.execute(f"SELECT {COLUMNS} FROM observations ORDER BY id")]

    def finish(self, evidence: Evidence, columns: Mapping[str, Array]) -> None:
        """Write what was made of the store's observations, seal and close. ValueError: it is of other evidence.

        columns: of the nodes, as `node_columns.believe` derived them.
        """
        if evidence.text_encoder_id != self.text_encoder_id:
            raise ValueError(f"The memory was not built with the text encoder of {self.path}.")
        derived = _evidence_columns(self._db, evidence) | {name: columns[name] for name in NODE_COLUMNS}
        derived |= NodeTable(evidence, columns).pieces.columns()
        with self._transaction():
            self._db.executemany("INSERT OR IGNORE INTO frames VALUES (?, ?, ?)", map(_frame_row, self._left_out))
            write_columns(self._db, derived)
            self._set_meta("parameters", evidence.parameters.to_dict())
            self._set_meta("rooms", [room.as_json() for room in evidence.rooms])
            self._set_meta("content_hash", evidence.content_hash)
            self._set_meta("surroundings_seal", surroundings_rows.seal_surroundings(self._db))
            self._set_meta("belief", BELIEF)
            self._set_meta("pieces", pieces_made_by(evidence.content_hash))
            self._set_meta("seal", seal(self._db))
            self._db.execute(f"PRAGMA user_version={FORMAT}")
        self._db.execute("PRAGMA journal_mode=DELETE")  # a WAL file copied without its companion is broken
        self.close()

    def close(self) -> None:
        self._db.close()

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        with unwritten(self.path):
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

    def _insert(self, rows: Iterable[tuple[Any, ...]]) -> None:
        self._db.executemany(f"INSERT INTO observations ({COLUMNS}) VALUES ({'?, ' * 11}?)", rows)


def write(path: str | os.PathLike[str], evidence: Evidence, columns: Mapping[str, Array]) -> None:
    """A finished file, all of it or nothing; one that is there already is replaced.

    Raises BeliefFileError where it cannot be written, ValueError where `about` is not JSON.
    """
    target = Path(path)
    if target.is_dir():
        raise BeliefFileError(f"{target} is a folder: name the file to write in it.")
    if not target.parent.is_dir():
        raise BeliefFileError(f"The folder {target.parent} does not exist: create it, or write to another.")
    with unwritten(target):
        _write(target, evidence, columns)


def _write(target: Path, evidence: Evidence, columns: Mapping[str, Array]) -> None:
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
                store._insert(to_row(o) for o in evidence.observations)
                surroundings_rows.insert_all(store._db, evidence.surroundings)
            store.finish(evidence, columns)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)


def _connect_for_writing(path: Path) -> sqlite3.Connection:
    db = sqlite3.connect(path, isolation_level=None, timeout=0.2)
    db.execute("PRAGMA locking_mode=EXCLUSIVE")  # a second mapper on the same file is refused
    return db


def _evidence_columns(db: sqlite3.Connection, evidence: Evidence) -> dict[str, Array]:
    """EVIDENCE_COLUMNS of the rows in the file. Raises ValueError where they are other evidence."""
    ids, keys, digests, rows = [], [], [], []
    for row_id, *row in db.execute(f"SELECT id, {COLUMNS} FROM observations ORDER BY id"):
        observation = from_row(tuple(row))
        ids.append(row_id)
        keys.append(observation.key)
        digests.append(digest(observation))
        rows.append(row_digest(row))
    order, ordered = in_order(keys, digests)
    if not np.array_equal(ordered, evidence.digests):
        raise ValueError("The memory was not built from the evidence of this file.")
    recordings = sorted({recording for recording, _, _ in keys})
    number = {recording: i for i, recording in enumerate(recordings)}
    return {
        "digest": ordered,
        "partition": evidence.partition,
        "recording": np.array([number[keys[i][0]] for i in order], "<i4"),
        "frame": np.array([keys[i][1] for i in order], "<i8"),
        "mask": np.array([keys[i][2] for i in order], "<i8"),
        "row_id": np.array([ids[i] for i in order], "<i8"),
        "row_sha256": np.frombuffer(b"".join(rows[i] for i in order), np.uint8).reshape(-1, 32),
        "recordings": column_of(recordings),
        "phrases": column_of(evidence.embeddings.phrases),
    }


def _frame_row(frame: FrameRecord) -> tuple[str, int, str | None]:
    return frame.recording, frame.stamp_ns, frame.skipped
