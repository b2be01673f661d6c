"""The emulated lidar answers as the real one, and its faults are the ones ordered."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.livox import control_wire
from drivers.livox.control_wire import CommandId, ControlFrame, Found
from drivers.livox.keys import Key
from sim_fakes.sensors.livox_answers import LivoxAnswers
from sim_fakes.sensors.livox_faults import LivoxFaults
from sim_fakes.sensors.livox_scan import directions, open_room
from sim_fakes.sensors.livox_stream import LivoxStream
from support import livox_host

FOUND = Found(35, "SN360S", "127.0.0.2", 56100)
SECOND = 1_000_000_000


@pytest.fixture
def stream() -> LivoxStream:
    return LivoxStream(open_room, FOUND)


@pytest.fixture
def answers(stream: LivoxStream) -> LivoxAnswers:
    return LivoxAnswers(stream, FOUND, {})


def test_search_is_answered_with_who_it_is(answers: LivoxAnswers) -> None:
    ack = answers.answer(livox_host.search_request(77))
    assert ack.seq == 77
    assert ack.is_ack
    assert livox_host.parse_search_ack(ack.data) == FOUND


@pytest.mark.parametrize(
    ("values", "answer"),
    [
        ({Key.WORK_MODE: b"\x02"}, (0, 0)),
        ({Key.STATE: b"\x01"}, (0x22, Key.STATE)),
        ({0x0777: b"\x01"}, (0x20, 0x0777)),
        ({Key.WORK_MODE: b"\x01\x01"}, (0x23, Key.WORK_MODE)),
        ({Key.DATA_TYPE: b"\x07"}, (3, Key.DATA_TYPE)),
    ],
)
def test_a_set_is_answered_with_the_real_lidars_code(answers: LivoxAnswers, values, answer) -> None:
    ack = answers.answer(control_wire.set_request(1, values))
    assert control_wire.parse_set_ack(ack.data) == answer
    assert answers.written == (values if answer[0] == 0 else {})


def test_a_wrong_number_of_keys_is_answered_so(answers: LivoxAnswers) -> None:
    ack = answers.answer(ControlFrame(1, CommandId.SET, b"\x05\0\0\0"))
    assert control_wire.parse_set_ack(ack.data)[0] == 0x24


def test_get_reads_back_what_was_set(answers: LivoxAnswers) -> None:
    answers.answer(control_wire.set_request(1, {Key.PATTERN: b"\x02"}))
    ack = answers.answer(livox_host.get_request(2, [Key.PATTERN, Key.STATE]))
    assert livox_host.parse_get_ack(ack.data) == (0, {Key.PATTERN: b"\x02", Key.STATE: b"\x01"})


def test_upgrade_commands_are_not_answered(answers: LivoxAnswers) -> None:
    assert answers.answer(ControlFrame(1, 0x0400)) is None


def test_an_idle_lidar_measures_nothing_and_still_reports(stream: LivoxStream, answers: LivoxAnswers) -> None:
    answers.answer(control_wire.set_request(1, {Key.WORK_MODE: b"\x02"}))
    assert {outgoing.channel for outgoing in stream.due(SECOND)} == {"search", "push"}


def test_a_second_holds_the_real_lidars_rates(stream: LivoxStream) -> None:
    stream.due(10 * SECOND - 1)
    assert stream.sent == {"points": 20_834, "imu": 2000, "push": 10, "search": 10}


def test_directions_are_unit_and_inside_the_field_of_view() -> None:
    rays = directions(12_345, 20_000)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=1), 1.0)
    elevation = np.degrees(np.arcsin(rays[:, 2]))
    assert -7.01 < elevation.min() < -6.5
    assert 51.5 < elevation.max() < 52.01


def test_the_same_seed_makes_the_same_faults() -> None:
    def troubled() -> list:
        faults = LivoxFaults(seed=4, drop=0.1, duplicate=0.1, reorder=0.1, flip=0.1, truncate=0.1, wrong_version=0.1)
        return faults.apply(LivoxStream(open_room, FOUND).due(SECOND // 10))

    assert troubled() == troubled()
    assert troubled() != LivoxStream(open_room, FOUND).due(SECOND // 10)


def test_silence_is_silence(stream: LivoxStream) -> None:
    assert LivoxFaults(silent=True).apply(stream.due(SECOND)) == []


def test_the_simulated_flat_plugs_in_as_what_the_lidar_sees() -> None:
    from drivers.livox.intake import DatagramDecoder
    from sim_fakes.world.renderer import Renderer
    from sim_fakes.world.world import World

    world = World.load("flat")
    renderer = Renderer(world)
    T_map_lidar = np.diag([1.0, -1.0, -1.0, 1.0])  # upside down, as on a G1
    T_map_lidar[:3, 3] = [*np.mean(world.rooms[0].polygon, axis=0), 1.25]
    flat = LivoxStream(lambda rays, uptime_ns: renderer.scan(T_map_lidar, rays), FOUND)
    intake = DatagramDecoder("lidar")
    for channel, datagram in flat.due(SECOND // 5):
        if channel == "points":
            intake.take_points(datagram, 0)
    points = intake.latest.points
    ranges = np.linalg.norm(points, axis=1)
    agree = np.isclose(ranges, renderer.scan(T_map_lidar, points / ranges[:, None]), rtol=0, atol=0.01)
    assert agree.mean() > 0.998  # a rounded ray may pass an edge that the first one hit
    heights = (points @ T_map_lidar[:3, :3].T + T_map_lidar[:3, 3])[:, 2]
    assert -0.01 < heights.min() < 0.01
