"""A recorded trial for the scrubber: the same view as the live page's, at every entry of its journal."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from behaviors.safety_policy import SafetyPolicy
from drivers.ports import CameraFrame
from logs.trial import records
from logs.trial.reader import TrialReader
from openbelief.documents import from_toml
from openbelief.memory import ObjectMemory
from openbelief.traversability import OccupancyGrid
from robot_app.console.site_plan import grid_json, grid_png, jpeg, site_json
from robot_app.mission.view import MissionView

# What is a step of the scrubber: what a person would call an event.
SHOWN = {
    records.Query: "asked",
    records.Ranking: "ranked",
    records.Chosen: "chosen",
    records.Goal: "goal",
    records.Asked: "question",
    records.OperatorReply: "answer",
    records.GoalAnswer: "goal sent",
    records.NavigationEnd: "goal ended",
    records.Frame: "picture",
    records.Checks: "checked",
    records.Exclusion: "left out",
    records.Supervised: "supervisor",
    records.Stop: "STOP",
    records.CancelAnswer: "cancelled",
    records.Transition: "state",
    records.Told: "told",
    records.Feedback: "drive",
    records.Ended: "ended",
}


class OpenTrial:
    """Raises LogError or TrialError where the file cannot be read. Everything is made from the file alone."""

    def __init__(self, path: Path) -> None:
        self.path, self._trial = path, TrialReader(path)
        self.memory = _attached_memory(self._trial)
        self._steps: list[dict[str, Any]] = []
        self._views: list[str] = []
        self._frames: dict[int, CameraFrame] = {}
        self.grid: OccupancyGrid | None = None
        self._fold()

    def as_json(self) -> dict[str, Any]:
        return {
            "name": self._trial.path.name,
            "started_ms": self._trial.started_ns // 1_000_000,
            "trial_id": self._trial.about.trial_id,
            "commit": self._trial.commit,
            "memory_hash": self._trial.about.memory_hash,
            "steps": self._steps,
            "site": site_json(self.memory, _zones(self._trial.configuration)) if self.memory else None,
            "grid": grid_json(self.grid) if self.grid else None,
        }

    def view_json(self, step: int) -> str | None:
        """The mission as it was after that step."""
        return self._views[step] if 0 <= step < len(self._views) else None

    def frame_jpeg(self, stamp_ns: int) -> bytes | None:
        frame = self._frames.get(stamp_ns)
        return None if frame is None else jpeg(frame.color)

    def grid_png(self) -> bytes | None:
        return None if self.grid is None else grid_png(self.grid)

    def _fold(self) -> None:
        view = MissionView(self.memory)
        for entry in self._trial.entries:
            view.see(entry.record, entry.attached)
            if isinstance(entry.attached, CameraFrame):
                self._frames[entry.attached.stamp_ns] = entry.attached
            if isinstance(entry.attached, OccupancyGrid):
                self.grid = entry.attached
            kind = SHOWN.get(type(entry.record))
            if kind is None:
                continue
            seen = max(self._frames, default=None) if view.frame is None else view.frame.stamp_ns
            self._steps.append(
                {
                    "at_ms": (entry.log_time_ns - self._trial.started_ns) // 1_000_000,
                    "kind": kind,
                    "text": words_of(entry.record),
                    "frame": None if seen is None else str(seen),
                }
            )
            self._views.append(json.dumps(view.as_json(), allow_nan=False))


def words_of(record: records.Record) -> str:
    """One line for the list of decisions."""
    if type(record) in WORDS:
        return WORDS[type(record)](record)
    values = (getattr(record, name, "") for name in ("sentence", "because", "reason"))
    return next((str(value) for value in values if value), "")


def _goal(goal: records.Goal) -> str:
    way = f", {goal.path_length_m:.1f} m" if goal.path_length_m is not None else ""
    return f"{goal.purpose}{way}" if goal.pose else f"no goal pose: {goal.reason}"


def _plain(state: str) -> str:
    return state.replace("_", " ")


# record -> its line; the others say their sentence or reason
WORDS: dict[type[records.Record], Callable[[Any], str]] = {
    records.Query: lambda query: f"“{query.sentence}”",
    records.Ranking: lambda ranking: f"{len(ranking.candidates)} candidates for “{ranking.target}”",
    records.Chosen: lambda chosen: f"{chosen.label} ({chosen.score:.2f})",
    records.Goal: _goal,
    records.OperatorReply: lambda said: f"{said.reply}{f' ({said.who}, {said.how})' if said.who else ''}",
    records.Checks: lambda checks: f"{checks.verdict}: {checks.reason}",
    records.Frame: lambda frame: f"{frame.intrinsics.width} x {frame.intrinsics.height}, as it was judged or measured",
    records.Transition: lambda step: f"{_plain(step.source)} → {_plain(step.target)}: {step.because}",
    records.Feedback: lambda feedback: f"{feedback.distance_remaining_m:.1f} m to go",
    records.Ended: lambda ended: f"{ended.end}: {ended.reason}",
}


def _zones(configuration: str | None) -> SafetyPolicy:
    """The keep-out areas of then; none where the trial has no configuration, or one of a form that is not read now."""
    try:
        said = from_toml(configuration or "").get("safety", {})
        return SafetyPolicy(keep_out=said.get("keep_out", ()), allowed=said.get("allowed", ()))
    except (ValueError, AttributeError):
        return SafetyPolicy()


def _attached_memory(trial: TrialReader) -> ObjectMemory | None:
    """None where the trial names its memory only by its hash."""
    if trial.memory_bytes is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        attached = Path(folder) / "memory.belief"
        attached.write_bytes(trial.memory_bytes)
        return ObjectMemory.open(attached)


@lru_cache(maxsize=2)
def opened(path: Path, stamp_ns: int, size: int) -> OpenTrial:  # noqa: ARG001 - a changed file is another one
    """The trial, parsed once while it is looked at."""
    return OpenTrial(path)
