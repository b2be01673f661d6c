"""A mission, recorded to its trial as it runs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from behaviors.events import Outcome
from behaviors.mission import Mission
from behaviors.policy import MissionPolicy
from drivers.ports import Ports
from logs.structured import trial_context
from logs.trial.header import TrialHeader
from logs.trial.journal import Entry, Journal, Tee
from logs.trial.writer import TrialWriter
from openbelief.grounded.options import GroundedOptions
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.request import parse
from robot_app.mission.command_replies import reply_to


@dataclass(frozen=True, kw_only=True)
class MissionSettings:
    """What a mission decides with; its trial keeps it."""

    parameters: Parameters
    policy: MissionPolicy
    grounded: GroundedOptions = field(default_factory=GroundedOptions)

    def as_json(self) -> dict[str, Any]:
        return {
            "parameters": self.parameters.to_dict(),
            "policy": self.policy.to_dict(),
            "grounded": self.grounded.to_dict(),
        }


@dataclass(frozen=True, kw_only=True)
class Asking:
    """A sentence as it was asked. who, how: by whom, with which client. after: what "the other one" refers to.

    notes: for the trial, from before the mission: the sound of the sentence perhaps.
    """

    sentence: str
    who: str = ""
    how: str = ""
    after: str = ""
    notes: Sequence[Entry] = ()


def run_recorded(
    path: Path,
    asking: Asking,
    *,
    ports: Ports,
    memory: ObjectMemory,
    memory_path: Path,
    settings: MissionSettings,
    trial_id: str,
    query_id: str,
    configuration: str | None = None,
    watching: Sequence[Journal] = (),
    opened: Callable[[Journal], None] | None = None,
) -> tuple[Outcome, str | None]:
    """One mission, recorded to `path`: its outcome, and why the recording failed (None where it did not).

    watching: journals that see what the file does, as it is written. opened: is given the trial, for more notes.
    Raises ValueError where the sentence names nothing; no file is begun then.
    """
    not_a_command(asking.sentence)
    about = _header(memory, settings, trial_id, query_id)
    with (
        trial_context(trial_id=trial_id, query_id=query_id),
        TrialWriter(path, ports.clock, about=about, memory_path=memory_path, configuration=configuration) as journal,
    ):
        if opened is not None:
            opened(journal)
        outcome = _run(asking, ports, memory, settings, Tee((journal, *watching)))
    return outcome, journal.failure


def _header(memory: ObjectMemory, settings: MissionSettings, trial_id: str, query_id: str) -> TrialHeader:
    return TrialHeader(
        trial_id=trial_id,
        query_id=query_id,
        memory_hash=memory.content_hash,
        state_hash=memory.state_hash,
        text_encoder_id=memory.text_encoder_id,
        settings=settings.as_json(),
    )


def _run(asking: Asking, ports: Ports, memory: ObjectMemory, settings: MissionSettings, journal: Journal) -> Outcome:
    for note in asking.notes:
        journal.write(note.record, note.attached)
    mission = Mission(ports, memory, settings.parameters, settings.policy, journal, settings.grounded)
    return mission.run(asking.sentence, who=asking.who, how=asking.how, after=asking.after)


def not_a_command(sentence: str) -> None:
    """Raises ValueError where a sentence starts no drive: it is a command, or names nothing."""
    if (said := reply_to(sentence)) is not None:
        raise ValueError(f"{sentence.strip()!r} starts no drive. {said}")
    parse(sentence)
