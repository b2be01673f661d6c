"""The driver against the emulated lidar over loopback sockets. The clock moves by hand; only sockets are waited for."""

from __future__ import annotations

import socket
import threading
from dataclasses import replace

import numpy as np
import pytest

from drivers.livox import control_wire
from drivers.livox.control_wire import CommandId
from drivers.livox.driver import LivoxLidar
from drivers.livox.keys import Key
from drivers.livox.settings import LivoxPorts, LivoxSettings
from drivers.livox.takeover import LivoxControl
from drivers.ports import Lidar, LinkLost, PortError, StaleData
from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator
from sim_fakes.sensors.livox_faults import LivoxFaults
from support.waiting import until

DEADLINE_S = 5.0
STEP_NS = 20_000_000
LIDAR_PORTS = dict.fromkeys(("search_port", "command_port", "push_port", "points_port", "imu_port"), 0)
SETTINGS = LivoxSettings(lidar_ip="127.0.0.2", host_ip="127.0.0.1")
SILENT_PORT = 9  # discard: nobody listens there


def ports(**taken: int) -> LivoxPorts:
    """Free ones of this machine."""
    return LivoxPorts(**({"points": 0, "imu": 0, "push": 0, "command": 0} | taken))


class Bench:
    """One driver and one emulated lidar that sends to it."""

    def __init__(self, lidar: LivoxLidar, emulator: LivoxEmulator, clock) -> None:
        self.lidar, self.emulator, self.clock = lidar, emulator, clock

    def run(self, seconds: float) -> None:
        """Send in small steps, each taken in before the next, so that no receive buffer is too small."""
        end_ns = self.clock.ns + round(seconds * 1e9)
        while self.clock.ns < end_ns:
            self.clock.ns += STEP_NS
            self.emulator.advance_to(self.clock.ns)
            until(self._all_arrived)

    def _all_arrived(self) -> bool:
        health, sent = self.lidar.health(), self.emulator.stream.sent
        return self.emulator.faults.silent or health.packets + health.imu_packets == sent["points"] + sent["imu"]


@pytest.fixture
def emulator(clock):
    """An emulated lidar whose streams go nowhere yet."""
    nowhere = dict.fromkeys(("host_search_port", "host_push_port", "host_points_port", "host_imu_port"), SILENT_PORT)
    emulator = LivoxEmulator(EmulatorSettings(**LIDAR_PORTS, **nowhere), clock=clock, faults=LivoxFaults())
    emulator.open()
    yield emulator
    emulator.close()


@pytest.fixture
def bench(clock, emulator: LivoxEmulator):
    """The lidar sends to the driver, as one that was set up before does."""
    with LivoxLidar(SETTINGS, clock, ports(lidar_command=emulator.ports["command"])) as lidar:
        emulator.answers.destinations |= {name: ("127.0.0.1", port) for name, port in lidar.ports.items()}
        yield Bench(lidar, emulator, clock)


@pytest.fixture
def answering(clock, emulator: LivoxEmulator):
    """The lidar answers control frames by itself; its time stands still."""
    stop = threading.Event()

    def answer() -> None:
        while not stop.wait(0.002):
            emulator.advance_to(clock.ns)

    thread = threading.Thread(target=answer)
    thread.start()
    yield emulator
    stop.set()
    thread.join()


def test_the_cloud_is_the_room_the_lidar_stands_in(bench: Bench) -> None:
    assert isinstance(bench.lidar, Lidar)
    bench.run(0.3)
    cloud = bench.lidar.latest(0.3)
    x, y, z = np.abs(cloud.points).T
    assert (np.minimum(np.minimum(np.abs(x - 3), np.abs(y - 2)), np.abs(z - 1.2)) < 0.01).all()
    assert cloud.frame_id == "livox_frame"
    assert abs(cloud.end_ns - bench.clock.ns) < 200_000_000


def test_a_recorder_gets_every_cloud_and_sample_once(bench: Bench) -> None:
    bench.run(0.5)
    first, samples = bench.lidar.take_clouds(), bench.lidar.take_imu()
    bench.run(0.5)
    second = bench.lidar.take_clouds()
    assert [cloud.sequence for cloud in first + second] == list(range(len(first) + len(second)))
    assert len(first) + len(second) >= 9
    assert len(samples) == 101


def test_a_passive_driver_sends_nothing(bench: Bench) -> None:
    bench.run(1.2)
    bench.lidar.latest(1.0)
    bench.lidar.health()
    bench.lidar.close()
    bench.emulator.advance_to(bench.clock.ns)
    assert list(bench.emulator.received) == []
    assert bench.emulator.stream.sent["search"] == 2


