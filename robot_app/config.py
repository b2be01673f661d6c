"""robot.toml: one body per port, memory, perception, parameters, operator policy. Typed; unknown keys refused."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError, model_validator

from behaviors.policy import MissionPolicy
from behaviors.safety_policy import SafetyPolicy
from drivers.livox.settings import LivoxSettings
from drivers.realsense.messages import RealSenseSettings
from openbelief.documents import from_toml
from openbelief.grounded.options import GroundedOptions
from openbelief.parameters import Parameters
from openbelief.settings import first_complaint
from robot_app.config_sections import (
    ConsoleSection,
    OnboardSection,
    PairingSection,
    PerceptionSection,
    PortsSection,
    RecordingSection,
    RemoteSection,
    ReplaySection,
    Section,
    SimSection,
    TopicsSection,
    VoiceSection,
    ZenohSection,
)


class ConfigError(ValueError):
    """The configuration is refused: one line that names the file, the key and the remedy."""


ON_A_ROBOT = {"standing": "checked", "unlooked": "look again"}  # what a mission did before, only replays may do
CORRECTION = ("tau_nu", "tau_q", "tau_arr", "k_max")  # what robot.toml may change over a frozen memory


class Config(Section):
    """The whole of robot.toml; relative paths are relative to the file."""

    memory: Path | None = None
    trials: Path = Path("trials")
    ports: PortsSection = PortsSection()
    zenoh: ZenohSection = ZenohSection()
    topics: TopicsSection = TopicsSection()
    pairing: PairingSection = PairingSection()
    replay: ReplaySection = ReplaySection()
    sim: SimSection = SimSection()
    recording: RecordingSection = RecordingSection()
    realsense: RealSenseSettings = RealSenseSettings()
    livox: LivoxSettings = LivoxSettings()
    onboard: OnboardSection = OnboardSection()
    console: ConsoleSection = ConsoleSection()
    perception: PerceptionSection = PerceptionSection()
    voice: VoiceSection = VoiceSection()
    remote: RemoteSection = RemoteSection()
    mission: MissionPolicy = MissionPolicy()
    grounded: GroundedOptions = GroundedOptions()
    safety: SafetyPolicy = SafetyPolicy()
    parameters: dict[str, Any] = Field(default_factory=dict)  # CORRECTION's, where unlike the memory's

    @model_validator(mode="after")
    def _whole(self) -> Config:
        if self.ports.uses("replay") and self.replay.recording is None:
            raise ValueError('a port says "replay": name the recording with [replay] recording = "walk.mcap"')
        for name, value in ON_A_ROBOT.items():
            if getattr(self.mission, name) != value:
                raise ValueError(f'mission.{name} is for replaying old trials; on a robot it is "{value}"')
        Parameters.from_dict(self.parameters)
        return self

    def mission_parameters(self, memory: Parameters) -> Parameters:
        """The memory's own parameters with the correction loop's changed; raises ConfigError where another differs.

        A memory's belief was built with its parameters: to rank with others, it is rebuilt.
        """
        changed = dataclasses.replace(memory, **self.parameters)
        for name, value in self.parameters.items():
            if name not in CORRECTION and getattr(changed, name) != getattr(memory, name):
                raise ConfigError(
                    f"[parameters] {name} = {value!r} is not the memory's ({getattr(memory, name)!r}): "
                    f"make a memory with it by openbelief rebuild --set {name}={value}, or leave it out"
                )
        return changed


def load_config(path: Path) -> Config:
    """Read robot.toml; raises ConfigError with one line that names what is wrong."""
    try:
        values = from_toml(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}; name another with --config") from error
    except ValueError as error:
        raise ConfigError(f"{path}: cannot be read as TOML: {error}") from error
    try:
        config = Config.model_validate(values)
    except ValidationError as error:
        raise ConfigError(f"{path}: {first_complaint(error, 'the file')}") from error
    return _resolve_paths(config, path.resolve().parent)


def with_recording(config: Config, **told: str | None) -> Config:
    """The configuration with what was told of [recording]; None leaves it. Raises ConfigError."""
    values = config.recording.model_dump() | {key: value for key, value in told.items() if value is not None}
    try:
        return config.model_copy(update={"recording": RecordingSection.model_validate(values)})
    except ValidationError as error:
        raise ConfigError(f"[recording] {first_complaint(error, 'the file')}") from error


def _resolve_paths(config: Config, base: Path) -> Config:
    def resolved(path: Path | None) -> Path | None:
        return None if path is None else base / path

    return config.model_copy(
        update={
            "memory": resolved(config.memory),
            "trials": base / config.trials,
            "zenoh": config.zenoh.model_copy(
                update={name: resolved(getattr(config.zenoh, name)) for name in ("ca", "certificate", "key")}
            ),
            "voice": config.voice.model_copy(update={"recogniser": _resolve_model(config.voice.recogniser, base)}),
            "console": config.console.model_copy(
                update={name: resolved(getattr(config.console, name)) for name in ("accounts", "certificate", "key")}
            ),
            "replay": config.replay.model_copy(update={"recording": resolved(config.replay.recording)}),
        }
    )


def _resolve_model(recogniser: str, base: Path) -> str:
    """ "sherpa:KIND:FOLDER" with its folder relative to the file."""
    *kind, folder = recogniser.split(":", 2)
    return ":".join([*kind, str(base / folder)]) if len(kind) == 2 else recogniser


def dump_config(config: Config) -> str:
    """The configuration as TOML text; `load_config` reads it back to the same values."""
    lines, tables = [], []
    for name, value in config.model_dump(mode="json", exclude_none=True).items():
        if isinstance(value, dict):
            tables.append(f"\n[{name}]\n" + "".join(f"{key} = {_toml(item)}\n" for key, item in value.items()))
        else:
            lines.append(f"{name} = {_toml(value)}\n")
    return "".join(lines + tables)


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return f'"{escaped}"'
    return repr(value)
