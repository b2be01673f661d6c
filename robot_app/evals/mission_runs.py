"""Simulated missions with known truth: one map a seed, one query each, by either check on arrival."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from behaviors.policy import MissionPolicy
from drivers.ports import Approval, Question, Reply, StopRequest
from openbelief.documents import from_json
from openbelief.evaluation.truth import ABSENT, TrueQuery, Truth, read_truth
from openbelief.memory import ObjectMemory
from openbelief.perception.sentence import SentenceEncoder
from openbelief.rooms import rooms_of
from robot_app.config import Config
from robot_app.config_sections import SimSection
from robot_app.demo.walk import record_walk
from robot_app.mapping.job import MapJob, Progress
from robot_app.mapping.run import run_map
from robot_app.mission.missions import open_missions
from sim_fakes.world.world import World

CHECKS = ("paper", "relative")
FAR_M = 1.0  # a confirmed object this far from everything accepted is another place, not another piece


@dataclass(frozen=True)
class MissionRun:
    """One mission's end against the truth. right: what was confirmed lies in an accepted box; None where nothing was.

    far: it lies over 1 m from every one. rejected_right: right candidates that verification rejected. mapped: whether
    the map holds a right candidate at all.
    """

    seed: int
    query: str
    kind: str
    check: str
    end: str
    reason: str
    visits: int
    right: bool | None
    far: bool | None
    rejected_right: int
    mapped: bool
    content_hash: str


class Consenting:
    """The operator of an evaluation: says yes to every question, never stop."""

    def confirm(self, question: Question, timeout_s: float) -> Reply:  # noqa: ARG002 - nobody is waited for
        return Reply(Approval.YES, how="evaluation")

    def stop_requested(self) -> StopRequest | None:
        return None

    def tell(self, sentence: str) -> None:
        """Nobody listens."""


class MissionRuns:
    """Missions over one scene, in a folder that a second call goes on from.

    The scene is walked and recorded once; a seed is that of perception, while mapping and on arrival, and of the live
    sensors' noise. Each mission's end is a line of runs.jsonl, and is not run again.
    """

    def __init__(self, folder: Path, scene: str, progress: Progress) -> None:
        self._folder, self._scene, self._progress = folder, scene, progress
        self._world, self._encoder = World.load(scene), SentenceEncoder()

    def run(self, seeds: Sequence[int], checks: Sequence[str], tell: Callable[[MissionRun], None]) -> list[MissionRun]:
        """Every seed's mission by every check. Raises OSError, PortError or ValueError with a sentence."""
        self._folder.mkdir(parents=True, exist_ok=True)
        truth, runs = self._truth(), list[MissionRun]()
        for seed in seeds:
            query = query_of(truth, seed)
            wanted = {(seed, query.query, check) for check in checks}
            done = [run for run in self._done() if (run.seed, run.query, run.check) in wanted]
            missing = [check for check in checks if check not in {run.check for run in done}]
            memory = self._memory(seed) if missing else None
            for check in missing:
                assert memory is not None
                done.append(self._mission(seed, query, check, truth, memory))
                self._keep(done[-1])
                tell(done[-1])
            runs += done
        return runs

    @property
    def _walk(self) -> Path:
        return self._folder / "walk.mcap"

    def _config(self, seed: int, **more: Any) -> Config:
        return Config(trials=self._folder, sim=SimSection(scene=self._scene, seed=seed), **more)

    def _truth(self) -> Truth:
        """Of the scene, beside its recorded walk; both are made where they are not there."""
        path = self._folder / "walk.truth.json"
        if not path.is_file() or not self._walk.is_file():
            record_walk(self._config(1), self._walk, lambda n, total: self._progress.frames("walk", n, total))
            path.write_text(json.dumps(self._world.truth()), encoding="utf-8")
        return read_truth(path)

    def _memory(self, seed: int) -> Path:
        path = self._folder / f"seed-{seed:03}.belief"
        if not path.is_file():
            rooms = rooms_of(self._world.truth()["rooms"])
            job = MapJob([self._walk], path, [f"scripted:{self._scene}"], force=True, seed=seed, rooms=rooms)
            run_map(job, self._encoder, self._progress)
            for cache in self._folder.glob(f"{path.name}.*.perception.jsonl"):
                cache.unlink()
        return path

    def _mission(self, seed: int, query: TrueQuery, check: str, truth: Truth, path: Path) -> MissionRun:
        policy = MissionPolicy.from_dict({"motion": "ask", "unseen": "set aside", "arrival_check": check})
        trial = self._folder / f"seed-{seed:03}-{check}.mcap"
        for left in self._folder.glob(f"{trial.stem}.*"):  # of a run that was interrupted
            left.unlink()
        with open_missions(self._config(seed, memory=path, mission=policy), Consenting()) as missions:
            outcome = missions.ask(f"take me to the {query.query}", trial).outcome
            memory = missions.memory
        confirmed = outcome.object_id
        return MissionRun(
            seed=seed,
            query=query.query,
            kind=query.kind,
            check=check,
            end=str(outcome.end),
            reason=outcome.reason,
            visits=outcome.visits,
            right=None if confirmed is None else is_right(memory, confirmed, query, truth),
            far=None if confirmed is None else _is_far(memory, confirmed, query, truth),
            rejected_right=sum(is_right(memory, i, query, truth) for i in outcome.rejected),
            mapped=any(is_right(memory, node.id, query, truth) for node in memory.objects),
            content_hash=memory.content_hash,
        )

    @property
    def _runs(self) -> Path:
        return self._folder / "runs.jsonl"

    def _done(self) -> Iterator[MissionRun]:
        lines = self._runs.read_text(encoding="utf-8").splitlines() if self._runs.is_file() else []
        yield from (MissionRun(**from_json(line)) for line in lines)

    def _keep(self, run: MissionRun) -> None:
        with self._runs.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(dataclasses.asdict(run)) + "\n")


def query_of(truth: Truth, seed: int) -> TrueQuery:
    """The findable queries in turn, so that every one of them is asked as often."""
    findable = [query for query in truth.queries if query.kind != ABSENT and query.findable]
    return findable[(seed - 1) % len(findable)]


def is_right(memory: ObjectMemory, i: int, query: TrueQuery, truth: Truth) -> bool:
    centroid = memory.objects[i].centroid
    return any(truth.objects[k].contains(centroid, truth.margin_m) for k in query.accept)


def _is_far(memory: ObjectMemory, i: int, query: TrueQuery, truth: Truth) -> bool:
    centroid = memory.objects[i].centroid
    return all(truth.objects[k].horizontal_distance(centroid) > FAR_M for k in query.accept)
