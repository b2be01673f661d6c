"""The evidence of a mapping: crash-safe appends to a .belief file, which is sealed and read-only afterwards.

While mapping the file is in WAL mode and every frame is one transaction; `finish` writes the partition and the phrase
embeddings, seals the content and returns to journal_mode=DELETE, so that the one file is all there is to copy.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Self

from openbelief import surroundings_rows
from openbelief.arrays import Array
from openbelief.belief_file import pieces_made_by, read_frames, read_meta
from openbelief.columns import write_columns
from openbelief.evidence import Evidence, FrameRecord
from openbelief.file_checks import FORMAT, BeliefFileError, one_line_errors
from openbelief.kept_rows import KeptRows
from openbelief.lifetime import Lifetime
from openbelief.node_columns import BELIEF
from openbelief.node_table import COLUMNS as NODE_COLUMNS
from openbelief.node_table import NodeTable
from openbelief.observation import Observation, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.surroundings import CameraView, StoreyMap, Surroundings, ViewImages
from openbelief.taken import Taken
from openbelief.writable_file import WritableFile

__all__ = ["FORMAT", "BeliefFileError", "BeliefStore"]
INSERT_FRAME = "INSERT INTO frames VALUES (?, ?, ?)"
INSERT_LEFT_OUT = "INSERT OR IGNORE INTO frames VALUES (?, ?, ?)"


class BeliefStore(Lifetime):
    """The writable file while mapping. Use as a context manager, or call `close`."""

    def __init__(self, file: WritableFile) -> None:
        self._file, self._db, self.path = file, file.db, file.path
        meta = read_meta(self._db)
        self.text_encoder_id, self.text_dim = meta.text_encoder_id, meta.text_dim
        self.feature_text_aligned = meta.feature_text_aligned
        self.parameters, self.about = Parameters.from_dict(meta.parameters), meta.about
        self.taken = Taken.of_json(meta.counts)
        self._rows, self._added = KeptRows(self._db), list[Observation]()
        self._mapped: dict[str, set[int]] = {}
        for recording, stamp_ns in self._db.execute("SELECT recording, stamp_ns FROM frames NOT INDEXED"):
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
        meta = {
            "text_encoder_id": text_encoder_id,
            "text_dim": int(text_dim),
            "parameters": parameters.to_dict(),
            "feature_text_aligned": bool(feature_text_aligned),
            "about": dict(about),
        }
        return cls(WritableFile.create(Path(path), meta))

    @classmethod
    def resume(cls, path: str | os.PathLike[str]) -> Self:
        """The file of an interrupted mapping, or a finished one that shall hold more. Raises BeliefFileError."""
        file = WritableFile.resume(Path(path))
        with one_line_errors(file.path):
            return cls(file)

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
        seen = list(observations)
        if strangers := {o.recording for o in seen} - {recording}:
            raise ValueError(f"Observations of recording {strangers.pop()!r} given as a frame of {recording!r}.")
        if self.holds(recording, stamp_ns):
            raise ValueError(f"Frame {stamp_ns} of recording {recording!r} is in {self.path} already.")
        taken = self.taken.and_a_frame(len(seen), refused, skipped)
        with self._file.transaction():
            self._file.unseal()
            self._db.execute(INSERT_FRAME, (recording, int(stamp_ns), skipped))
            rows = self._rows.insert(seen)
            if view is not None:
                surroundings_rows.insert_view(self._db, *view)
            self._file.set_meta("counts", taken.as_json())
        self.taken = taken
        self._rows.added(rows)
        self._added += seen
        self._mapped.setdefault(recording, set()).add(int(stamp_ns))

    def add_memory(self, evidence: Evidence) -> None:
        """All that a memory rests on, at once and into a new file; no observation is held in memory."""
        with self._file.transaction():
            self._db.executemany(INSERT_FRAME, map(_frame_row, evidence.frames))
            rows = self._rows.insert(evidence.observations)
            surroundings_rows.insert_all(self._db, evidence.surroundings)
        self._rows.added(rows)

    def leave_out(self, recording: str, stamp_ns: int, because: str) -> None:
        """An image that gave no frame. Told by every run that reads it, and written when the file is finished."""
        if not self.holds(recording, stamp_ns):
            self._left_out.append(FrameRecord(recording, int(stamp_ns), because))

    def view_poses(self, recording: str) -> list[tuple[int, Array]]:
        """(stamp_ns, (4, 4) T_map_camera) of the recording's keyframes so far."""
        return surroundings_rows.poses(self._db, recording)

    def add_map(self, storey_map: StoreyMap) -> None:
        """A recording's navigation map of one height; one that is there already is replaced."""
        with self._file.transaction():
            self._file.unseal()
            surroundings_rows.insert_map(self._db, storey_map)

    def surroundings(self) -> Surroundings:
        """Keyframes and maps so far; their images can be read while the store is open."""
        return surroundings_rows.read_surroundings(self._db, lambda key: surroundings_rows.read_images(self._db, key))

    def observations(self) -> list[Observation]:
        """All evidence so far, in the order it was added: those of this run as they were given, the others as read."""
        return [*self._rows.earlier(), *self._added]

    def finish(self, evidence: Evidence, columns: Mapping[str, Array]) -> None:
        """Write what was made of the store's observations, seal and close. ValueError: it is of other evidence.

        columns: of the nodes, as `node_columns.believe` derived them.
        """
        if evidence.text_encoder_id != self.text_encoder_id:
            raise ValueError(f"The memory was not built with the text encoder of {self.path}.")
        derived = self._rows.columns(evidence) | {name: columns[name] for name in NODE_COLUMNS}
        derived |= NodeTable(evidence, columns).pieces.columns()
        with self._file.transaction():
            self._db.executemany(INSERT_LEFT_OUT, map(_frame_row, self._left_out))
            write_columns(self._db, derived)
            self._file.set_meta("parameters", evidence.parameters.to_dict())
            self._file.set_meta("rooms", [room.as_json() for room in evidence.rooms])
            self._file.set_meta("content_hash", evidence.content_hash)
            self._file.set_meta("surroundings_seal", surroundings_rows.seal_surroundings(self._db))
            self._file.set_meta("belief", BELIEF)
            self._file.set_meta("pieces", pieces_made_by(evidence.content_hash))
            self._file.seal()
        self._file.leave_wal()
        self.close()

    def close(self) -> None:
        self._file.close()


def _frame_row(frame: FrameRecord) -> tuple[str, int, str | None]:
    return frame.recording, frame.stamp_ns, frame.skipped
