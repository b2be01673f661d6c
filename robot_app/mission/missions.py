"""One mission from a configuration: open the robot, ask, record the trial."""

from __future__ import annotations

import itertools
import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from behaviors.events import USE_THE_REMOTE, Outcome
from behaviors.policy import MissionPolicy
from drivers.clock import SystemClock
from drivers.ports import Clock, Operator, StopRequest
from logs.structured import configure
from logs.trial.journal import Entry, Journal
from openbelief.memory import ObjectMemory
from openbelief.perception.ports import TextEncoder
from openbelief.request import command, parse
from openbelief.retrieval import Readout
from robot_app.app import Robot, mission_perception, mission_text_encoder, open_robot
from robot_app.config import Config, ConfigError, dump_config
from robot_app.mission.attended import attended
from robot_app.mission.operator import AGENT, SharedOperator
from robot_app.mission.recorded import Asking, MissionSettings, run_recorded
from robot_app.mission.safety import Watch, watched

GOAL_POSE_LIBRARIES = ("scipy.ndimage", "scipy.spatial")  # that goal poses import when they are first asked for


@dataclass(frozen=True)
class RecordedMission:
    """A mission's outcome and its trial. failure: why the trial is not on the disk, None where it is."""

    outcome: Outcome
    trial: Path
    failure: str | None

    def as_json(self) -> dict[str, Any]:
        return {**self.outcome.as_json(), "trial": str(self.trial), "trial_failure": self.failure}


class Missions:
    """Missions of one operator on one robot over one frozen memory."""

    def __init__(
        self,
        config: Config,
        robot: Robot,
        memory: ObjectMemory,
        memory_path: Path,
        operator: Operator,
        watch: Watch,
        kept: Config | None = None,
    ) -> None:
        """kept: the configuration that trials keep, where it is another: a simulated robot's behind its wire."""
        self._config, self._memory_path, self._kept = config, memory_path, kept or config
        self._trial: Journal | None = None
        self._named = ""  # the last sentence that names a thing
        self._parameters = config.mission_parameters(memory.parameters)
        self.watch, self.robot, self.memory = watch, robot, memory
        perception = mission_perception(config, mission_text_encoder(config))
        ports = replace(robot.ports(operator, perception, watch.safety), navigator=watch.navigator)
        self.ports = attended(ports, operator) if isinstance(operator, SharedOperator) else ports

    def ask(
        self,
        sentence: str,
        trial: Path | None = None,
        *,
        who: str = "",
        how: str = "",
        watching: Sequence[Journal] = (),
        notes: Sequence[Entry] = (),
        insist: bool = False,
    ) -> RecordedMission:
        """Run one mission to its end. Raises ValueError where the sentence names nothing.

        who, how: who asks, and by which client. watching: see everything as it is written.
        notes: of how it was asked, for the trial. insist: drive there although the map may hold no such thing.
        """
        asking = Asking(sentence=sentence, who=who, how=how, after=self._after(sentence), notes=notes)
        self.watch.heartbeat.resume()
        trial_id = f"{self.robot.clock.now_ns()}"
        path = trial or _unused(self._config.trials / f"trial_{trial_id}.mcap")
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            outcome, failure = self._recorded(path, asking, self._policy(how, insist=insist), trial_id, watching)
        finally:
            self._trial = None
        if USE_THE_REMOTE in outcome.reason.lower():
            self.watch.heartbeat.abandon()  # our cancel went unanswered: the watchdog on the robot cancels there
        return RecordedMission(outcome, path, failure)

    def _recorded(
        self, path: Path, asking: Asking, policy: MissionPolicy, trial_id: str, watching: Sequence[Journal]
    ) -> tuple[Outcome, str | None]:
        return run_recorded(
            path,
            asking,
            ports=self.ports,
            memory=self.memory,
            memory_path=self._memory_path,
            settings=MissionSettings(parameters=self._parameters, policy=policy, grounded=self._config.grounded),
            trial_id=trial_id,
            query_id=f"{trial_id}-1",
            configuration=dump_config(self._kept),
            watching=watching,
            opened=self._opened,
        )

    def _after(self, sentence: str) -> str:
        """The last sentence that names a thing, where this one is of it ("the other one"); else "", and this is it."""
        if command(sentence) is not None:
            return ""
        request = parse(sentence)
        if self._named and parse(sentence, parse(self._named)).target != request.target:
            return self._named
        self._named = self._named if request.generic else sentence
        return ""

    def note(self, note: Entry) -> None:
        """Keep it in the trial of the mission under way, from any thread; between missions there is none to keep it."""
        if (trial := self._trial) is not None:
            trial.write(note.record, note.attached)

    def _policy(self, how: str, *, insist: bool) -> MissionPolicy:
        """What an agent asks for never moves the robot without a person's yes, whatever the configuration allows."""
        policy = replace(self._config.mission, doubt="insist") if insist else self._config.mission
        return replace(policy, motion="ask") if how == AGENT else policy

    def _opened(self, trial: Journal) -> None:
        self._trial = trial


def _unused(path: Path) -> Path:
    """The path, numbered where it is taken: a simulated robot wakes at the same moment every time."""
    numbered = (path.with_stem(f"{path.stem}_{number}") for number in itertools.count(2))
    return next(each for each in itertools.chain([path], numbered) if not each.exists())


@contextmanager
def open_missions(config: Config, operator: Operator, *, kept: Config | None = None) -> Iterator[Missions]:
    """Memory and robot of a configuration. Raises ConfigError, BeliefFileError or PortError with a sentence.

    kept: the configuration that trials keep instead.
    """
    if config.memory is None:
        raise ConfigError('no memory is named: say memory = "site.belief" (openbelief map makes one)')
    with (
        _opened_memory(config.memory, mission_text_encoder(config), config.mission.readout) as (memory, memory_path),
        open_robot(config, lambda: _because(operator.stop_requested())) as robot,
        _log_file(config.trials / "log.jsonl", robot.clock),
        watched(config, robot, memory) as watch,
    ):
        yield Missions(config, robot, memory, memory_path, operator, watch, kept)


@contextmanager
def _opened_memory(path: Path, encoder: TextEncoder, readout: Readout) -> Iterator[tuple[ObjectMemory, Path]]:
    """The memory, and a path to its file that stays its own whatever is put in its place meanwhile.

    Raises BeliefFileError, and ConfigError where it was replaced just now.
    """
    with ExitStack() as opened:
        kept = opened.enter_context(path.open("rb")) if path.is_file() else None
        memory = _ready_memory(path, encoder, readout)  # says what is wrong with a file that is none
        if kept is None or os.fstat(kept.fileno()).st_ino != path.stat().st_ino:
            raise ConfigError(f"{path} was replaced while it was opened: start again")
        yield memory, Path(f"/proc/self/fd/{kept.fileno()}")


def _because(stop: StopRequest | None) -> str | None:
    return stop.because if stop else None


@contextmanager
def _log_file(path: Path, clock: Clock) -> Iterator[None]:
    """The structured log of these missions goes beside their trials; the screen is the operator's."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8", buffering=1) as stream:
        configure(clock, stream, json_lines=True)
        try:
            yield
        finally:
            configure(SystemClock())


def _ready_memory(path: Path, encoder: TextEncoder, readout: Readout) -> ObjectMemory:
    """The memory, with what a first question and its goal pose would load while pictures and an operator wait."""
    memory = ObjectMemory.open(path, text_encoder=encoder)
    memory.rank("ready", readout)
    for library in GOAL_POSE_LIBRARIES:
        import_module(library)
    return memory
