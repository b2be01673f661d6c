"""The text encoder that a memory or a trial was made with: found by its id among what is here."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.perception.ports import TextEncoder

MODELS = Path("models")  # where the built-in profile looks too


@cache
def text_encoder_by_id(encoder_id: str) -> TextEncoder:
    """One for a process: loading takes seconds. Raises Failure naming what is here."""
    from openbelief.perception.sentence import SentenceEncoder

    if encoder_id == SentenceEncoder.id:  # the one that is always here; the others' libraries need not be loaded
        return SentenceEncoder()
    from openbelief.perception.model_folder import ModelFolderError

    here = dict(_here())
    if encoder_id not in here:
        raise Failure(
            f"Text encoder {encoder_id!r} is not here; here are {', '.join(map(repr, here))}. "
            f"An exported CLIP is looked for in {MODELS}/*/."
        )
    try:
        return here[encoder_id]()
    except ModelFolderError as error:
        raise Failure(str(error)) from error


def _here() -> Iterator[tuple[str, Callable[[], TextEncoder]]]:
    """(id, how to open it); a folder that is no CLIP is passed over."""
    from openbelief.perception.clip import Clip, text_space
    from openbelief.perception.model_folder import MANIFEST, ModelFolder, ModelFolderError
    from openbelief.perception.sentence import SentenceEncoder

    yield SentenceEncoder.id, SentenceEncoder
    for manifest in sorted(MODELS.glob(f"*/{MANIFEST}")):
        folder = manifest.parent
        try:
            yield text_space(ModelFolder(folder, "clip")), lambda folder=folder: Clip(folder).text  # type: ignore[misc]
        except ModelFolderError:
            continue
