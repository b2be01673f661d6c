"""Opening a .belief file for a verb: with the text encoder it was made with, or one clear line why not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.memory import ObjectMemory


def open_memory(path: Path) -> ObjectMemory:
    """A memory that can be asked with vectors. Raises Failure."""
    from openbelief.memory import ObjectMemory

    try:
        return ObjectMemory.open(path)
    except (OSError, ValueError) as error:
        raise Failure(str(error)) from error


def open_with_encoder(path: Path) -> ObjectMemory:
    """A memory that can be asked with sentences. Raises Failure."""
    from openbelief.perception.sentence import SentenceEncoder

    memory = open_memory(path)
    if memory.text_encoder_id != SentenceEncoder.id:
        raise Failure(
            f"{path} was mapped with text encoder {memory.text_encoder_id!r}, which is not configured here "
            f"(here: {SentenceEncoder.id!r})."
        )
    return memory.with_text_encoder(SentenceEncoder())
