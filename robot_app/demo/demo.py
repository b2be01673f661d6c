"""The whole loop in simulation: walk, map, ask, drive, look, reject or confirm, replay, and pictures of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from behaviors.events import Outcome
from behaviors.policy import MissionPolicy
from drivers.ports import Approval, Question, Reply, StopRequest
from openbelief.memory import ObjectMemory
from openbelief.perception.sentence import SentenceEncoder
from openbelief.rooms import rooms_of
from openbelief.target_phrase import target_phrase
from robot_app.config import Config, dump_config, load_config
from robot_app.config_sections import SimSection
from robot_app.demo.folder import CONFIG_HEAD, Files
from robot_app.demo.walk import record_walk
from robot_app.mapping.job import MapJob, Progress
from robot_app.mapping.run import run_map
from robot_app.mission.missions import open_missions
from robot_app.mission.replay import Replayed, replay_trial
from robot_app.pictures.trial import Backdrop, write_pictures
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.world import World


@dataclass(frozen=True)
class Demo:
    """What happened, and where it lies. replayed.difference is None where the trial replays identically."""

    outcome: Outcome
    replayed: Replayed
    paths: dict[str, Path]

    def as_json(self) -> dict[str, Any]:
        return {
            **self.outcome.as_json(),
            "replay": "identical" if self.replayed.difference is None else str(self.replayed.difference),
            "paths": {name: str(path) for name, path in self.paths.items()},
        }


def run_demo(folder: Path, query: str, scene: str, seed: int, progress: Progress, tell: Callable[[str], None]) -> Demo:
    """Leaves everything in `folder`. Raises Failure, PortError, SceneError or ValueError with a sentence.

    What cannot be asked, or is no scene, is refused before anything is written or removed.
    """
    target_phrase(query)
    world = World.load(scene)
    files = Files(folder)
    files.claim()
    config = _new_configuration(files, world, scene, seed, progress, tell)
    return ask_and_replay(config, files, query, tell)


def demo_configuration(folder: Path, scene: str, seed: int, progress: Progress, tell: Callable[[str], None]) -> Config:
    """The configuration of a simulated site with its memory; an earlier demo's of that scene is used as it is.

    Raises as `run_demo` does.
    """
    world, files = World.load(scene), Files(folder)
    if files.marker.is_file() and files.memory.is_file() and files.config.is_file():
        config = load_config(files.config)
        if (config.sim.scene, config.sim.seed) == (_named(scene), seed):
            tell(f"The memory of an earlier demo is used: {files.memory}.")
            return config
    files.claim()
    return _new_configuration(files, world, scene, seed, progress, tell)


def _new_configuration(
    files: Files, world: World, scene: str, seed: int, progress: Progress, tell: Callable[[str], None]
) -> Config:
    config = Config(
        memory=files.memory,
        trials=files.folder,
        sim=SimSection(scene=scene, seed=seed),
        mission=MissionPolicy(motion="allow"),
    )
    files.config.write_text(CONFIG_HEAD + dump_config(_from_its_folder(config)), encoding="utf-8")
    make_memory(config, world, files, progress, tell)
    return config


def _named(scene: str) -> str:
    """As a robot.toml names it from its own folder."""
    return str(Path(scene).resolve()) if Path(scene).is_file() else scene


def _from_its_folder(config: Config) -> Config:
    """As it reads from a robot.toml beside the memory, whose paths are relative to it."""
    sim = config.sim.model_copy(update={"scene": _named(config.sim.scene)})
    memory = config.memory and Path(config.memory.name)
    return config.model_copy(update={"memory": memory, "trials": Path(), "sim": sim})


def make_memory(
    config: Config, world: World, files: Files, progress: Progress, tell: Callable[[str], None]
) -> ObjectMemory:
    """A walk through the scene, recorded, and the memory mapped from the recording."""
    tell(f"A G1 walks through {world.name}: {len(world.rooms)} rooms, {len(world.objects)} things.")
    frames = record_walk(config, files.walk, partial(progress.frames, "walk"))
    truth = world.truth()
    files.truth.write_text(json.dumps(truth), encoding="utf-8")
    size_mb = files.walk.stat().st_size / 1e6
    tell(f"Recorded {frames} RGB-D images, lidar, poses and the map to {files.walk} ({size_mb:.0f} MB).")
    job = MapJob(
        [files.walk],
        files.memory,
        [f"scripted:{config.sim.scene}"],
        force=True,
        seed=config.sim.seed,
        rooms=rooms_of(truth["rooms"]),
    )
    memory = run_map(job, SentenceEncoder(), progress).memory
    tell(f"Mapped {len(memory.observations)} observations of {len(memory.objects)} objects to {files.memory}.")
    return memory


def ask_and_replay(config: Config, files: Files, query: str, tell: Callable[[str], None]) -> Demo:
    """One mission over the memory of `config`, its replay, and its pictures."""
    tell(f"The operator asks: {query!r}.")
    asking = MissionPolicy(motion="ask", unseen="set aside")  # as on a robot; the narrator says yes
    asked = config.model_copy(update={"mission": asking})
    with open_missions(asked, Narrator(tell)) as missions:
        recorded = missions.ask(query, files.trial)
    outcome = recorded.outcome
    tell(f"Candidates verified: {outcome.visits}.")
    replayed = replay_trial(files.trial)
    same = "identical" if replayed.difference is None else f"different: {replayed.difference}"
    tell(f"Replayed {len(replayed.decisions)} decisions from {files.trial}: {same}.")
    memory = ObjectMemory.open(files.memory, text_encoder=SentenceEncoder())
    pictures = write_pictures(replayed.trial.entries, memory, files.pictures, scene_from_above(config.sim.scene))
    tell(f"Pictures: {', '.join(picture.name for picture in pictures)} in {files.pictures}.")
    paths = {name: getattr(files, name) for name in ("walk", "truth", "memory", "config", "trial", "log", "pictures")}
    return Demo(outcome, replayed, paths)


def scene_from_above(scene: str) -> Backdrop:
    image, low_xy, high_xy = Renderer(World.load(scene)).top_view(60)
    return Backdrop(image, (float(low_xy[0]), float(low_xy[1])), (float(high_xy[0]), float(high_xy[1])))


class Narrator:
    """The operator of a demo: approves motion, never says stop, and passes on what the mission tells."""

    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def confirm(self, question: Question, timeout_s: float) -> Reply:  # noqa: ARG002 - nobody is waited for
        self._tell(f"{question.sentence} Yes.")
        return Reply(Approval.YES, how="demo")

    def stop_requested(self) -> StopRequest | None:
        return None

    def tell(self, sentence: str) -> None:
        self._tell(sentence)
