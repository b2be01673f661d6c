"""Run every network of a folder once: is it the file it should be, what runs it, how long, how much memory (Linux)."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.arrays import Array
from openbelief.documents import from_json
from openbelief.perception.onnx_session import PROVIDERS, TENSORRT, OnnxModel, content_hash
from openbelief.perception.ports import PerceptionFailed
from robot_app.cli import Failure
from robot_app.models.table import FileFacts, difference, table

DEVICES: dict[str, Sequence[str]] = {
    "auto": PROVIDERS,
    "cpu": ("CPUExecutionProvider",),
    "cuda": PROVIDERS,
    "tensorrt": TENSORRT,
}
OPEN_SIZE = 1  # what a dimension that the export leaves open is run with


@dataclass(frozen=True)
class Checked:
    """wrong: why it cannot be used, None where it can. first_ms: with what is made at the first run; again_ms: the next
    one. memory_mib: what the process grew by."""

    file: str
    sha256: str | None = None
    known: bool = False
    providers: Sequence[str] = ()
    inputs: str = ""
    first_ms: float | None = None
    again_ms: float | None = None
    memory_mib: float | None = None
    wrong: str | None = None

    def as_json(self) -> dict[str, Any]:
        return asdict(self)


def check_folder(folder: Path, device: str, threads: int | None) -> list[Checked]:
    """Every *.onnx in the folder and below. Raises Failure where there is none."""
    files = sorted(folder.rglob("*.onnx"))
    if not files:
        raise Failure(f"There is no *.onnx in {folder}: see openbelief models list for where to get them.")
    facts = {file: facts for model in table().values() for file, facts in model.files.items()}
    return [
        _check(path, {path: facts[path.name]} if path.name in facts else _exported(path), device, threads)
        for path in files
    ]


def _exported(path: Path) -> dict[Path, FileFacts]:
    """What model.json, which scripts/export writes, says of the file and of the weights beside a large one; {} where
    there is none."""
    manifest = path.with_name("model.json")
    if not manifest.is_file():
        return {}
    try:
        files = from_json(manifest.read_text(encoding="utf-8"))["files"]
        names = [path.name, *({f"{path.name}.data"} & files.keys())]
        return {path.with_name(name): FileFacts.model_validate(files[name]) for name in names}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise Failure(f"{manifest} does not say what {path.name} should be: export the model again.") from error


def _wrong(path: Path, expected: dict[Path, FileFacts]) -> str | None:
    """Why the network, or the weights beside it, are not what they should be."""
    for file, facts in expected.items():
        why = difference(file, facts) if file.is_file() else "is missing"
        if why:
            return why if file == path else f"cannot be used: {file.name} {why}"
    return None


def _check(path: Path, expected: dict[Path, FileFacts], device: str, threads: int | None) -> Checked:
    if why := _wrong(path, expected):
        return Checked(str(path), wrong=why)
    try:
        before = _resident_mib()
        model = OnnxModel(path, providers=DEVICES[device], threads=threads)
        if device != "auto" and model.providers[0] != DEVICES[device][0]:
            return Checked(
                str(path), wrong=f"cannot run on {device}: only {', '.join(model.providers)} can be used here"
            )
        feeds = {name: _feed(model, name) for name in model.input_shapes}
        first_ms, again_ms = _run_ms(model, feeds), _run_ms(model, feeds)
    except PerceptionFailed as error:
        return Checked(str(path), wrong=str(error))
    return Checked(
        str(path),
        sha256=content_hash(path),
        known=bool(expected) and all(facts.sha256 for facts in expected.values()),
        providers=model.providers,
        inputs=", ".join(f"{name} {list(feed.shape)}" for name, feed in feeds.items()),
        first_ms=first_ms,
        again_ms=again_ms,
        memory_mib=_resident_mib() - before,
    )


def _feed(model: OnnxModel, name: str) -> Array:
    """Noise for pictures, ones for token ids and masks."""
    shape = [OPEN_SIZE if size is None else size for size in model.input_shapes[name]]
    dtype = model.dtype(name)
    if dtype is not None and np.issubdtype(dtype, np.floating):
        return np.random.default_rng(0).random(shape).astype(dtype)
    return np.ones(shape, dtype)


def _run_ms(model: OnnxModel, feeds: dict[str, Array]) -> float:
    start = time.perf_counter()
    model.run(feeds)
    return 1000 * (time.perf_counter() - start)


def _resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
