"""A simulated robot in a process of its own, in wall time: what stands where a G1 with its bridge would stand.

    python -m sim_fakes.wire.robot_process --scene flat --listen tcp/127.0.0.1:7447

A Zenoh router, the keys and tokens of a bridge, Nav2, /tf, /map, camera with IMU and battery of a robot in a scene.
Its MID-360 is not a topic but a sensor: UDP packets, IMU and all, from --lidar-ip to --host-ip, which `openbelief
onboard` reads.

A line on standard input is the hand-held remote: "walk" walks the scene's mapping walk, "halt" stops the robot; the end
of the input, Ctrl-C or SIGTERM ends the process. One JSON line is printed for each event.
"""

from __future__ import annotations

import argparse
import json
import queue
import signal
import sys
import threading
from contextlib import ExitStack

import scipy.sparse.csgraph  # noqa: F401 - the planner's first path would load it while a question waits

from drivers.clock import SimClock, SystemClock
from drivers.ports import Clock, PortError
from drivers.ros.zenoh_link import open_router
from drivers.topics import LIDAR_IMU
from openbelief.arrays import Array
from sim_fakes.sensors.eyes import RenderedEyes
from sim_fakes.sensors.live_camera import LiveCamera
from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator
from sim_fakes.wire.nav2_server import SimNav2Server
from sim_fakes.wire.ros_publisher import SimRosPublisher
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.robot import SimRobot
from sim_fakes.world.scene import SceneError
from sim_fakes.world.walk import Walker
from sim_fakes.world.world import World

TICK_S = 0.01
CAMERA_RATE_HZ = 2.5  # an image takes 0.2 s of a core
CHARGE = 0.8


class RealTimePacer:
    """Lets a simulated clock pass in step with a real one; after a pause it catches up."""

    def __init__(self, clock: SimClock, wall: Clock) -> None:
        self._clock, self._wall = clock, wall

    def step(self) -> None:
        """To the wall clock's now; a wall clock that was set back is waited for."""
        self._clock.sleep((self._wall.now_ns() - self._clock.now_ns()) / 1e9)


class Remote:
    """The lines of a stream as a robot's remote control; `step` obeys them, and is False once the stream has ended."""

    def __init__(self, robot: SimRobot, clock: SimClock, world: World) -> None:
        self._robot, self._clock, self._world = robot, clock, world
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._walker: Walker | None = None

    def listen(self) -> None:
        """To standard input, on a thread of its own."""
        threading.Thread(target=self._listen, daemon=True).start()

    def step(self) -> bool:
        while not self._lines.empty():
            line = self._lines.get()
            if line is None:
                return False
            self.obey(line.strip())
        if self._walker is not None:
            self._walk(self._walker)
        return True

    def _walk(self, walker: Walker) -> None:
        """An obstacle on the way ends the walk, and nothing else: the robot stands, and its wires go on."""
        try:
            if walker.step():
                return
            say({"walk": "ended"})
        except RuntimeError as error:
            self._robot.halt()
            say({"walk": "blocked", "because": str(error)})
        self._walker = None

    def obey(self, word: str) -> None:
        self._walker = None
        self._robot.halt()
        if word == "walk":
            self._walker = Walker(self._robot, self._clock, self._world.walk)
            say({"walk": "begun"})
        else:
            say({"halted": word or "halt"})

    def _listen(self) -> None:
        for line in sys.stdin:
            self._lines.put(line)
        self._lines.put(None)


def say(event: dict[str, object]) -> None:
    print(json.dumps(event), flush=True)


def emulated_lidar(robot: SimRobot, renderer: Renderer, lidar_ip: str, host_ip: str, wall: Clock) -> LivoxEmulator:
    """A MID-360 on the robot's head, which sends whether or not anybody listens."""

    def ranges(rays: Array, _uptime_ns: int) -> Array:
        return renderer.scan(robot.T_map_lidar(), rays)

    return LivoxEmulator(EmulatorSettings(lidar_ip=lidar_ip, host_ip=host_ip), clock=wall, ranges=ranges)


def run(options: argparse.Namespace, stop: threading.Event) -> None:
    """Until `stop` or the end of the input."""
    wall = SystemClock()
    world, clock = World.load(options.scene), SimClock(wall.now_ns())
    robot, renderer = SimRobot(world, clock, world.start_pose), Renderer(world)
    eyes, grid = RenderedEyes(renderer, robot.intrinsics, seed=options.seed), world.occupancy_grid()
    with ExitStack() as opened:
        endpoint = opened.enter_context(open_router(options.listen))
        bridge = opened.enter_context(SimBridge(endpoint))
        SimNav2Server(bridge, clock, robot, grid).start()
        topics = SimRosPublisher(bridge, clock, robot, grid)
        topics.start()
        topics.faults.muted.add(LIDAR_IMU.name)  # its lidar is a sensor, with an IMU of its own
        topics.start_imu()
        topics.start_battery(CHARGE)
        opened.enter_context(LiveCamera(clock, robot, eyes, topics, CAMERA_RATE_HZ))
        if options.lidar == "topic":
            topics.start_lidar(eyes)
        else:
            opened.enter_context(emulated_lidar(robot, renderer, options.lidar_ip, options.host_ip, wall))
        keeper, remote = RealTimePacer(clock, wall), Remote(robot, clock, world)
        remote.listen()
        say({"endpoint": endpoint, "scene": world.name})
        while not stop.wait(TICK_S) and remote.step():
            keeper.step()


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="robot_process", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="flat", help="a scene file, or a built-in one (flat)")
    parser.add_argument("--seed", type=int, default=1, help="of the sensors' noise")
    parser.add_argument("--listen", metavar="ENDPOINT", help="like tcp/127.0.0.1:7447 (default: any free port)")
    parser.add_argument("--lidar", choices=["sensor", "topic"], default="sensor", help="UDP packets, or a ROS topic")
    parser.add_argument("--lidar-ip", default=EmulatorSettings.lidar_ip, help="a loopback address (default 127.0.0.2)")
    parser.add_argument("--host-ip", default=EmulatorSettings.host_ip, help="where onboard listens (default 127.0.0.1)")
    stop = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stop.set())
    options = parser.parse_args()
    try:
        run(options, stop)
    except PortError as error:
        print(f"robot_process: {error}", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"robot_process: no lidar at {options.lidar_ip}: {error.strerror} (--lidar-ip)", file=sys.stderr)
        return 1
    except (SceneError, RuntimeError) as error:
        print(f"robot_process: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
