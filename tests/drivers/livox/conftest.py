"""An emulated lidar's datagrams without sockets, and a clock that moves by hand."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest

from drivers.livox.control_wire import Found
from drivers.livox.intake import DatagramDecoder
from sim_fakes.sensors.livox_scan import open_room
from sim_fakes.sensors.livox_stream import LivoxStream, Outgoing
from support.clocks import HandClock

ZERO = 1_700_000_000_000_000_000


@pytest.fixture
def clock() -> HandClock:
    return HandClock(ZERO)


@pytest.fixture
def stream() -> Callable[..., LivoxStream]:
    return lambda ranges=open_room, **options: LivoxStream(ranges, Found(9, "SN1", "127.0.0.2", 56100), **options)


@pytest.fixture
def take() -> Callable[[DatagramDecoder, Iterable[Outgoing], int], None]:
    def _take(intake: DatagramDecoder, outgoing: Iterable[Outgoing], arrival_ns: int) -> None:
        doors = {"points": intake.take_points, "imu": intake.take_imu, "push": intake.take_push}
        for channel, datagram in outgoing:
            if channel in doors:
                doors[channel](datagram, arrival_ns)

    return _take
