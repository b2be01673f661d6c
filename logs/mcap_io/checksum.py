"""A checksum for metadata records, the one kind of MCAP record that has none of its own."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

KEY = "openbelief.crc32"
# What our recorders called their records while the checksum was over the values alone; other names were damaged since.
NAMED_BEFORE = ("openbelief.recording", "openbelief.recovered", "trial", "versions")
NUMBERED_BEFORE = "openbelief.channel/"


class ChecksumError(ValueError):
    """The name or the values are not the ones that were written."""


def with_checksum(name: str, values: Mapping[str, str]) -> dict[str, str]:
    return {**values, KEY: _crc(name, values)}


def without_checksum(name: str, values: Mapping[str, str]) -> dict[str, str]:
    """The values as they were given; raises ChecksumError. Values without a checksum pass as they are."""
    rest = {key: value for key, value in values.items() if key != KEY}
    if KEY not in values or values[KEY] == _crc(name, rest):
        return rest
    if values[KEY] != _crc_of_values(rest):
        raise ChecksumError(f"the checksum of a metadata record does not match (its name reads {name!r})")
    if name not in NAMED_BEFORE and not _is_numbered(name):
        raise ChecksumError(f"a metadata record's name is damaged: no recorder of ours writes {name!r}")
    return rest


def _is_numbered(name: str) -> bool:
    return name.startswith(NUMBERED_BEFORE) and name.removeprefix(NUMBERED_BEFORE).isdecimal()


def _crc(name: str, values: Mapping[str, str]) -> str:
    return f"{zlib.crc32(json.dumps([name, dict(values)], sort_keys=True).encode()):08x}"


def _crc_of_values(values: Mapping[str, str]) -> str:
    """As it was before the name was in it."""
    return f"{zlib.crc32(json.dumps(dict(values), sort_keys=True).encode()):08x}"
