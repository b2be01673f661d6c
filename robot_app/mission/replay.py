"""A trial, replayed: the mission again from the trial's inputs, and its decisions compared."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from behaviors.mission import Mission
from behaviors.policy import MissionPolicy
from logs.trial.compare import BY_PERCEPTION, EXACTLY, Difference, compare_decisions
from logs.trial.header import TrialError
from logs.trial.journal import ListJournal
from logs.trial.perception_comparison import PerceptionComparison
from logs.trial.reader import TrialReader
from logs.trial.records import Record
from logs.trial.replay_ports import replay_ports
from logs.trial.writer import MEMORY_MAX_BYTES
from openbelief.documents import from_toml
from openbelief.grounded.options import GroundedOptions
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.ports import Perception, TextEncoder
from openbelief.perception.stages import StagedPerception
from robot_app.cli import Failure
from robot_app.mission.recorded import MissionSettings
from robot_app.perceptions import open_perception

GROUNDED_BEFORE = {"contradicted_at": None}  # a trial without the key did not doubt a colour
BEFORE = {
    "unseen": "set aside",
    "standing": "inferred",
    "readout": "consensus",
    "arrival_check": "paper",
    "unlooked": "fault",
}  # what a trial did whose policy does not say


@dataclass(frozen=True)
class Replayed:
    """A replay's decisions, and the first unlike the trial's. again: what perception saw, where it looked again."""

    trial: TrialReader
    decisions: list[Record]
    difference: Difference | None
    again: PerceptionComparison | None = None


def replay_trial(
    path: Path, memory_path: Path | None = None, perception: str | None = None, seed: int | None = None
) -> Replayed:
    """The mission again, from the trial's inputs. Raises LogError, TrialError, BeliefFileError, Failure or ValueError.

    perception: what looks at the arrival frames again ("KIND:ARGUMENT"); then decisions are compared BY_PERCEPTION.
    seed: of a simulated perception; None is the trial's own.
    """
    trial = TrialReader(path).whole()
    memory = trial_memory(trial, memory_path)
    with ExitStack() as opened:
        ports, again = replay_ports(trial.entries), None
        if perception is not None:
            other = opened.enter_context(perception_again(trial, memory, perception, seed))
            again = PerceptionComparison(ports.perception, other)
            ports = replace(ports, perception=again)
        journal = ListJournal()
        settings = _settings(trial)
        mission = Mission(ports, memory, settings.parameters, settings.policy, journal, settings.grounded)
        mission.run(trial.query.sentence, after=trial.query.after)
    if again is not None and again.failure is not None:
        raise TrialError(f"{again.id} could not look at the trial's frames: {again.failure}") from again.failure
    tolerance = EXACTLY if again is None else BY_PERCEPTION
    return Replayed(trial, journal.decisions, compare_decisions(trial.decisions, journal.decisions, tolerance), again)


def _settings(trial: TrialReader) -> MissionSettings:
    told = trial.about.settings
    return MissionSettings(
        parameters=Parameters.from_dict(dict(told["parameters"])),
        policy=MissionPolicy.from_dict(BEFORE | dict(told["policy"])),
        grounded=GroundedOptions.from_dict(GROUNDED_BEFORE | dict(told.get("grounded", {}))),
    )


@contextmanager
def perception_again(trial: TrialReader, memory: ObjectMemory, spec: str, seed: int | None) -> Iterator[Perception]:
    """The perception of that name, closed at the end. Raises Failure; TrialError where its features do not fit."""
    encoder = memory.text_encoder
    if encoder is None:
        raise TrialError(f"{trial.path} cannot be looked at again without its text encoder")
    perception = open_perception(spec, encoder, _seed(trial) if seed is None else seed)
    with ExitStack() as opened:
        if isinstance(perception, StagedPerception):
            opened.callback(perception.close)
        space = getattr(perception, "text_space", None)
        if perception.feature_text_aligned and space not in (None, encoder.id):
            raise TrialError(f"The features of {perception.id} live in the text space of {space}, not of {encoder.id}")
        yield perception


def _seed(trial: TrialReader) -> int:
    """Of the trial's simulation; 0 where nothing was simulated."""
    return int(from_toml(trial.configuration or "").get("sim", {}).get("seed", 0))


def trial_memory(trial: TrialReader, memory_path: Path | None) -> ObjectMemory:
    """The memory that the trial used: the file given, else the attached one; one of another hash is refused."""
    encoder = _encoder(trial)
    if memory_path is not None:
        memory = ObjectMemory.open(memory_path, text_encoder=encoder)
    elif trial.memory_bytes is not None:
        with tempfile.TemporaryDirectory() as folder:
            attached = Path(folder) / "memory.belief"
            attached.write_bytes(trial.memory_bytes)
            memory = ObjectMemory.open(attached, text_encoder=encoder)
    else:
        raise TrialError(
            f"{trial.path} names its memory only by its hash {trial.about.memory_hash[:12]} (over "
            f"{MEMORY_MAX_BYTES >> 20} MiB): give the file with --memory"
        )
    _require_same(memory, trial, memory_path or trial.path)
    return memory


def _require_same(memory: ObjectMemory, trial: TrialReader, path: Path) -> None:
    """Content and rooms, as far as the trial names them. Raises TrialError."""
    if memory.content_hash != trial.about.memory_hash:
        raise TrialError(
            f"{path} holds memory {memory.content_hash[:12]}, the trial used "
            f"{trial.about.memory_hash[:12]}: give that file with --memory"
        )
    if trial.about.state_hash not in (None, memory.state_hash):
        raise TrialError(
            f"{path} holds the memory with other rooms (state {memory.state_hash[:12]}) than the trial used "
            f"({(trial.about.state_hash or '')[:12]}): give that file with --memory"
        )


def _encoder(trial: TrialReader) -> TextEncoder:
    from robot_app.text_encoders import text_encoder_by_id

    try:
        return text_encoder_by_id(trial.about.text_encoder_id)
    except Failure as failure:
        raise TrialError(f"{trial.path} cannot be replayed. {failure}") from failure
