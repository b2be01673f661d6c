"""The smallest recording: words on a topic."""

from __future__ import annotations

from pathlib import Path

from drivers.ros.messages import decode, encode, make
from logs.mcap_io.reader import LogReader

STRING = "std_msgs/msg/String"


def word(text: str) -> bytes:
    return encode(make(STRING, data=text))


def said(path: Path) -> list[str]:
    """What was recorded on /words."""
    return [decode(m.payload, STRING).data for m in LogReader(path).messages({"/words"})]
