"""The trials of a folder: what each was about and how it ended."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from logs.mcap_io.reader import LogError
from logs.trial.header import NoTrial, TrialError
from logs.trial.reader import TrialReader
from logs.trial.records import Checks, Chosen, Exclusion, Record
from openbelief.documents import from_toml


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
            stories[record.object_id] = (_label(stories, record.object_id), record.verdict)
        elif isinstance(record, Exclusion) and record.where == "set aside":
            stories[record.object_id] = (_label(stories, record.object_id), f"set aside: {record.because}")
    return stories


def _label(stories: dict[int, tuple[str, str]], object_id: int) -> str:
    """What it was called when it was chosen; a trial that lost its beginning does not say."""
    return stories[object_id][0] if object_id in stories else f"object {object_id}"
