"""The thread that keeps the camera's process alive by the rules of restarts.py, or kills it."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

from drivers.ports import Clock, LinkLost
from drivers.realsense.messages import CameraOpened, FrameReady, ProcessEnded, ProcessHeartbeat, StopProcess
from drivers.realsense.restarts import ProcessPhase, RestartAction, RestartPolicy

LISTEN_S = 0.02
STOP_S = 1.0  # for a clean stop, then it is killed
REAP_S = 2.0  # a killed process that is still there hangs in the kernel; we go on without it

Spawn = Callable[[bool], tuple[SpawnProcess, Connection]]


class ProcessSupervisor:
    """`spawn(reset)` starts a process; `hear(message)` gets what it says, in the keeper's thread.

    `order` may be called from any thread and never waits. `answered` is set when the first attempt has succeeded or
    failed.
    """

    def __init__(self, clock: Clock, watchdog: RestartPolicy, spawn: Spawn, hear: Callable[[Any], None]) -> None:
        self._clock, self._watchdog, self._spawn, self._hear = clock, watchdog, spawn, hear
        self._orders: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._process: SpawnProcess | None = None
        self._connection: Connection | None = None
        self._stop, self.answered = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._keep_alive, name="realsense-keeper", daemon=True)
        self._failure: BaseException | None = None
        self.killed = 0

    def start(self) -> None:
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    def order(self, order: Any) -> None:
        self._orders.put(order)

    def raise_failure(self) -> None:
        """Raises LinkLost once nothing more is tried."""
        if self._failure is not None:
            raise LinkLost(f"The camera driver has stopped: {self._failure}.") from self._failure
        if self._watchdog.phase is ProcessPhase.FAILED:
            raise LinkLost(self._watchdog.verdict())

    def _keep_alive(self) -> None:
        try:
            while not self._stop.is_set():
                self._act(self._watchdog.due(self._clock.now_ns()))
                self._converse()
        except BaseException as failure:  # noqa: BLE001 - handed to whoever reads next, by raise_failure
            self._failure = failure
        finally:
            self._end_process()
            self.answered.set()

    def _act(self, action: RestartAction) -> None:
        if action is RestartAction.START:
            self._orders = queue.SimpleQueue()  # those were for the last one
            self._process, self._connection = self._spawn(self._watchdog.failures > 0)
            self._watchdog.started(self._clock.now_ns())
        elif action is RestartAction.STOP:
            self._end(self._watchdog.reason)

    def _converse(self) -> None:
        """Pass on the orders, then hear one message; waits LISTEN_S for it."""
        connection = self._connection
        if connection is None:
            self._stop.wait(LISTEN_S)
            return
        try:
            while not self._orders.empty():
                connection.send(self._orders.get())
            if connection.poll(LISTEN_S):
                self._take(connection.recv())
        except (EOFError, OSError):
            self._end(self._cause_of_death())

    def _take(self, message: Any) -> None:
        now_ns = self._clock.now_ns()
        if isinstance(message, ProcessEnded):
            self._end(message.reason, permanent=message.permanent)
            return
        if isinstance(message, CameraOpened):
            self._watchdog.opened(now_ns)
        elif isinstance(message, ProcessHeartbeat):
            self._watchdog.alive(now_ns, message.counts.frozen)
        elif isinstance(message, FrameReady):
            self._watchdog.image(now_ns)
        self._hear(message)
        if isinstance(message, CameraOpened):
            self.answered.set()

    def _cause_of_death(self) -> str:
        if self._process is None:
            return "its process ended"
        self._process.join(REAP_S)
        return f"its process died (exit code {self._process.exitcode})"

    def _end(self, reason: str, *, permanent: bool = False) -> None:
        self._end_process()
        self._watchdog.ended(self._clock.now_ns(), reason, permanent=permanent)
        self.answered.set()

    def _end_process(self) -> None:
        """Ask, wait, kill."""
        process, connection = self._process, self._connection
        self._process = self._connection = None
        if process is None or connection is None:
            return
        with suppress(OSError):  # already gone
            connection.send(StopProcess())
        process.join(STOP_S)
        if process.is_alive():
            self.killed += 1
            process.kill()
            process.join(REAP_S)
        connection.close()
