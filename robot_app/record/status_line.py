"""The live line of a recording, on stderr: rewritten in place on a terminal, a line every few seconds elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType

from rich.console import Console
from rich.live import Live
from rich.text import Text

from logs.structured import neutralise
from robot_app.record.monitor import RecordingStatus

SCREEN_EVERY_S, LINE_EVERY_S = 0.5, 5.0
SHORT = {
    "compressed": "colour",
    "aligned_depth_to_color": "depth",
    "camera_info": "calibration",
}


class StatusLine:
    """`with StatusLine() as line: line.show(gauge.status)`: asks for a status when the next line is due."""

    def __init__(self) -> None:
        self._console = Console(stderr=True)
        self._live: Live | None = None
        self._every_s = SCREEN_EVERY_S if sys.stderr.isatty() else LINE_EVERY_S
        self._next_s = 0.0

    def __enter__(self) -> StatusLine:
        if sys.stderr.isatty():
            self._live = Live(console=self._console, auto_refresh=False)
            self._live.start()
        self._next_s = time.monotonic() + self._every_s
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()

    def show(self, status: Callable[[], RecordingStatus]) -> None:
        now_s = time.monotonic()
        if now_s < self._next_s:
            return
        self._next_s = now_s + self._every_s
        text = line(status())
        if self._live is not None:
            self._live.update(Text(text), refresh=True)
        else:
            print(text, file=sys.stderr, flush=True)

    def tell(self, sentence: str) -> None:
        """A sentence of its own, above the line."""
        self._console.print(neutralise(sentence), highlight=False, markup=False, soft_wrap=True)


def line(status: RecordingStatus) -> str:
    """Everything of a status, in one line."""
    minutes, seconds = divmod(int(status.seconds), 60)
    rates = ", ".join(f"{short(name)} {stream.rate_hz:.1f}/s" for name, stream in status.streams.items())
    parts = [f"{minutes:02d}:{seconds:02d} {rates}", f"dropped {status.dropped}", *_losses(status), _disk(status)]
    if status.coverage is not None:
        parts.append(f"floor seen {100 * status.coverage:.0f} % of {status.floor_m2:.0f} m2")
    silent = [short(name) for name, stream in status.streams.items() if not stream.written]
    if silent:
        parts.append(f"nothing yet: {', '.join(silent)}")
    return neutralise(" | ".join([*parts, *status.trouble]))


def _losses(status: RecordingStatus) -> list[str]:
    """What never came to the recorder, by topic and place; nothing where nothing is missing."""
    streams = [(short(name), stream) for name, stream in status.streams.items()]
    lost = [f"{name} {count} {where}" for name, stream in streams for where, count in stream.lost.items()]
    holes = [f"{name} {stream.holes}" for name, stream in streams if stream.holes]
    backwards = [f"{name} {stream.backwards}" for name, stream in streams if stream.backwards]
    longest_s = max((stream.longest_hole_s for _, stream in streams), default=0.0)
    parts = {
        f"lost {status.lost}: ": lost,
        f"holes up to {longest_s:.1f} s: ": holes,
        "stamps not after the one before: ": backwards,
    }
    return [what + ", ".join(where) for what, where in parts.items() if where]


def _disk(status: RecordingStatus) -> str:
    return f"{status.payload_bytes / 1e6:.0f} MB taken, {status.free_bytes / 1e9:.0f} GB free"


def short(topic: str) -> str:
    """A topic in one word or two: /camera/color/image_raw/compressed -> colour, /livox/imu -> livox/imu."""
    parts = topic.strip("/").split("/")
    return next((SHORT[part] for part in reversed(parts) if part in SHORT), "/".join(parts[-2:]))
