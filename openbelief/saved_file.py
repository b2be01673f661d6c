"""A memory saved: a finished .belief file, all of it or nothing."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from openbelief.arrays import Array
from openbelief.evidence import Evidence
from openbelief.file_checks import BeliefFileError, unwritten
from openbelief.store import BeliefStore


def write(path: str | os.PathLike[str], evidence: Evidence, columns: Mapping[str, Array]) -> None:
    """One that is there already is replaced. columns: of the nodes.

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
            store.add_memory(evidence)
            store.finish(evidence, columns)
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
