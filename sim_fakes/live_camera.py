"""A rendered camera in wall time: it exposes by the clock and renders on a thread of its own."""

from __future__ import annotations

import queue
import threading

from openbelief.arrays import Array
from sim_fakes.robot import SimRobot
from sim_fakes.ros_publisher import Eyes, SimRosPublisher
from sim_fakes.sim_clock import SimClock


class LiveCamera:
    """An image takes 0.2 s to render, and /tf must not wait for it. What is exposed while one is rendered is lost, so a
    slow machine gives fewer images, each with the stamp and the pose of its exposure.
    """

    def __init__(self, clock: SimClock, robot: SimRobot, eyes: Eyes, topics: SimRosPublisher, rate_hz: float) -> None:
        self._clock, self._robot, self._eyes, self._topics = clock, robot, eyes, topics
        self._exposed: queue.Queue[tuple[int, Array]] = queue.Queue(maxsize=1)
        clock.every(1.0 / rate_hz, self._expose)

    def start(self) -> None:
        """Render until the process ends."""
        threading.Thread(target=self._render, name="camera", daemon=True).start()

    def _expose(self) -> None:
        try:
            self._exposed.put_nowait((self._clock.now_ns(), self._robot.T_map_camera()))
        except queue.Full:
            return  # still rendering

    def _render(self) -> None:
        while True:
            stamp_ns, T_map_camera = self._exposed.get()
            self._topics.send_image(stamp_ns, *self._eyes.image(T_map_camera, stamp_ns))
