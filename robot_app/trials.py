"""Trials: a mission recorded as it runs, replayed later to the same decisions, and listed."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from behaviors.events import Outcome
from behaviors.mission import Mission
from behaviors.policy import MissionPolicy
from drivers.ports import Ports
from logs.journal import ListJournal
from logs.reader import LogError
from logs.structured import trial_context
from logs.trial import MEMORY_MAX_BYTES, NoTrial, TrialError, TrialHeader, TrialReader, TrialWriter
from logs.trial_compare import Difference, compare_decisions
from logs.trial_records import Checks, Chosen, Exclusion, Record
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.ports import TextEncoder
from openbelief.target_phrase import target_phrase
from robot_app.cli import Failure
from sim_fakes.replay import replay_ports


@dataclass(frozen=True)
class Replayed:
    """A replay's decisions, and the first that is not the trial's."""

    trial: TrialReader
    decisions: list[Record]
    difference: Difference | None


@dataclass(frozen=True)
class TrialSummary:
    """One line of `openbelief trials`. broken: why the file cannot be read; then nothing else is known."""

    path: Path
    started_ns: int = 0
    sentence: str = ""
    end: str = ""
    reason: str = ""
    visits: int = 0
    candidates: tuple[tuple[str, str], ...] = ()  # (label, verdict or why it was set aside)
    broken: str | None = None


def run_recorded(
    path: Path,
    sentence: str,
    *,
    ports: Ports,
    memory: ObjectMemory,
    memory_path: Path,
    parameters: Parameters,
    policy: MissionPolicy,
    trial_id: str,
    query_id: str,
    configuration: str | None = None,
) -> tuple[Outcome, str | None]:
    """One mission, recorded to `path`: its outcome, and why the recording failed (None where it did not).

    Raises ValueError where the sentence names nothing; no file is begun then.
    """
    target_phrase(sentence)
    about = TrialHeader(
        trial_id=trial_id,
        query_id=query_id,
        memory_hash=memory.content_hash,
        text_encoder_id=memory.text_encoder_id,
        settings={"parameters": parameters.to_dict(), "policy": policy.to_dict()},
    )
    with (
        trial_context(trial_id=trial_id, query_id=query_id),
        TrialWriter(path, ports.clock, about=about, memory_path=memory_path, configuration=configuration) as journal,
    ):
        outcome = Mission(ports, memory, parameters, policy, journal).run(sentence)
    return outcome, journal.failure


def replay_trial(path: Path, memory_path: Path | None = None) -> Replayed:
    """The mission again, from the trial's inputs. Raises LogError, TrialError, BeliefFileError or ValueError."""
    trial = TrialReader(path).whole()
    journal = ListJournal()
    mission = Mission(
        replay_ports(trial.entries),
        trial_memory(trial, memory_path),
        Parameters.from_dict(dict(trial.about.settings["parameters"])),
        MissionPolicy.from_dict(dict(trial.about.settings["policy"])),
        journal,
    )
    mission.run(trial.query.sentence)
    return Replayed(trial, journal.decisions, compare_decisions(trial.decisions, journal.decisions))


def trial_memory(trial: TrialReader, memory_path: Path | None) -> ObjectMemory:
    """The memory that the trial used: the file given, else the attached one; another content hash is refused."""
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
    if memory.content_hash != trial.about.memory_hash:
        raise TrialError(
            f"{memory_path or trial.path} holds memory {memory.content_hash[:12]}, the trial used "
            f"{trial.about.memory_hash[:12]}: give that file with --memory"
        )
    return memory


def _encoder(trial: TrialReader) -> TextEncoder:
    from robot_app.text_encoders import text_encoder_by_id

    try:
        return text_encoder_by_id(trial.about.text_encoder_id)
    except Failure as failure:
        raise TrialError(f"{trial.path} cannot be replayed. {failure}") from failure


def summaries(folder: Path) -> Iterator[TrialSummary]:
    """Every trial of a folder, by name; one that cannot be read says why. Recordings of other things are left out."""
    for path in sorted(folder.glob("*.mcap")):
        try:
            yield _summary(TrialReader(path))
        except NoTrial:
            continue
        except (LogError, TrialError, OSError) as error:
            yield TrialSummary(path, broken=str(error))


def _summary(trial: TrialReader) -> TrialSummary:
    outcome = trial.outcome
    return TrialSummary(
        path=trial.path,
        started_ns=trial.started_ns,
        sentence=trial.query.sentence,
        end=outcome.end if outcome else "UNFINISHED",
        reason=outcome.reason if outcome else "cut off before its end",
        visits=outcome.visits if outcome else 0,
        candidates=tuple(_stories(trial.decisions).values()),
    )


def _stories(decisions: list[Record]) -> dict[int, tuple[str, str]]:
    """object id -> (label, last verdict, or why it was set aside), in the order of the tries."""
    stories: dict[int, tuple[str, str]] = {}
    for record in decisions:
        if isinstance(record, Chosen):
            stories[record.object_id] = (record.label, "not looked at")
        elif isinstance(record, Checks):
            stories[record.object_id] = (stories[record.object_id][0], record.verdict)
        elif isinstance(record, Exclusion) and record.where == "set aside":
            stories[record.object_id] = (stories[record.object_id][0], f"set aside: {record.because}")
    return stories
