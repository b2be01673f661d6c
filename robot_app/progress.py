"""How far a long job is, on stderr: a bar on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from robot_app.progress_lines import LineProgress

if TYPE_CHECKING:
    from robot_app.progress_bar import BarProgress


def progress() -> BarProgress | LineProgress:
    """The one that suits this stderr."""
    if not sys.stderr.isatty():
        return LineProgress()
    from robot_app.progress_bar import BarProgress  # rich takes 0.06 s

    return BarProgress()
