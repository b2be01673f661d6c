"""A checksum for metadata records, the one kind of MCAP record that has none of its own."""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping

KEY = "openbelief.crc32"


class ChecksumError(ValueError):
    """The values are not the ones that were written."""


def with_checksum(values: Mapping[str, str]) -> dict[str, str]:
    return {**values, KEY: _crc(values)}


def without_checksum(values: Mapping[str, str]) -> dict[str, str]:
    """The values as they were given; raises ChecksumError. Values without a checksum pass as they are."""
    rest = {key: value for key, value in values.items() if key != KEY}
    if KEY in values and values[KEY] != _crc(rest):
        raise ChecksumError("the checksum of a metadata record does not match")
    return rest


def _crc(values: Mapping[str, str]) -> str:
    return f"{zlib.crc32(json.dumps(dict(values), sort_keys=True).encode()):08x}"
