"""What a stand-in vision-language model says of a recording's pictures: the phrases of its recorded perception.

Real models do not keep to one way of writing a list, so neither does this: the picture decides.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path

from logs.frames.reader import FrameReader
from openbelief.perception.recorded import RecordedPerception
from openbelief.perception.vlm_config import PictureFormat
from openbelief.perception.vlm_picture import encoded

STYLES: tuple[Callable[[Sequence[str]], str], ...] = (
    "\n".join,
    lambda phrases: "\n".join(f"- {phrase}" for phrase in phrases),
    lambda phrases: "\n".join(f"{number}. {phrase}" for number, phrase in enumerate(phrases, 1)),
    lambda phrases: f"```json\n{json.dumps(list(phrases))}\n```",
    lambda phrases: "<think>\nWhat is there?\n</think>\n" + "\n".join(phrases),
    lambda phrases: "Objects in the image:\n" + "\n".join(f"* **{phrase}**" for phrase in phrases),
)


def recorded_answers(recording: Path, perception: Path, *, stride: int = 1) -> dict[str, str]:
    """sha256 of the picture's bytes, as sent by default -> the reply. A picture without masks gets "None."."""
    recorded, answers = RecordedPerception(perception), {}
    for frame in FrameReader(recording, stride=stride):
        digest = hashlib.sha256(encoded(frame.color, PictureFormat())).digest()
        phrases = list(dict.fromkeys(mask.phrase for mask in recorded.perceive(frame) if mask.phrase))
        answers[digest.hex()] = STYLES[digest[0] % len(STYLES)](phrases) if phrases else "None."
    return answers
