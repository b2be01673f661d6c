"""Trials: a mission recorded as it runs, replayed later to the same decisions, and listed."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from behaviors.events import Outcome
from behaviors.mission import Mission
from behaviors.policy import MissionPolicy
from drivers.ports import Ports
from logs.mcap_io.reader import LogError
from logs.structured import trial_context
from logs.trial.compare import BY_PERCEPTION, EXACTLY, Difference, compare_decisions
from logs.trial.header import NoTrial, TrialError, TrialHeader
from logs.trial.journal import Entry, Journal, ListJournal, Tee
from logs.trial.perception_comparison import PerceptionComparison
from logs.trial.reader import TrialReader
from logs.trial.records import Checks, Chosen, Exclusion, Record
from logs.trial.replay_ports import replay_ports
from logs.trial.writer import MEMORY_MAX_BYTES, TrialWriter
from openbelief.documents import from_toml
from openbelief.grounded.options import GroundedOptions
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.ports import Perception, TextEncoder
from openbelief.perception.stages import StagedPerception
from openbelief.request import parse
from robot_app.cli import Failure
from robot_app.mission.command_replies import reply_to
from robot_app.perceptions import open_perception

BEFORE = {
    "unseen": "set aside",
    "standing": "inferred",
    "readout": "consensus",
    "arrival_check": "paper",
}  # what a trial did whose policy does not say


@dataclass(frozen=True)
class Replayed:
    """A replay's decisions, and the first unlike the trial's. again: what perception saw, where it looked again."""

    trial: TrialReader
    decisions: list[Record]
    difference: Difference | None
    again: PerceptionComparison | None = None


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
    simulated: bool | None = None  # whether the robot that drove was a simulated one; None where the trial does not say
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
    grounded: GroundedOptions | None = None,
    trial_id: str,
    query_id: str,
    configuration: str | None = None,
    who: str = "",
    how: str = "",
    after: str = "",
    watching: Sequence[Journal] = (),
    notes: Sequence[Entry] = (),
    opened: Callable[[Journal], None] | None = None,
) -> tuple[Outcome, str | None]:
    """One mission, recorded to `path`: its outcome, and why the recording failed (None where it did not).

    who, how: who asked, by which client. after: the sentence that "the other one" refers to.
    watching: journals that see what the file does, as it is written.
    notes: of before the mission, for the trial: how it was asked. opened: is given the trial, for more of them.
    Raises ValueError where the sentence names nothing; no file is begun then.
    """
    not_a_command(sentence)
    grounded = grounded or GroundedOptions()
    about = TrialHeader(
        trial_id=trial_id,
        query_id=query_id,
        memory_hash=memory.content_hash,
        state_hash=memory.state_hash,
        text_encoder_id=memory.text_encoder_id,
        settings={"parameters": parameters.to_dict(), "policy": policy.to_dict(), "grounded": grounded.to_dict()},
    )
    with (
        trial_context(trial_id=trial_id, query_id=query_id),
        TrialWriter(path, ports.clock, about=about, memory_path=memory_path, configuration=configuration) as journal,
    ):
        seen = Tee((journal, *watching))
        if opened is not None:
            opened(journal)
        for note in notes:
            seen.write(note.record, note.attached)
        outcome = Mission(ports, memory, parameters, policy, seen, grounded).run(
            sentence, who=who, how=how, after=after
        )
    return outcome, journal.failure


def not_a_command(sentence: str) -> None:
    """Raises ValueError where a sentence starts no drive: it is a command, or names nothing."""
    if (said := reply_to(sentence)) is not None:
        raise ValueError(f"{sentence.strip()!r} starts no drive. {said}")
    parse(sentence)


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
        parameters = Parameters.from_dict(dict(trial.about.settings["parameters"]))
        policy = MissionPolicy.from_dict(BEFORE | dict(trial.about.settings["policy"]))
        grounded = GroundedOptions.from_dict(dict(trial.about.settings.get("grounded", {})))
        Mission(ports, memory, parameters, policy, journal, grounded).run(trial.query.sentence, after=trial.query.after)
    if again is not None and again.failure is not None:
        raise TrialError(f"{again.id} could not look at the trial's frames: {again.failure}") from again.failure
    tolerance = EXACTLY if again is None else BY_PERCEPTION
    return Replayed(trial, journal.decisions, compare_decisions(trial.decisions, journal.decisions, tolerance), again)


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
        candidates=tuple(stories_of(trial.decisions).values()),
        simulated=_simulated(trial.configuration),
    )


def _simulated(configuration: str | None) -> bool | None:
    if configuration is None:
        return None
    try:
        bodies = from_toml(configuration).get("ports", {})
    except ValueError:
        return None
    return bool(bodies.get("navigator", "sim") == "sim")


def stories_of(decisions: list[Record]) -> dict[int, tuple[str, str]]:
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
