"""Fetch a model's files through huggingface_hub: resumed, bounded, and checked against the table, the lock, the hub."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from openbelief.phrase import printable
from robot_app.cli import Failure
from robot_app.models.table import CHECKPOINTS, FileFacts, Lock, ModelEntry, difference, facts_of

if TYPE_CHECKING:
    from huggingface_hub import HfFileMetadata

TRIES = 3  # of a file whose transfer breaks; each goes on where the one before stopped
METADATA_TIMEOUT_S = 10.0
LFS_HASH = re.compile(r"[0-9a-f]{64}")


def pull(
    name: str, model: ModelEntry, folder: Path, *, endpoint: str | None, tell: Callable[[str], None]
) -> list[Path]:
    """Every file of a "hub" row into FOLDER/checkpoints/NAME. Raises Failure; a wrong file is deleted, a cut one
    is resumed."""
    if model.source != "hub":
        raise Failure(
            f"{name} is not on the hub: {model.repository}. docs/perception.md says how to get its files; put them "
            f"into {folder}, then models check."
        )
    (folder / CHECKPOINTS / name).mkdir(parents=True, exist_ok=True)
    lock = Lock(folder)
    return [_pull_file(name, model, file, folder, lock, endpoint, tell) for file in model.files]


def _pull_file(
    name: str, model: ModelEntry, file: str, folder: Path, lock: Lock, endpoint: str | None, tell: Callable[[str], None]
) -> Path:
    expected = _merged(model.files[file], lock.facts(name, file))
    path = folder / CHECKPOINTS / name / file
    if expected.sha256 and path.is_file() and difference(path, expected) is None:
        tell(f"{path}: there already")
        return path
    where = f"{model.repository}/{file} ({expected.revision or model.revision})"
    with _Words(where, model.licence):
        remote, headers = _remote(model, file, expected.revision or model.revision, endpoint)
    _fetch(remote, headers, path, where, model.licence, tell)
    announced = remote.etag if remote.etag and LFS_HASH.fullmatch(remote.etag) else None
    _require_same(path, FileFacts(bytes=remote.size, sha256=announced), f"the hub's own word for {where}")
    _require_same(path, expected, "the table or the lock")
    facts = facts_of(path)
    lock.record(name, file, FileFacts(bytes=facts.bytes, sha256=facts.sha256, revision=remote.commit_hash))
    trust = "" if expected.sha256 else f" (sha256 unknown before: trusted at this first pull, recorded in {lock.path})"
    tell(f"{path}: {facts.bytes} bytes, sha256 {facts.sha256}{trust}")
    return path


def _merged(row: FileFacts, locked: FileFacts | None) -> FileFacts:
    """The table's word before the lock's."""
    if locked is None:
        return row
    return FileFacts(
        bytes=row.bytes or locked.bytes, sha256=row.sha256 or locked.sha256, revision=row.revision or locked.revision
    )


def _remote(model: ModelEntry, file: str, revision: str, endpoint: str | None) -> tuple[HfFileMetadata, dict[str, str]]:
    """What the hub says of the file (the commit behind a branch's name, where its bytes are, size, hash), and the
    headers to ask for them with: another host than the hub, which has the large files, gets no token."""
    from huggingface_hub import get_hf_file_metadata, hf_hub_url
    from huggingface_hub.utils import build_hf_headers

    url = hf_hub_url(model.repository, file, revision=revision, endpoint=endpoint)
    remote = get_hf_file_metadata(url, timeout=METADATA_TIMEOUT_S, endpoint=endpoint)
    same_host = urlsplit(remote.location).netloc == urlsplit(url).netloc
    return remote, build_hf_headers(token=None if same_host else False)


def _fetch(
    remote: HfFileMetadata,
    headers: dict[str, str],
    path: Path,
    where: str,
    licence: str,
    tell: Callable[[str], None],
) -> None:
    """The bytes, through a *.partial file that bears the content's own name, so that only the same one is resumed.

    hf_hub_download would begin anew in every process (huggingface_hub 2.4).
    """
    part = path.with_name(f"{path.name}.{(remote.etag or 'unknown')[:16]}.partial")
    path.parent.mkdir(parents=True, exist_ok=True)
    for left in reversed(range(TRIES)):
        try:
            with _Words(where, licence):
                _append(remote, headers, part)
        except _Broken as broken:
            if not left:
                raise Failure(f"{broken} Run the same command again: it goes on where it stopped.") from broken
            tell(f"{broken} Trying again.")
        else:
            part.replace(path)
            return


def _append(remote: HfFileMetadata, headers: dict[str, str], part: Path) -> None:
    from huggingface_hub.file_download import http_get

    with part.open("ab") as file:
        if remote.size is None or file.tell() < remote.size:
            http_get(remote.location, file, resume_size=file.tell(), headers=dict(headers), expected_size=remote.size)


class _Broken(Failure):
    """A transfer that ended too early."""


class _Words:
    """The hub client's exceptions in our words."""

    def __init__(self, where: str, licence: str) -> None:
        self._where, self._licence = where, licence

    def __enter__(self) -> None:
        """Nothing to prepare."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        import httpx2
        from huggingface_hub import errors

        if isinstance(error, errors.GatedRepoError):
            raise Failure(f"{self._where} is gated: {self._licence}.") from error
        absent = (errors.RepositoryNotFoundError, errors.RemoteEntryNotFoundError, errors.RevisionNotFoundError)
        if isinstance(error, absent):
            raise Failure(f"{self._where} is not on the hub: correct robot_app/models/models.toml.") from error
        if isinstance(error, httpx2.HTTPError | OSError):
            why = printable(str(error)) or type(error).__name__
            raise _Broken(f"{self._where} did not come whole ({why}).") from error


def _require_same(path: Path, expected: FileFacts, who: str) -> None:
    if why := difference(path, expected):
        path.unlink()
        raise Failure(f"{path} {why} (against {who}). It was deleted.")
