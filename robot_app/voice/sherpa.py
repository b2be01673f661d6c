"""Models that the user brings, through sherpa-onnx: other languages, or larger ones. "sherpa:KIND:FOLDER".

A folder is what sherpa-onnx's own releases hold: ONNX files and tokens.txt. Nothing is downloaded.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from openbelief.arrays import Array
from robot_app.cli import Failure
from robot_app.voice.audio import RATE_HZ
from robot_app.voice.recogniser import HOW_TO_ADD, Heard

TOKENS = "*tokens.txt"


@dataclass(frozen=True)
class Kind:
    """builder: the constructor of sherpa_onnx.OfflineRecognizer. files: argument -> pattern. language: its argument."""

    builder: str
    files: Mapping[str, str]
    language: str | None = None


KINDS = {
    "transducer": Kind(
        "from_transducer", {"encoder": "*encoder*.onnx", "decoder": "*decoder*.onnx", "joiner": "*joiner*.onnx"}
    ),
    "whisper": Kind("from_whisper", {"encoder": "*encoder*.onnx", "decoder": "*decoder*.onnx"}, "language"),
    "moonshine": Kind("from_moonshine_v2", {"encoder": "encoder*.ort", "decoder": "decoder*.ort"}),
    "sense_voice": Kind("from_sense_voice", {"model": "model*.onnx"}, "language"),
    "nemo_ctc": Kind("from_nemo_ctc", {"model": "model*.onnx"}),
    "zipformer_ctc": Kind("from_zipformer_ctc", {"model": "*.onnx"}),
    "paraformer": Kind("from_paraformer", {"paraformer": "model*.onnx"}),
}
FORM = f"sherpa:KIND:FOLDER with KIND one of {', '.join(KINDS)}"


class SherpaRecogniser:
    """Confidence: the geometric mean of the tokens' probabilities where the model tells them, else None."""

    def __init__(self, recogniser: Any, name: str, language: str) -> None:
        self.id, self.language = name, language
        self._recogniser, self._one_at_a_time = recogniser, threading.Lock()

    @classmethod
    def open(cls, argument: str, language: str) -> SherpaRecogniser:
        """argument: KIND:FOLDER. Raises Failure: not installed, no such kind or folder, a file missing or bad."""
        word, _, folder = argument.partition(":")
        if word not in KINDS or not folder:
            raise Failure(f"'sherpa:{argument}' names no model: say {FORM}")
        kind, files = KINDS[word], model_files(KINDS[word], Path(folder))
        try:
            import sherpa_onnx
        except ImportError as error:
            raise Failure(HOW_TO_ADD) from error
        spoken = {kind.language: language} if kind.language else {}
        try:
            build = getattr(sherpa_onnx.OfflineRecognizer, kind.builder)
            made = build(**files, **spoken, num_threads=2)
        except Exception as error:  # sherpa raises whatever its C++ does
            raise Failure(f"{folder} is no {word} model that sherpa-onnx can load: {_first_line(error)}") from error
        return cls(made, f"sherpa-onnx {word} {Path(folder).name}", language)

    def hear(self, samples: Array) -> Heard:
        with self._one_at_a_time:
            stream = self._recogniser.create_stream()
            stream.accept_waveform(RATE_HZ, samples)
            self._recogniser.decode_stream(stream)
            result = stream.result
        return Heard(result.text.strip(), confidence_of(list(result.ys_log_probs)))


def model_files(kind: Kind, folder: Path) -> dict[str, str]:
    """argument -> file. Raises Failure where one is missing; of several the 8-bit one, else the first by name."""
    if not folder.is_dir():
        raise Failure(f"there is no folder {folder} with a speech model")
    files = {}
    for argument, pattern in {**kind.files, "tokens": TOKENS}.items():
        found = sorted(folder.glob(pattern), key=lambda path: ("int8" not in path.name, path.name))
        if not found:
            raise Failure(f"{folder} holds no {pattern}: a model for sherpa-onnx has it")
        files[argument] = str(found[0])
    return files


def confidence_of(log_probabilities: list[float]) -> float | None:
    """0 to 1, None where the model tells no probabilities."""
    if not log_probabilities:
        return None
    return min(1.0, math.exp(sum(log_probabilities) / len(log_probabilities)))


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]
