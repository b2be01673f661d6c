"""The event log of a recording, read."""

from __future__ import annotations

import json
from pathlib import Path


def read_events(path: Path) -> list[dict[str, str | int | float]]:
    """The events of a log, also of one whose writer was killed."""
    return [json.loads(line) for line in path.read_bytes().rstrip(b"\0").splitlines()]
