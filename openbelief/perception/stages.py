"""A perception whose steps can be taken one by one, so that several frames can be under way at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from openbelief.observation import Mask, RgbdFrame


@dataclass(frozen=True)
class Stage:
    """One step of a perception: `run(frame, what the step before gave)`. workers: how many frames at once."""

    name: str
    run: Callable[[RgbdFrame, Any], Any]
    workers: int = 1


def in_turn(
    stages: Sequence[Stage], frame: RgbdFrame, during: Callable[[str], AbstractContextManager[Any]] = nullcontext
) -> list[Mask]:
    """What the stages make of a frame, one after the other. Raises what they raise.

    during: a stage's name -> what is entered while it runs.
    """
    value: Any = None
    for stage in stages:
        with during(stage.name):
            value = stage.run(frame, value)
    return list(value)


@runtime_checkable
class StagedPerception(Protocol):
    """Perception port whose `perceive` is its stages in order; the last one gives the masks."""

    @property
    def id(self) -> str: ...

    @property
    def feature_text_aligned(self) -> bool: ...

    @property
    def stages(self) -> tuple[Stage, ...]: ...

    def perceive(self, frame: RgbdFrame) -> list[Mask]: ...

    def close(self) -> None:
        """End what is waited for, from any thread."""
        ...
