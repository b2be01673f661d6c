"""What ports raise, by name: a trial keeps the name and the words, and its replay raises the same again."""

from __future__ import annotations

from drivers.ports import Interrupted, LinkLost, PortError, PoseUnavailable, StaleData
from openbelief.perception.ports import FrameUnseen, PerceptionFailed

PORT_ERRORS = (PortError, StaleData, PoseUnavailable, LinkLost, Interrupted, PerceptionFailed, FrameUnseen)
KINDS: dict[str, type[Exception]] = {kind.__name__: kind for kind in PORT_ERRORS}


def kind_of(error: Exception) -> str:
    """The exception's name, as the ports know it: a driver's own kind of PoseUnavailable is a PoseUnavailable."""
    names = (kind.__name__ for kind in type(error).__mro__ if kind in KINDS.values())
    return next(names, type(error).__name__)


def error_of(kind: str, message: str) -> Exception:
    """The exception again: a port's own, or one of the same name and words."""
    known = KINDS.get(kind)
    return known(message) if known is not None else type(kind, (RuntimeError,), {})(message)
