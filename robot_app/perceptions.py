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
    frame, and never computed twice. optional: the argument may be left out, and is then "". live: as make, for a robot
    that waits; None where that makes no difference. text_encoder: argument -> the encoder that its memories are asked
    with; None is the sentence encoder."""

    make: Callable[[str, TextEncoder, int], Perception]
    argument: str
    expensive: bool
    optional: bool = False
    live: Callable[[str, TextEncoder, int], Perception] | None = None
    text_encoder: Callable[[str], TextEncoder] | None = None


def _recorded(path: str, text_encoder: TextEncoder, seed: int) -> Perception:  # noqa: ARG001
    from openbelief.perception.recorded import RecordedPerception, RecordedPerceptionError

    try:
        return RecordedPerception(path)
    except RecordedPerceptionError as error:
        raise Failure(str(error)) from error


def _scripted(scene: str, text_encoder: TextEncoder, seed: int) -> Perception:
    from sim_fakes.world.scripted_perception import ScriptedPerception
    from sim_fakes.world.world import World

    try:
        return ScriptedPerception(World.load(scene), text_encoder, seed=seed)
    except (OSError, ValueError) as error:
        raise Failure(f"--perception scripted:{scene}: {error}") from error


def _detector(folder: str, text_encoder: TextEncoder, seed: int) -> Perception:  # noqa: ARG001
    from openbelief.perception.detector import open_detector
    from openbelief.perception.onnx_session import ModelFileError

    try:
        return open_detector(folder)
    except ModelFileError as error:
        raise Failure(str(error)) from error


def _paper(profile: str, text_encoder: TextEncoder, seed: int) -> Perception:  # noqa: ARG001
    from drivers.clock import SystemClock
    from robot_app.profiles import open_profile

    return open_profile(profile, SystemClock(), _tell)[0]


def _paper_live(profile: str, text_encoder: TextEncoder, seed: int) -> Perception:  # noqa: ARG001
    from drivers.clock import SystemClock
    from robot_app.mission.latency import WatchedPerception
    from robot_app.profiles import open_profile

    perception, settings = open_profile(profile, SystemClock(), _tell, arrival=True)
    return WatchedPerception(perception, SystemClock(), budget_s=settings.arrival.budget_s)


def _paper_text_encoder(profile: str) -> TextEncoder:
    from robot_app.profiles import profile_text_encoder

    return profile_text_encoder(profile)


def _tell(sentence: str) -> None:
    from logs.structured import logger

    logger().warning("model_server", said=sentence)


KINDS = {
    "recorded": PerceptionKind(_recorded, "FILE.jsonl", expensive=False),
    "scripted": PerceptionKind(_scripted, "SCENE.json", expensive=True),
    "detector": PerceptionKind(_detector, "FOLDER", expensive=True),
    "paper": PerceptionKind(
        _paper, "PROFILE.toml", expensive=True, optional=True, live=_paper_live, text_encoder=_paper_text_encoder
    ),
}
FORMS = " | ".join(
    f"{name}[:{kind.argument}]" if kind.optional else f"{name}:{kind.argument}" for name, kind in KINDS.items()
)


def kind_of(spec: str) -> tuple[PerceptionKind, str]:
    """The row and the argument of "KIND:ARGUMENT"; raises Failure naming the kinds there are."""
    name, _, argument = spec.partition(":")
    if name not in KINDS or not (argument or KINDS[name].optional):
        raise Failure(f"--perception should be {FORMS}, got {spec!r}.")
    return KINDS[name], argument


def open_perception(spec: str, text_encoder: TextEncoder, seed: int = 0) -> Perception:
    """The perception that "KIND:ARGUMENT" names, for a mission; raises Failure. seed: of what is simulated."""
    kind, argument = kind_of(spec)
    return (kind.live or kind.make)(argument, text_encoder, seed)


def text_encoder_of(spec: str) -> TextEncoder:
    """What memories of this perception are asked with; raises Failure."""
    from openbelief.perception.sentence import SentenceEncoder

    kind, argument = kind_of(spec)
    return kind.text_encoder(argument) if kind.text_encoder else SentenceEncoder()
