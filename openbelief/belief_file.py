"""A finished .belief file, opened so that nothing can change it; what is read is checked when it is read.

The connection stays open, so the memory reads from the file that was opened even where another has taken its name.
"""

from __future__ import annotations

import json
import os
import sqlite3
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from threading import RLock
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openbelief import surroundings_rows
from openbelief.arrays import Array, read_only
from openbelief.columns import Column, SealedColumns, read_data, read_manifest
from openbelief.documents import from_json
from openbelief.embedding import PhraseEmbeddings
from openbelief.evidence import Evidence, FrameRecord, canonical_order
from openbelief.file_checks import (
    BeliefFileError,
    damaged,
    file_format,
    one_line_errors,
    refuse_computed,
    refuse_foreign,
    refuse_unfinished,
    unfinished,
)
from openbelief.node_columns import BELIEF, believe
from openbelief.node_table import COLUMNS as NODE_COLUMNS
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.pieces import COSINE, PIECE_COLUMNS, RADIUS_M
from openbelief.rooms import rooms_of
from openbelief.settings import first_complaint
from openbelief.store_rows import COLUMNS, FRAMES, first_seal, floats, from_row, row_digest, seal
from openbelief.stored_observations import Key, StoredKeys, StoredObservations
from openbelief.surroundings import Surroundings, ViewImages

# n observations in canonical order; texts are JSON in UTF-8.
META_BYTES_MAX = 16 << 20  # of one value; rooms of a large building have some 100 kB
EVIDENCE_COLUMNS = {
    "digest": Column("|u1", ("n", 32)),
    "partition": Column("<i8", ("n",), below="N"),
    "recording": Column("<i4", ("n",)),  # which of `recordings`
    "frame": Column("<i8", ("n",)),
    "mask": Column("<i8", ("n",)),
    "row_id": Column("<i8", ("n",)),
    "row_sha256": Column("|u1", ("n", 32)),  # of the observation's row, its picture included
    "recordings": Column("|u1", ("r",)),
    "phrases": Column("|u1", ("t",)),
}


class FileMeta(BaseModel):
    """The rows of `meta`. belief: by which code the columns of the nodes were made; None in files without them.

    pieces: how those of the pieces were made, and of which content; None in files without them.
    """

    model_config = ConfigDict(strict=True)

    text_encoder_id: str
    text_dim: Annotated[int, Field(ge=1, le=1 << 16)]
    feature_text_aligned: bool
    parameters: dict[str, Any]
    about: dict[str, Any]
    counts: dict[str, Any] = {}
    rooms: list[Any] = []  # files from before there were any name none
    content_hash: str | None = None
    surroundings_seal: str | None = None
    seal: str | None = None
    belief: int | None = None
    pieces: dict[str, Any] | None = None


def read_meta(db: sqlite3.Connection) -> FileMeta:
    """Raises ValueError in one line where a value is missing or of the wrong kind."""
    values = {
        key: from_json(value, max_bytes=META_BYTES_MAX)
        for key, value in db.execute("SELECT key, value FROM meta NOT INDEXED")
    }
    try:
        return FileMeta.model_validate(values)
    except ValidationError as error:
        raise ValueError(f"its {first_complaint(error)}") from error


def pieces_made_by(content_hash: str) -> dict[str, Any]:
    """What is written beside the pieces: those found otherwise, or of other evidence, are found anew."""
    return {"radius_m": RADIUS_M, "cosine": COSINE, "content_hash": content_hash}


def read_frames(db: sqlite3.Connection) -> tuple[FrameRecord, ...]:
    """Raises ValueError where a row is none."""
    rows = db.execute(FRAMES).fetchall()
    for recording, stamp_ns, skipped in rows:
        if type(recording) is not str or type(stamp_ns) is not int or not isinstance(skipped, str | None):
            raise ValueError("a row of its frames is none")
    return tuple(FrameRecord(*row) for row in rows)


