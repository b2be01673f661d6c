"""A simulated D435i inside the real librealsense, fed by hand: no process, no time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import pytest

from drivers.clock import SimClock
from drivers.realsense.messages import ImagePair, RealSenseInfo, RealSenseSettings
from drivers.realsense.sdk import SdkStream
from sim_fakes.sensors.realsense_bus import TwinBus
from sim_fakes.sensors.realsense_software import PERIOD_NS, Images, RealSenseTwin, TwinSpec, box_images

START_NS = 1_700_000_000_000_000_000
WAIT_S = 0.1  # for librealsense's own threads


@dataclass
class Bench:
    """A twin, the stream that reads it, and the moment that it is at."""

    twin: RealSenseTwin
    stream: SdkStream
    info: RealSenseInfo
    stamp_ns: int = START_NS
    stamps: list[int] = field(default_factory=list)

    def moment(self) -> ImagePair | None:
        """The next images go in; what comes out."""
        self.stamp_ns += PERIOD_NS
        self.stamps.append(self.stamp_ns)
        self.twin.feed(self.stamp_ns)
        return self.stream.pair(WAIT_S)

    def settled(self) -> ImagePair:
        """The syncer lets the very first images out unpaired."""
        for _ in range(5):
            if (pair := self.moment()) is not None:
                return pair
        raise AssertionError("no image came out of librealsense")


@pytest.fixture
def make_bench() -> Iterator[Callable[..., Bench]]:
    with ExitStack() as opened:

        def make(
            spec: TwinSpec | None = None,
            images: Callable[[TwinSpec], Images] = box_images,
            settings: RealSenseSettings | None = None,
            device: Callable[[RealSenseTwin], Any] | None = None,
        ) -> Bench:
            spec = spec or TwinSpec()
            twin = RealSenseTwin(images(spec), spec)
            attached = TwinBus(twin, SimClock(START_NS)).devices()[0][1] if device is None else device(twin)
            stream = SdkStream(attached, settings or RealSenseSettings())
            opened.callback(stream.close)
            return Bench(twin, stream, stream.start())

        yield make


@pytest.fixture
def bench(make_bench: Callable[..., Bench]) -> Bench:
    return make_bench()
