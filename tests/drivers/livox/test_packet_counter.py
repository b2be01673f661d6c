"""Loss counting: the wrap, the restart, the free run, duplicates and late packets."""

from __future__ import annotations

import pytest

from drivers.livox.packet_counter import LATE_RUN, PacketCounter
from drivers.livox.wire import DataPacket


def counted(numbers: list[int], stamps: list[int] | None = None) -> PacketCounter:
    counter = PacketCounter()
    for number, stamp in zip(numbers, stamps or range(len(numbers)), strict=True):
        counter.accept(DataPacket(1, 0, 96, number & 0xFFFF, stamp, 0, memoryview(b"")))
    return counter


@pytest.mark.parametrize(
    ("numbers", "lost"),
    [
        ([0, 1, 2, 3], 0),
        ([0, 1, 5], 3),
        ([65534, 65535, 0, 1], 0),
        ([65534, 2], 3),
        ([10, 10 + 1023], 1022),
        ([10, 10 + 1024], 0),
        ([206, 207, 0, 1], 0),
        ([206, 207, 3, 4], 0),
        ([206, 207, 0, 3], 2),
        (list(range(70_000)), 0),
        ([n for n in range(20_000) if n % 1000], 19),
    ],
    ids=[
        "none",
        "gap",
        "wrap",
        "gap over the wrap",
        "largest gap",
        "a jump is no loss",
        "restart",
        "late restart",
        "gap after a restart",
        "free run",
        "long run",
    ],
)
def test_lost_packets_are_counted_by_the_gap(numbers: list[int], lost: int) -> None:
    counter = counted(numbers)
    assert counter.lost == lost
    assert (counter.received, counter.out_of_order) == (len(numbers), 0)


def test_an_overtaken_packet_is_late_and_not_lost() -> None:
    counter = counted([5, 7, 6, 8], [50, 70, 60, 80])
    assert (counter.lost, counter.out_of_order, counter.received) == (0, 1, 4)


def test_an_overtaken_packet_at_the_wrap_is_late_and_not_lost() -> None:
    counter = counted([65534, 0, 65535, 1], [1, 3, 2, 4])
    assert (counter.lost, counter.out_of_order) == (0, 1)


def test_a_duplicate_is_refused_even_after_its_successor() -> None:
    counter = counted([1, 2, 1, 3, 3], [1, 2, 1, 3, 3])
    assert (counter.duplicates, counter.received, counter.lost) == (2, 3, 0)


def test_a_lidar_that_starts_anew_within_its_first_half_second_is_not_late_for_ever() -> None:
    first = list(range(900))
    counter = counted([*first, *range(900)], [n * 480_000 for n in first] + [n * 480_000 + 1 for n in range(900)])
    assert counter.newest is not None and counter.newest.udp_cnt == 899 and counter.newest.stamp_ns == 899 * 480_000 + 1
    assert counter.out_of_order == LATE_RUN
