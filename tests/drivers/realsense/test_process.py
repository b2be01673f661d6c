"""What crosses between the camera's process and ours, without the process: slots on loan, orders, signs of life."""

from __future__ import annotations

import multiprocessing
import queue
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from drivers.realsense.messages import FrameReady, ProcessHeartbeat, SlotFree, StandStill, StopProcess
from drivers.realsense.process import SLOTS, FrameServer, Slots
from sim_fakes.sensors.realsense_faults import Fault
from sim_fakes.sensors.realsense_software import PERIOD_NS

COLOR_SIZE = (848, 480)


@dataclass
class Counter:
    """A desk, the orders to it, and what it says."""

    bench: Any
    desk: FrameServer
    slots: Slots
    heard: Any
    orders: queue.SimpleQueue

    def moment(self) -> list[Any]:
        """Messages of one more image."""
        self.bench.stamp_ns += PERIOD_NS
        self.bench.twin.feed(self.bench.stamp_ns)
        assert self.desk.obey(self.orders)
        self.desk.serve()
        messages = []
        while self.heard.poll():
            messages.append(self.heard.recv())
        return messages

    def images(self, count: int) -> list[FrameReady]:
        return [message for _ in range(count) for message in self.moment() if isinstance(message, FrameReady)]


@pytest.fixture
def make_counter(make_bench) -> Callable[..., Counter]:
    def make(**options: Any) -> Counter:
        heard, said = multiprocessing.Pipe()
        slots = Slots(bytearray(Slots.size(COLOR_SIZE)), COLOR_SIZE)
        bench = make_bench(**options)
        bench.settled()
        return Counter(bench, FrameServer(said, slots, bench.stream), slots, heard, queue.SimpleQueue())

    return make


def test_a_reader_that_stalls_costs_images_and_no_memory(make_counter) -> None:
    counter = make_counter()
    images = counter.images(SLOTS + 3)
    assert len({image.slot for image in images}) == len(images) == SLOTS
    assert counter.moment()[-1].counts.no_slot == 4
    counter.orders.put(SlotFree(images[2].slot))
    assert [image.slot for image in counter.images(1)] == [images[2].slot]


def test_a_slot_holds_the_image_until_it_is_handed_back(make_counter) -> None:
    counter = make_counter()
    [image] = counter.images(1)
    color = counter.slots.color[image.slot].copy()
    counter.images(SLOTS)
    assert np.array_equal(color, counter.slots.color[image.slot])


def test_every_poll_is_a_sign_of_life_with_the_imu(make_counter) -> None:
    counter = make_counter()
    assert any(beat.motions for beat in counter.moment() if isinstance(beat, ProcessHeartbeat))
    counter.bench.twin.state.fault = Fault.SILENT
    messages = counter.moment() + counter.moment()
    assert [type(message) for message in messages] == [ProcessHeartbeat, ProcessHeartbeat]


def test_orders_are_obeyed(make_counter) -> None:
    rng = np.random.default_rng(5)
    color = np.full((480, 848, 3), 120, np.uint8)

    def noisy(_spec: Any) -> Any:
        return lambda _stamp_ns: (color, (2.0 + rng.normal(0, 0.01, (480, 848))).astype(np.float32))

    counter = make_counter(images=noisy)

    def spread() -> float:
        for image in counter.images(8):
            depth = counter.slots.depth[image.slot][200:280, 300:500].astype(float)
            counter.orders.put(SlotFree(image.slot))
        return float(depth.std())

    walking = spread()
    counter.orders.put(StandStill(True))
    assert spread() < 0.8 * walking
    counter.orders.put(StopProcess())
    assert not counter.desk.obey(counter.orders)