class BeliefFile:
    """Raises BeliefFileError with one clear line, here and wherever more is read."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path, self._lock = Path(path), RLock()
        refuse_foreign(self.path)
        refuse_unfinished(self.path)
        with one_line_errors(self.path):
            uri = f"{self.path.absolute().as_uri()}?mode=ro&immutable=1"
            self._db = sqlite3.connect(uri, uri=True, check_same_thread=False)
            self._format = file_format(self._db, self.path)
            refuse_computed(self._db, self.path)
            self.meta = read_meta(self._db)
            if self.meta.seal is None:
                raise BeliefFileError(unfinished(self.path))
            if self.meta.seal != (seal if self._format > 1 else first_seal)(self._db):
                raise BeliefFileError(damaged(self.path, "its content does not match its seal"))
            if self._format > 1:
                self._shapes, self._digests = read_manifest(self._db)

    def evidence(self) -> Evidence:
        """What the memory rests on; each observation is read when it is asked for."""
        with self._reading():
            evidence = self._evidence_of_columns() if self._format > 1 else self._evidence_of_rows()
            if evidence.content_hash != self.meta.content_hash:
                raise BeliefFileError(damaged(self.path, "its content hash is not what its evidence gives"))
            return evidence

    def node_columns(self, evidence: Evidence) -> Mapping[str, Array]:
        """Belief as it was derived when the file was written; derived now where other code made it, or none did."""
        with self._reading():
            if self._format == 1 or self.meta.belief != BELIEF:
                return believe(evidence)
            known = self.meta.pieces == pieces_made_by(evidence.content_hash)
            return self._sealed(NODE_COLUMNS | (PIECE_COLUMNS if known else {}), P=len(evidence.embeddings.phrases))

    def surroundings(self) -> Surroundings:
        """Keyframes and maps; a keyframe's images are read when they are asked for."""
        with self._reading():
            if not surroundings_rows.has_surroundings(self._db):
                return Surroundings()  # a file from before there were any
            if self.meta.surroundings_seal != surroundings_rows.seal_surroundings(self._db):
                raise BeliefFileError(damaged(self.path, "its keyframes and maps do not match their seal"))
            return surroundings_rows.read_surroundings(self._db, self._images)

    @contextmanager
    def _reading(self) -> Iterator[None]:
        with self._lock, one_line_errors(self.path):
            yield

    def _images(self, key: tuple[str, int]) -> ViewImages:
        with self._reading():
            return surroundings_rows.read_images(self._db, key)

    def _sealed(self, specification: Mapping[str, Column], **sizes: int) -> SealedColumns:
        sizes |= {"d": self.meta.text_dim, "N": self._shapes["concept_start"][0] - 1}
        sizes |= {"D": self.meta.text_dim} if self.meta.feature_text_aligned else {}
        read = partial(read_data, self._db)
        return SealedColumns(specification, self._shapes, self._digests, sizes, read, self._reading)

    def _evidence_of_columns(self) -> Evidence:
        columns = self._sealed(EVIDENCE_COLUMNS)
        recordings, phrases = texts_of(columns["recordings"]), texts_of(columns["phrases"])
        keys = StoredKeys(recordings, *(columns[name] for name in ("recording", "frame", "mask")))
        rows = self._sealed({"phrase_embedding": NODE_COLUMNS["phrase_embedding"]}, P=len(phrases))
        return self._evidence(
            observations=StoredObservations(keys, partial(self._observation, columns, keys)),
            digests=columns["digest"],
            partition=columns["partition"],
            embeddings=PhraseEmbeddings(phrases, lambda: rows["phrase_embedding"]),
        )

    def _observation(self, columns: SealedColumns, keys: Sequence[Key], i: int) -> Observation:
        """The i-th one in canonical order, where it is what the seal says."""
        with self._reading():
            query = f"SELECT {COLUMNS} FROM observations WHERE id = ?"
            row = self._db.execute(query, (int(columns["row_id"][i]),)).fetchone()
            if row is None or row_digest(row) != columns["row_sha256"][i].tobytes():
                raise ValueError(f"mask {keys[i][2]} of frame {keys[i][1]} of {keys[i][0]!r} is not what was written")
            observation = from_row(row)
            if observation.key != keys[i] or observation.digest != columns["digest"][i].tobytes():
                raise ValueError(f"mask {keys[i][2]} of frame {keys[i][1]} of {keys[i][0]!r} is another than its hash")
            return observation

    def _evidence_of_rows(self) -> Evidence:
        """Format 1: every observation is read now."""
        rows = self._db.execute(f"SELECT {COLUMNS}, object FROM observations ORDER BY id").fetchall()
        observations = [from_row(row[:-1]) for row in rows]
        order, digests = canonical_order(observations)
        phrases = sorted(self._db.execute("SELECT phrase, embedding FROM phrases NOT INDEXED").fetchall())
        matrix = np.array([floats(embedding) for _, embedding in phrases]).reshape(-1, self.meta.text_dim)
        if self.meta.feature_text_aligned and any(len(o.feature) != self.meta.text_dim for o in observations):
            raise ValueError("a feature of another length than the text encoder's")
        return self._evidence(
            observations=[observations[i] for i in order],
            digests=digests,
            partition=np.array([int(rows[i][-1]) for i in order], np.int64),
            embeddings=PhraseEmbeddings([str(phrase) for phrase, _ in phrases], read_only(matrix)),
        )

    def _evidence(
        self, *, observations: Sequence[Observation], digests: Array, partition: Array, embeddings: PhraseEmbeddings
    ) -> Evidence:
        n = len(partition)
        if n and not (0 <= partition.min() <= partition.max() < n and np.bincount(partition).all()):
            raise ValueError("its objects are not numbered one after the other")
        return Evidence(
            observations=observations,
            digests=digests,
            partition=partition,
            embeddings=embeddings,
            frames=read_frames(self._db),
            rooms=rooms_of(self.meta.rooms),
            about=self.meta.about,
            parameters=Parameters.from_dict(self.meta.parameters),
            text_encoder_id=self.meta.text_encoder_id,
            text_dim=self.meta.text_dim,
            feature_text_aligned=self.meta.feature_text_aligned,
            read_surroundings=self.surroundings,
        )


def column_of(texts: Sequence[str]) -> Array:
    """(b,) uint8 of texts; `texts_of` reads them back."""
    return np.frombuffer(json.dumps(list(texts)).encode(), np.uint8)


def texts_of(column: Array) -> list[str]:
    texts = from_json(column.tobytes())
    if not isinstance(texts, list) or not all(isinstance(text, str) for text in texts):
        raise ValueError("a list of texts is none")
    return texts
