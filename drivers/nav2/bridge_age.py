"""How old the bridge is: before 1.5.1 latched topics never arrive, and what was tested is 1.10.0."""

from __future__ import annotations

import re

from drivers.ros.bridge_keys import bridge_version_key
from drivers.ros.zenoh_link import ZenohLink

LEAST, TESTED = (1, 5, 1), (1, 10, 0)
ASK_S = 1.0
NUMBERS = re.compile(rb"(\d{1,4})\.(\d{1,4})\.(\d{1,4})")

Version = tuple[int, int, int]


def bridge_versions(link: ZenohLink) -> list[Version]:
    """Of every bridge that says one. Raises LinkLost where our own session is closed."""
    found = (NUMBERS.search(payload[:256]) for payload in link.get(bridge_version_key(), b"", ASK_S).payloads)
    return [(int(each[1]), int(each[2]), int(each[3])) for each in found if each]


def said(version: Version) -> str:
    return ".".join(map(str, version))
