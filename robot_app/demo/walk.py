"""The mapping walk of a simulated robot, recorded over the wire as a real one would be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from logs.record.queued import QueuedRecorder
from logs.record.recorder import McapRecorder
from logs.record.tap import TopicTap
from robot_app.app import open_robot
from robot_app.config import Config
from sim_fakes.world.walk import keyframes

FRAME_EVERY_M, FRAME_EVERY_DEG = 0.7, 30.0


def record_walk(config: Config, path: Path, on_frame: Callable[[int], None]) -> int:
    """Walk the scene's waypoints and record every topic to `path`; a picture where the robot moved or turned enough.

    Returns the number of pictures. Raises RuntimeError where the walk is blocked.
    """
    only_when_asked = config.model_copy(update={"sim": config.sim.model_copy(update={"camera_rate_hz": None})})
    with open_robot(only_when_asked) as robot:
        simulation, wiring = robot.wiring.simulation, robot.wiring
        if simulation is None:
            raise ValueError("Only a simulated robot walks by itself.")
        with McapRecorder(path, robot.clock) as recorder, QueuedRecorder(recorder, robot.clock) as queue:
            TopicTap(wiring.wires["sim"].link, queue).start()
            frames = 0
            waypoints = simulation.world.walk
            for _ in keyframes(
                simulation.robot, simulation.clock, waypoints, spacing_m=FRAME_EVERY_M, turn_deg=FRAME_EVERY_DEG
            ):
                simulation.graph.topics.look()
                queue.drain()
                frames += 1
                on_frame(frames)
            simulation.clock.sleep(0.2)  # the transforms around the last picture
            return frames
