"""A rendered camera in wall time: it exposes by the clock and renders on a thread of its own."""

from __future__ import annotations

import queue
import threading

from drivers.clock import SimClock
from openbelief.arrays import Array
from openbelief.lifetime import Lifetime
from sim_fakes.wire.ros_publisher import Eyes, SimRosPublisher
from sim_fakes.world.robot import SimRobot

LOOK_S = 0.1  # how often the end is looked for while nothing is exposed


class LiveCamera(Lifetime):
    """An image takes 0.2 s to render, and /tf must not wait for it. What is exposed while one is rendered is lost, so a
    slow machine gives fewer images, each with the stamp and the pose of its exposure. Works inside `with`.
    """

    def __init__(self, clock: SimClock, robot: SimRobot, eyes: Eyes, topics: SimRosPublisher, rate_hz: float) -> None:
        self._clock, self._robot, self._eyes, self._topics = clock, robot, eyes, topics
        self._exposed: queue.Queue[tuple[int, Array]] = queue.Queue(maxsize=1)
        self._rate_hz = rate_hz
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="camera", daemon=True)

    def start(self) -> None:
        self._thread.start()
        self._clock.every(1.0 / self._rate_hz, self._expose)

    def close(self) -> None:
        """Waits for the image under way: Open3D ends a process with status 1 that leaves in the middle of one."""
        self._ended.set()
        self._thread.join()

    def _expose(self) -> None:
        try:
            self._exposed.put_nowait((self._clock.now_ns(), self._robot.T_map_camera()))
        except queue.Full:
            return  # still rendering

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                stamp_ns, T_map_camera = self._exposed.get(timeout=LOOK_S)
            except queue.Empty:
                continue
            self._topics.send_image(stamp_ns, *self._eyes.image(T_map_camera, stamp_ns))
