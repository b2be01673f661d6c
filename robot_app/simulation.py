"""The robot of a scene file, behind the same wires as the real one."""

from __future__ import annotations

from dataclasses import dataclass

from drivers.clock import SimClock
from sim_fakes.sensors.eyes import RenderedEyes
from sim_fakes.wire.ros_graph import RosGraph
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.robot import SimRobot
from sim_fakes.world.world import World

START_NS = 1_800_000_000 * 10**9  # a simulated robot always wakes at the same moment, so that runs compare


@dataclass(frozen=True)
class Simulation:
    """A scene, the clock that moves it, the robot in it, and its end of the wire (a context manager)."""

    world: World
    clock: SimClock
    robot: SimRobot
    graph: RosGraph


def simulation(scene: str, *, seed: int, start_ns: int = START_NS, camera_rate_hz: float | None = 1.0) -> Simulation:
    """Raises SceneError where the scene file cannot be used."""
    world, clock = World.load(scene), SimClock(start_ns)
    robot = SimRobot(world, clock, world.start_pose)
    eyes = RenderedEyes(Renderer(world), robot.intrinsics, seed=seed)
    graph = RosGraph(clock, robot, world.occupancy_grid(), eyes, camera_rate_hz=camera_rate_hz)
    return Simulation(world, clock, robot, graph)
