"""Notes of people beside a trial: `TRIAL.notes.jsonl`, a line each, never inside the trial itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from openbelief.documents import from_json

NOTE_MAX, NOTES_MAX = 2000, 200


def notes_path(trial: Path) -> Path:
    return trial.with_suffix(".notes.jsonl")


def read_notes(trial: Path) -> list[dict[str, Any]]:
    """Each {"at_ms", "who", "text"}, in the order in which they were written; a line that is none is passed over."""
    try:
        lines = notes_path(trial).read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return []
    found = []
    for line in lines:
        try:
            note = from_json(line)
        except ValueError:
            continue
        if isinstance(note, dict) and {"at_ms", "who", "text"} <= set(note):
            found.append({key: note[key] for key in ("at_ms", "who", "text")})
    return found


def add_note(trial: Path, *, who: str, text: str, at_ms: int) -> None:
    """Raises ValueError on a note that is empty or too long."""
    text = text.strip()
    if not 0 < len(text) <= NOTE_MAX or len(read_notes(trial)) >= NOTES_MAX:
        raise ValueError(f"A note has 1 to {NOTE_MAX} characters, and a trial {NOTES_MAX} notes at most.")
    with notes_path(trial).open("a", encoding="utf-8") as file:
        file.write(json.dumps({"at_ms": at_ms, "who": who, "text": text}) + "\n")
