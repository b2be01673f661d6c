"""The table of networks (models.toml), and what a folder holds of them."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from openbelief.documents import from_json, from_toml
from openbelief.perception.mask_line import one_line
from robot_app.cli import Failure

LOCK = "models.lock.json"
CHECKPOINTS = "checkpoints"  # in the folder of models: what was pulled; what was exported of it lies beside
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class FileFacts(BaseModel):
    """What is known of a file; None = nobody has ever held it here."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    bytes: int | None = None
    sha256: Sha256 | None = None
    revision: str | None = None  # the hub's commit, in the lock only


class ModelEntry(BaseModel):
    """One row. files: path in the repository -> facts. export: the script and its arguments."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    role: str
    source: Literal["hub", "package", "served", "own"]
    repository: str
    licence: str
    files: dict[str, FileFacts]
    revision: str = "main"
    export: list[str] | None = None


def table() -> dict[str, ModelEntry]:
    text = Path(__file__).with_name("models.toml").read_text(encoding="utf-8")
    return {name: ModelEntry.model_validate(row) for name, row in from_toml(text).items()}


def row(name: str) -> ModelEntry:
    """Raises Failure naming the rows there are."""
    models = table()
    if name not in models:
        raise Failure(f"There is no model {name!r}; there are {', '.join(models)}.")
    return models[name]


class Lock:
    """models.lock.json of a folder: what the first pull of every file was. Raises Failure where it cannot be read."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / LOCK
        self._files: dict[str, FileFacts] = {}
        if self.path.exists():
            try:
                entries = from_json(self.path.read_text(encoding="utf-8"))
                self._files = {key: FileFacts.model_validate(facts) for key, facts in entries.items()}
            except (OSError, ValueError, AttributeError, ValidationError) as error:
                why = one_line(error) if isinstance(error, ValueError) else str(error)
                raise Failure(f"{self.path} cannot be read ({why}): correct it, or delete it to trust anew.") from error

    def facts(self, name: str, file: str) -> FileFacts | None:
        return self._files.get(f"{name}/{file}")

    def record(self, name: str, file: str, facts: FileFacts) -> None:
        self._files[f"{name}/{file}"] = facts
        entries = {key: facts.model_dump(exclude_none=True) for key, facts in sorted(self._files.items())}
        temporary = self.path.with_suffix(".tmp")
        temporary.write_text(json.dumps(entries, indent=1) + "\n", encoding="utf-8")
        temporary.replace(self.path)


def facts_of(path: Path) -> FileFacts:
    """Size and hash of a file as it lies there."""
    with path.open("rb") as file:
        return FileFacts(bytes=path.stat().st_size, sha256=hashlib.file_digest(file, "sha256").hexdigest())


def difference(path: Path, expected: FileFacts) -> str | None:
    """Why the file is not the expected one, None where it is, as far as anything is known of it."""
    size = path.stat().st_size
    if expected.bytes is not None and size != expected.bytes:
        return f"has {size} bytes instead of {expected.bytes}" + (": it is truncated" if size < expected.bytes else "")
    if expected.sha256 is not None and facts_of(path).sha256 != expected.sha256:
        return "is another file than the table's or the first pull's: its sha256 differs"
    return None
