"""OpenBelief: an object memory that keeps all the evidence. The public contract; heavy modules load on first use."""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Observation": "openbelief.observation",
    "Parameters": "openbelief.parameters",
    "ObjectMemory": "openbelief.memory",
    "associate": "openbelief.association",
    "overlap": "openbelief.association",
}
__all__ = ["ObjectMemory", "Observation", "Parameters", "associate", "overlap"]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'openbelief' has no attribute {name!r}")
