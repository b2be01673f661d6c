"""What `--perception KIND:ARGUMENT` can name: one table, so that a new kind is one row."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.perception.ports import Perception, TextEncoder


@dataclass(frozen=True)
class PerceptionKind:
    """make: (argument, text encoder, seed) -> Perception; raises Failure. expensive: its output is cached frame by
    frame, and never computed twice."""

    make: Callable[[str, TextEncoder, int], Perception]
    argument: str
    expensive: bool


def _recorded(path: str, text_encoder: TextEncoder, seed: int) -> Perception:  # noqa: ARG001
    from openbelief.perception.recorded import RecordedPerception, RecordedPerceptionError

    try:
        return RecordedPerception(path)
    except RecordedPerceptionError as error:
        raise Failure(str(error)) from error


def _scripted(scene: str, text_encoder: TextEncoder, seed: int) -> Perception:
    from sim_fakes.scripted_perception import ScriptedPerception
    from sim_fakes.world import World

    try:
        return ScriptedPerception(World.load(scene), text_encoder, seed=seed)
    except (OSError, ValueError) as error:
        raise Failure(f"--perception scripted:{scene}: {error}") from error


KINDS = {
    "recorded": PerceptionKind(_recorded, "FILE.jsonl", expensive=False),
    "scripted": PerceptionKind(_scripted, "SCENE.json", expensive=True),
}
FORMS = " | ".join(f"{name}:{kind.argument}" for name, kind in KINDS.items())


def kind_of(spec: str) -> tuple[PerceptionKind, str]:
    """The row and the argument of "KIND:ARGUMENT"; raises Failure naming the kinds there are."""
    name, _, argument = spec.partition(":")
    if name not in KINDS or not argument:
        raise Failure(f"--perception should be {FORMS}, got {spec!r}.")
    return KINDS[name], argument


def open_perception(spec: str, text_encoder: TextEncoder, seed: int = 0) -> Perception:
    """The perception that "KIND:ARGUMENT" names; raises Failure. seed: of what is simulated."""
    kind, argument = kind_of(spec)
    return kind.make(argument, text_encoder, seed)
