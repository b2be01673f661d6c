"""Memories in files, changed by those who know how."""

from __future__ import annotations

import contextlib
import json
import sqlite3

from openbelief.columns import write_columns
from openbelief.store_rows import first_seal, seal


def resealed(path, *changes, columns=None):
    """The file changed by somebody who knows how to seal it again."""
    db = sqlite3.connect(path, isolation_level=None)
    for change in changes:
        db.execute(*([change] if isinstance(change, str) else change))
    write_columns(db, columns or {})
    first = db.execute("PRAGMA user_version").fetchone()[0] == 1
    with contextlib.suppress(TypeError):  # bytes where text belongs cannot be sealed at all
        new = json.dumps((first_seal if first else seal)(db))
        db.execute("UPDATE meta SET value = ? WHERE key = 'seal'", (new,))
    db.close()
    return path