def test_before_the_first_cloud_the_port_is_stale_and_says_what_to_check(clock) -> None:
    with (
        LivoxLidar(SETTINGS, clock, ports()) as lidar,
        pytest.raises(StaleData, match=r"127\.0\.0\.2.*sends to this host"),
    ):
        lidar.latest(10.0)


def test_a_silent_lidar_goes_stale(bench: Bench) -> None:
    bench.run(0.3)
    bench.lidar.latest(0.3)
    bench.emulator.faults.silent = True
    bench.run(1.0)
    with pytest.raises(StaleData, match="s old"):
        bench.lidar.latest(0.5)
    assert bench.lidar.latest(2.0).sequence >= 1


def test_health_tells_the_state_and_its_codes_in_words(bench: Bench) -> None:
    bench.emulator.stream.health = (0x01040002, 0x04010003)
    bench.run(0.1)
    until(lambda: bench.lidar.health().state is not None)
    state = bench.lidar.health().state
    assert state.state == "sampling"
    assert [code.level for code in state.health] == ["warning", "error"]


def test_the_granted_receive_buffer_is_reported(bench: Bench) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plain:
        default = plain.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    assert bench.lidar.health().receive_buffer_bytes >= default


def test_datagrams_from_another_address_are_left_out(bench: Bench) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        stranger.bind(("127.0.0.3", 0))
        for _, datagram in bench.emulator.stream.due(5_000_000):
            stranger.sendto(datagram, ("127.0.0.1", bench.lidar.ports["points"]))
    until(lambda: bench.lidar.health().foreign > 10)
    assert bench.lidar.health().packets == 0
    assert bench.lidar.health().refused == {}


def test_taking_control_turns_the_lidars_streams_to_this_host(clock, answering: LivoxEmulator) -> None:
    settings = replace(SETTINGS, take_control=True)
    with LivoxLidar(settings, clock, ports(lidar_command=answering.ports["command"])) as lidar:
        bound = lidar.ports
    written = {key: control_wire.parse_endpoint(answering.answers.written[key]) for key in (5, 6, 7)}
    assert written[Key.POINTS_DESTINATION] == ("127.0.0.1", bound["points"], 56300)
    assert written[Key.STATE_DESTINATION] == ("127.0.0.1", bound["push"], 56200)
    assert answering.answers.destinations["imu"] == ("127.0.0.1", bound["imu"])
    assert answering.answers.written[Key.WORK_MODE] == b"\x01"
    assert {received.frame.command for received in answering.received} == {CommandId.SET}


def test_a_key_the_lidar_refuses_is_named_with_its_reason(answering: LivoxEmulator) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as connection:
        connection.bind(("127.0.0.1", 0))
        control = LivoxControl(connection, ("127.0.0.2", answering.ports["command"]))
        with pytest.raises(PortError, match=r"key 0x8006: key is read-only"):
            control.set({Key.STATE: b"\x01"})


def test_a_lidar_that_does_not_answer_is_named(clock, answering: LivoxEmulator) -> None:
    answering.faults.silent = True
    settings = replace(SETTINGS, take_control=True)
    lidar = LivoxLidar(settings, clock, ports(lidar_command=answering.ports["command"]))
    with pytest.raises(LinkLost, match="did not answer SET in 3 tries"):
        lidar.start()
    assert lidar.ports == {}


def test_a_taken_port_is_refused_with_its_number(clock) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vendor:
        vendor.bind(("127.0.0.1", 0))
        port = vendor.getsockname()[1]
        with pytest.raises(PortError, match=f"127.0.0.1:{port}.*another program"):
            LivoxLidar(SETTINGS, clock, ports(points=port)).start()


def test_a_failed_receiver_is_told_to_whoever_reads(clock) -> None:
    class StoppedClock:
        def now_ns(self) -> int:
            raise RuntimeError("the clock is gone")

        def sleep(self, seconds: float) -> None:
            raise NotImplementedError

    with LivoxLidar(SETTINGS, StoppedClock(), ports()) as lidar:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.bind(("127.0.0.2", 0))
            sender.sendto(b"any", ("127.0.0.1", lidar.ports["points"]))

        def failed() -> bool:
            try:
                lidar.take_clouds()
            except LinkLost:
                return True
            return False

        until(failed)
        with pytest.raises(LinkLost, match="the clock is gone"):
            lidar.latest(1.0)


def test_a_name_in_place_of_an_address_is_refused() -> None:
    with pytest.raises(ValueError, match="lidar_ip: an IPv4 address like"):
        LivoxSettings(lidar_ip="lidar.local", host_ip="127.0.0.1")
