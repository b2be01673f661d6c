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
    from robot_app.text_encoders import text_encoder_by_id

    memory = open_memory(path)
    try:
        return memory.with_text_encoder(text_encoder_by_id(memory.text_encoder_id))
    except Failure as failure:
        raise Failure(f"{path} cannot be asked with words. {failure}") from failure
