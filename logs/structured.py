"""The application's own log: JSON lines for machines, readable lines on a terminal, never a control character.

`with trial_context(trial_id=..., query_id=...)` puts both ids on every line logged inside it, in that thread or task.
structlog is imported by who logs: a twelfth of a second, and every verb wants `neutralise`.
"""

from __future__ import annotations

import logging
import sys
import unicodedata
from collections.abc import Mapping, MutableMapping
from contextlib import AbstractContextManager
from datetime import UTC, datetime
from typing import Any, TextIO

from drivers.clock import SystemClock
from drivers.ports import Clock

MULTILINE = frozenset({"exception", "stack"})  # tracebacks are ours and read better as lines
HIDDEN = frozenset({"Cc", "Cf", "Cs", "Zl", "Zp"})  # control, format (bidi overrides), surrogates, line separators


def configure(clock: Clock, stream: TextIO | None = None, *, json_lines: bool | None = None) -> None:
    """Send the log to `stream` (default: stderr). json_lines: None = JSON unless the stream is a terminal."""
    import structlog

    def write_logger(*_args: Any) -> structlog.WriteLogger:
        return structlog.WriteLogger(stream or sys.stderr)  # the stderr of the moment: it may be replaced and closed

    as_json = not (stream or sys.stderr).isatty() if json_lines is None else json_lines
    renderer: Any = structlog.processors.JSONRenderer() if as_json else structlog.dev.ConsoleRenderer(pad_event_to=0)
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            _stamp(clock),
            structlog.processors.format_exc_info,
            neutralise_event,
            renderer,
        ],
        logger_factory=write_logger,
        cache_logger_on_first_use=False,
    )
    _adopt_standard_logging()


class _ThroughStructlog(logging.Handler):
    """Drivers and libraries log through the standard library: their lines take the same form and the same stream."""

    def emit(self, record: logging.LogRecord) -> None:
        import structlog

        said = record.getMessage()
        structlog.get_logger().log(record.levelno, said, source=record.name, exc_info=record.exc_info)


def _adopt_standard_logging() -> None:
    root = logging.getLogger()
    logging.getLogger("drivers").setLevel(logging.INFO)
    if not any(isinstance(handler, _ThroughStructlog) for handler in root.handlers):
        root.addHandler(_ThroughStructlog(logging.INFO))


def logger() -> Any:
    """`logger().info("goal_sent", object_id=7)`: an event name and its facts. Unconfigured, it writes to stderr."""
    import structlog

    if not structlog.is_configured():
        configure(SystemClock())
    return structlog.get_logger()


def trial_context(**ids: str) -> AbstractContextManager[None]:
    """Bind trial_id, query_id (or more) for the lines logged inside the `with` block."""
    import structlog

    return structlog.contextvars.bound_contextvars(**ids)


def neutralise(text: str, *, keep: str = "") -> str:
    """Operator, model or wire text that cannot move a terminal's cursor, forge a line or hide what it says."""
    return "".join(_escape(c) if unicodedata.category(c) in HIDDEN and c not in keep else c for c in text)


def neutralise_event(_logger: Any, _method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """The structlog processor: every string of the event, however deep."""
    return {neutralise(key): _neutralised(value, "\n" if key in MULTILINE else "") for key, value in event.items()}


def _neutralised(value: Any, keep: str) -> Any:
    if isinstance(value, str):
        return neutralise(value, keep=keep)
    if isinstance(value, Mapping):
        return {neutralise(str(key)): _neutralised(item, keep) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [_neutralised(item, keep) for item in value]
    if value is None or isinstance(value, (bool, int, float)):
        return value
    return neutralise(repr(value), keep=keep)


def _escape(character: str) -> str:
    code = ord(character)
    return f"\\x{code:02x}" if code < 0x100 else f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"


def _stamp(clock: Clock) -> Any:
    def stamp(_logger: Any, _method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
        now_ns = clock.now_ns()
        event["stamp_ns"] = now_ns
        event["time"] = datetime.fromtimestamp(now_ns / 1e9, UTC).isoformat(timespec="milliseconds")
        return event

    return stamp
