"""JSON and TOML that somebody else wrote: what would exhaust the parser is refused in one sentence."""

from __future__ import annotations

import json
import tomllib
from typing import Any

MAX_KEY_PARTS = 100  # a dotted key of 100 000 parts is 200 kB, and gigabytes in the parser
MAX_JSON_BYTES = 64 << 20  # lists of nothing take forty times as much memory as text
KEY_ENDS = "=,[]{}#\n"


class DocumentError(ValueError):
    """The text cannot be read; one line with the cause."""


def from_json(text: str | bytes, *, max_bytes: int = MAX_JSON_BYTES, **options: Any) -> Any:
    """`json.loads` with its options. Raises DocumentError."""
    if len(text) > max_bytes:
        raise DocumentError(f"it has {len(text)} bytes, more than the {max_bytes} allowed")
    try:
        return json.loads(text, **options)
    except RecursionError as error:
        raise DocumentError("it is nested too deeply") from error
    except json.JSONDecodeError:
        raise  # a ValueError that says where
    except ValueError as error:
        raise DocumentError(_short(error)) from error


def from_toml(text: str) -> dict[str, Any]:
    """`tomllib.loads`. Raises DocumentError, or tomllib.TOMLDecodeError with the place."""
    _require_short_keys(text)
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise DocumentError("it is nested too deeply") from error
    except tomllib.TOMLDecodeError:
        raise
    except ValueError as error:
        raise DocumentError(_short(error)) from error


def _require_short_keys(text: str) -> None:
    parts = 0
    for letter in text:
        if letter == ".":
            parts += 1
            if parts > MAX_KEY_PARTS:
                raise DocumentError(f"a key has more than {MAX_KEY_PARTS} parts")
        elif letter in KEY_ENDS:
            parts = 0


def _short(error: ValueError) -> str:
    """Python's own words on a number of thousands of digits tell a reader to change the interpreter."""
    return "a number is too long" if "digits" in str(error) else str(error)
