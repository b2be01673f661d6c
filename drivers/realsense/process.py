"""The process in which librealsense lives, and may hang or crash, and what opens the camera there.

Images cross in slots of shared memory, on loan until handed back; all else is small messages on a pipe. So memory is
bounded, and a reader that stalls costs images, counted as `no_slot`, never a wait inside the SDK's callbacks.
"""

from __future__ import annotations

import os
import platform
import queue
import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from drivers.clock import SystemClock
from drivers.realsense.bus import open_attached
from drivers.realsense.gate import DuplicateFilter
from drivers.realsense.messages import (
    CameraGone,
    CameraOpened,
    CameraRefused,
    FrameReady,
    ImagePair,
    ProcessEnded,
    ProcessHeartbeat,
    RealSenseSettings,
    SlotFree,
    StandStill,
    StopProcess,
    StreamCounts,
)
from openbelief.arrays import Array

if TYPE_CHECKING:
    from drivers.realsense.sdk import SdkStream

SLOTS = 4
POLL_S = 0.1
ORPHANED = 3  # exit code


class OpenDevice(Protocol):
    """Gives an rs.device, in the camera's process; picklable. reset: the attempt before failed."""

    def __call__(self, *, reset: bool) -> Any: ...


def attached(serial: str | None, *, reset: bool) -> Any:
    """The camera on this machine's USB."""
    from drivers.realsense.sdk import UsbBus

    return open_attached(UsbBus(), serial, SystemClock(), reset=reset)


def recorded(path: Path, *, reset: bool) -> Any:  # noqa: ARG001 - a file has no hardware to reset
    """A .db3 or .bag that librealsense recorded, played once."""
    from drivers.realsense.sdk import open_recording

    return open_recording(path)


class Slots:
    """SLOTS images in one shared buffer. Both processes make one of these around the same bytes."""

    def __init__(self, buffer: Any, color_size: tuple[int, int]) -> None:
        width, height = color_size
        pixels = width * height
        whole = np.frombuffer(buffer, np.uint8).reshape(SLOTS, pixels * 5)
        self.color = [row[: pixels * 3].reshape(height, width, 3) for row in whole]
        self.depth = [row[pixels * 3 :].view(np.uint16).reshape(height, width) for row in whole]

    @staticmethod
    def size(color_size: tuple[int, int]) -> int:
        return SLOTS * color_size[0] * color_size[1] * 5

    def put(self, slot: int, color: Array, depth: Array) -> None:
        self.color[slot][:], self.depth[slot][:] = color, depth


def camera_process(
    connection: Connection, buffer: Any, settings: RealSenseSettings, open_device: OpenDevice, reset: bool
) -> None:
    """The process's whole life: open, stream until told to stop or until it fails, say why."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the mission, which stops us
    orders: queue.SimpleQueue[Any] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(connection, orders.put), daemon=True).start()
    try:
        _stream(connection, Slots(buffer, settings.color_size), settings, open_device, orders, reset)
        connection.send(ProcessEnded("it was told to stop", permanent=False))
    except CameraGone as gone:
        connection.send(ProcessEnded(str(gone), permanent=isinstance(gone, CameraRefused)))
    except ImportError as error:
        said = f"librealsense cannot be loaded ({error}): {_how_to_get_it()}."
        connection.send(ProcessEnded(said, permanent=True))


def _how_to_get_it() -> str:
    """pyrealsense2 has wheels of this Python for x86_64 alone."""
    if platform.machine() == "x86_64":
        return "run `make setup`"
    return (
        "there is no wheel for this machine: take the RealSense's ROS node, or build its Python binding (docs/robot.md)"
    )


def _listen(connection: Connection, order: Callable[[Any], None]) -> None:
    """Orders as they come. When the mission's process is gone, so are we, even from inside a hanging call."""
    try:
        while True:
            order(connection.recv())
    except (EOFError, OSError):
        os._exit(ORPHANED)


def _stream(
    connection: Connection,
    slots: Slots,
    settings: RealSenseSettings,
    open_device: OpenDevice,
    orders: queue.SimpleQueue[Any],
    reset: bool,
) -> None:
    device = open_device(reset=reset)
    from drivers.realsense.sdk import SdkStream

    stream = SdkStream(device, settings)
    try:
        connection.send(CameraOpened(stream.start()))
        desk = FrameServer(connection, slots, stream)
        while desk.obey(orders):
            desk.serve()
    finally:
        stream.close()


class FrameServer:
    """Hands over one image at a time."""

    def __init__(self, connection: Connection, slots: Slots, stream: SdkStream) -> None:
        self._connection, self._slots, self._stream = connection, slots, stream
        self._gate = DuplicateFilter()
        self._free = list(range(SLOTS))
        self._no_slot = 0

    def obey(self, orders: queue.SimpleQueue[Any]) -> bool:
        """Whether to go on."""
        while not orders.empty():
            order = orders.get()
            if isinstance(order, StopProcess):
                return False
            if isinstance(order, SlotFree):
                self._free.append(order.slot)
            elif isinstance(order, StandStill):
                self._stream.stand_still(order.still)
        return True

    def serve(self) -> None:
        """One poll: the image, if there is news, then the sign of life with the IMU's samples."""
        pair = self._stream.pair(POLL_S)
        if pair is not None and self._gate.admit(pair):
            self._hand_over(pair)
        gate = self._gate
        counts = StreamCounts(gate.frames, gate.lost, self._stream.unpaired, gate.frozen, self._no_slot)
        self._connection.send(ProcessHeartbeat(counts, tuple(self._stream.motions())))

    def _hand_over(self, pair: ImagePair) -> None:
        if not self._free:
            self._no_slot += 1
            return
        slot = self._free.pop()
        self._slots.put(slot, pair.color, pair.depth)
        self._connection.send(
            FrameReady(
                slot,
                pair.device_stamp_ns,
                pair.depth_device_stamp_ns,
                pair.color_number,
                pair.depth_number,
                pair.domain,
            )
        )
