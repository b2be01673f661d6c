"""The observations in a file that is being written: what their rows are known by is noted as they pass."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from openbelief.arrays import Array
from openbelief.belief_file import column_of
from openbelief.evidence import Evidence, in_order
from openbelief.observation import Observation
from openbelief.store_rows import COLUMNS, from_row, row_digest, to_row
from openbelief.stored_observations import Key

INSERT = f"INSERT INTO observations (id, {COLUMNS}) VALUES ({'?, ' * 12}?)"
SELECT = f"SELECT id, {COLUMNS} FROM observations WHERE id <= ? ORDER BY id"


class KeptRow(NamedTuple):
    """What a sealed file says of a row. digest: of the observation. sha256: of the row, its picture included."""

    id: int
    key: Key
    digest: bytes
    sha256: bytes


class KeptRows:
    """The rows of `observations` in a file that nobody else writes; those of an earlier run are read when needed."""

    def __init__(self, db: sqlite3.Connection) -> None:
        self._db = db
        self._earlier: list[KeptRow] | None = None
        self._added: list[KeptRow] = []
        (self._earlier_to,) = db.execute("SELECT coalesce(max(id), 0) FROM observations").fetchone()

    def insert(self, observations: Iterable[Observation]) -> list[KeptRow]:
        """Written, but only `added` once the transaction has ended well."""
        kept = []
        for row_id, observation in enumerate(observations, self._earlier_to + len(self._added) + 1):
            row = to_row(observation)
            self._db.execute(INSERT, (row_id, *row))
            kept.append(KeptRow(row_id, observation.key, observation.digest, row_digest(row)))
        return kept

    def added(self, rows: list[KeptRow]) -> None:
        self._added += rows

    def earlier(self) -> list[Observation]:
        """Those that an earlier run added, in the order it did."""
        observations, kept = [], []
        for row_id, *row in self._db.execute(SELECT, (self._earlier_to,)):
            observation = from_row(tuple(row))
            observations.append(observation)
            kept.append(KeptRow(row_id, observation.key, observation.digest, row_digest(row)))
        self._earlier = kept
        return observations

    def columns(self, evidence: Evidence) -> dict[str, Array]:
        """EVIDENCE_COLUMNS. Raises ValueError where the rows are other evidence."""
        if self._earlier is None:
            self.earlier()
        rows = [*(self._earlier or ()), *self._added]
        order, digests = in_order([row.key for row in rows], [row.digest for row in rows])
        if not np.array_equal(digests, evidence.digests):
            raise ValueError("The memory was not built from the evidence of this file.")
        ordered = [rows[i] for i in order]
        recordings = sorted({row.key[0] for row in rows})
        number = {recording: i for i, recording in enumerate(recordings)}
        return {
            "digest": digests,
            "partition": evidence.partition,
            "recording": np.array([number[row.key[0]] for row in ordered], "<i4"),
            "frame": np.array([row.key[1] for row in ordered], "<i8"),
            "mask": np.array([row.key[2] for row in ordered], "<i8"),
            "row_id": np.array([row.id for row in ordered], "<i8"),
            "row_sha256": np.frombuffer(b"".join(row.sha256 for row in ordered), np.uint8).reshape(-1, 32),
            "recordings": column_of(recordings),
            "phrases": column_of(evidence.embeddings.phrases),
        }
