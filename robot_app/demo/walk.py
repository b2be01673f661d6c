"""The mapping walk of a simulated robot, recorded over the wire as a real one would be."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from drivers.clock import SimClock
from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from logs.record.tap import TopicTap
from openbelief.pose import Pose2
from robot_app.app import open_robot
from robot_app.config import Config
from sim_fakes.world.robot import SimRobot
from sim_fakes.world.walk import keyframes
from sim_fakes.world.world import World

FRAME_EVERY_M, FRAME_EVERY_DEG = 0.7, 30.0


def record_walk(config: Config, path: Path, on_frame: Callable[[int, int], None]) -> int:
    """Walk the scene's waypoints and record every topic to `path`; a picture where the robot moved or turned enough.

    on_frame: hears how many pictures there are, and how many there will be. Returns their number. Raises RuntimeError
    where the walk is blocked.
    """
    only_when_asked = config.model_copy(update={"sim": config.sim.model_copy(update={"camera_rate_hz": None})})
    with open_robot(only_when_asked) as robot:
        simulation, wiring = robot.wiring.simulation, robot.wiring
        if simulation is None:
            raise ValueError("Only a simulated robot walks by itself.")
        with McapRecorder(path, robot.clock) as recorder, QueuedRecorder(recorder, robot.clock) as queue:
            TopicTap(wiring.wires["sim"].link, queue).start()
            frames, expected = 0, _pictures(simulation.world)
            for _ in _walk(simulation.robot, simulation.clock, simulation.world):
                simulation.graph.topics.look()
                queue.drain()
                frames += 1
                on_frame(frames, max(expected, frames))
            simulation.clock.sleep(0.2)  # the transforms around the last picture
            on_frame(frames, frames)
            return frames


def _walk(robot: SimRobot, clock: SimClock, world: World) -> Iterator[Pose2]:
    return keyframes(robot, clock, world.walk, spacing_m=FRAME_EVERY_M, turn_deg=FRAME_EVERY_DEG)


def _pictures(world: World) -> int:
    """How many a walk takes: it is walked once by a robot alone, without sensors or wires."""
    clock = SimClock(0)
    return sum(1 for _ in _walk(SimRobot(world, clock, world.start_pose), clock, world))
