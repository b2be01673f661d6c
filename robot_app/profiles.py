"""The profile behind `--perception paper:PROFILE.toml`: who proposes phrases, who segments, who encodes. Typed."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from openbelief.documents import from_toml
from openbelief.perception.vlm_config import (
    Concurrency,
    Endpoint,
    Model,
    Patience,
    PictureFormat,
    PictureKind,
    Side,
    VlmConfig,
)
from openbelief.settings import Positive, first_complaint
from robot_app.cli import Failure

if TYPE_CHECKING:
    from openbelief.perception.composed import ComposedPerception
    from openbelief.perception.ports import SegmentEncoder, Segmenter, TextEncoder
    from openbelief.perception.recorded import RecordedPerception
    from openbelief.perception.retry import RetryClock
    from openbelief.perception.vlm import VlmProposer

BUILT_IN = Path(__file__).with_name("paper.toml")


class ProfileSection(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Vlm(ProfileSection):
    """An OpenAI-compatible server. The key itself stands in an environment variable, never in the file."""

    endpoint: Endpoint
    model: Model
    api_key_env: str | None = None
    timeout_s: Positive = 60.0
    patience_s: Patience = 300.0
    concurrency: Concurrency = 4
    requests_per_minute: Positive | None = None
    picture: PictureKind = "jpeg"
    max_side_px: Side = 1024


class Arrival(ProfileSection):
    """With a robot waiting, there is less patience than while mapping: a STOP is heeded when the look has ended.

    A look longer than the budget is a warning.
    """

    timeout_s: Positive = 15.0
    patience_s: Patience = 10.0
    budget_s: Positive = 6.0


class Profile(ProfileSection):
    """segmenter, encoder: "KIND:PATH", a row of SEGMENTERS and of ENCODERS. device: what their networks run on."""

    segmenter: str
    encoder: str
    device: Literal["auto", "cuda", "tensorrt", "cpu"] = "auto"
    vlm: Vlm
    arrival: Arrival = Arrival()


def load_profile(name: str) -> tuple[Profile, Path]:
    """The profile and the folder that its paths are relative to; "" is the built-in one. Raises Failure."""
    path = Path(name) if name else BUILT_IN
    try:
        profile = Profile.model_validate(from_toml(path.read_text(encoding="utf-8")))
    except ValidationError as error:
        raise Failure(f"{path}: {first_complaint(error)}") from error
    except (OSError, ValueError) as error:
        raise Failure(f"{path}: cannot be read as TOML: {error}") from error
    return profile, path.resolve().parent if name else Path()


def open_profile(
    name: str, clock: RetryClock, tell: Callable[[str], None], *, arrival: bool = False
) -> tuple[ComposedPerception, Profile]:
    """The profile's perception; the model server was asked whether it serves the model. Raises Failure.

    arrival: with the patience of a robot that waits.
    """
    from openbelief.perception.composed import ComposedPerception
    from openbelief.perception.model_folder import ModelFolderError
    from openbelief.perception.ports import PerceptionFailed
    from openbelief.perception.recorded import RecordedPerceptionError

    profile, base = load_profile(name)
    try:
        proposer = _proposer(profile, clock, tell, arrival)
        segmenter = _row(SEGMENTERS, profile.segmenter, base, "segmenter", profile.device)
        features, _ = _row(ENCODERS, profile.encoder, base, "encoder", profile.device)
        proposer.check()
    except (PerceptionFailed, ModelFolderError, RecordedPerceptionError, ValueError) as error:
        raise Failure(str(error)) from error
    return ComposedPerception(proposer, segmenter, features, proposer_workers=profile.vlm.concurrency), profile


def profile_text_encoder(name: str) -> TextEncoder:
    """The text encoder in whose space the profile's features live. Raises Failure."""
    from openbelief.perception.model_folder import ModelFolderError
    from openbelief.perception.recorded import RecordedPerceptionError

    profile, base = load_profile(name)
    try:
        _, text_encoder = _row(ENCODERS, profile.encoder, base, "encoder", profile.device)
    except (ModelFolderError, RecordedPerceptionError) as error:
        raise Failure(str(error)) from error
    return text_encoder


def _proposer(profile: Profile, clock: RetryClock, tell: Callable[[str], None], arrival: bool) -> VlmProposer:
    from openbelief.perception.vlm import VlmProposer

    vlm = profile.vlm
    limits = profile.arrival if arrival else vlm
    config = VlmConfig(
        endpoint=vlm.endpoint,
        model=vlm.model,
        api_key=_key(vlm.api_key_env),
        timeout_s=limits.timeout_s,
        patience_s=limits.patience_s,
        concurrency=vlm.concurrency,
        requests_per_minute=vlm.requests_per_minute,
        picture=PictureFormat(vlm.picture, vlm.max_side_px),
    )
    return VlmProposer(config, clock, tell=tell)


def _key(variable: str | None) -> str | None:
    if variable is None:
        return None
    if not (key := os.environ.get(variable)):
        raise Failure(f"The environment variable {variable} is not set, and the profile's api_key_env names it.")
    return key


def _row(table: dict[str, Callable[[Path, str], Any]], spec: str, base: Path, what: str, device: str) -> Any:
    """What "KIND:PATH" names; raises Failure naming the kinds there are."""
    kind, _, path = spec.partition(":")
    if kind not in table or not path:
        raise Failure(f"The profile's {what} should be {' or '.join(f'{name}:PATH' for name in table)}, got {spec!r}.")
    return table[kind](base / path, device)


@cache
def _recorded(path: Path) -> RecordedPerception:
    from openbelief.perception.recorded import RecordedPerception

    return RecordedPerception(path)


def _recorded_segmenter(path: Path, _device: str) -> Segmenter:
    from openbelief.perception.recorded_parts import RecordedSegmenter

    return RecordedSegmenter(_recorded(path))


def _recorded_encoder(path: Path, _device: str) -> tuple[SegmentEncoder, TextEncoder]:
    from openbelief.perception.recorded_parts import RecordedFeatures
    from openbelief.perception.sentence import SentenceEncoder

    return RecordedFeatures(_recorded(path)), SentenceEncoder()


def _sam3(path: Path, device: str) -> Segmenter:
    from openbelief.perception.sam3 import Sam3Segmenter

    return Sam3Segmenter(path, device=device)


@cache
def _clip(path: Path, device: str) -> tuple[SegmentEncoder, TextEncoder]:
    from openbelief.perception.clip import Clip
    from openbelief.perception.global_local import GlobalLocalFeatures

    clip = Clip(path, device=device)
    return GlobalLocalFeatures(clip.images), clip.text


SEGMENTERS: dict[str, Callable[[Path, str], Segmenter]] = {"sam3": _sam3, "recorded": _recorded_segmenter}
# The second of the pair is the text encoder that a memory of these features is asked with.
ENCODERS: dict[str, Callable[[Path, str], tuple[SegmentEncoder, TextEncoder]]] = {
    "clip": _clip,
    "recorded": _recorded_encoder,
}
