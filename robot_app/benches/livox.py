"""The MID-360 receiver against an emulated lidar in a process of its own: 200 000 points/s and 200 IMU samples/s.

The CPU share is this process's (receiver, CRCs, clouds at 10 Hz, health), of one core; the emulator's is not in it.
Fails where a single packet is lost.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

from robot_app import arguments
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from drivers.livox.driver import LivoxLidar

SETTLE_S, POLL_S = 10.0, 0.1


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--seconds", type=arguments.bench_seconds, default=30.0, help="how long the emulated lidar sends (default 30)"
    )


def run(options: argparse.Namespace) -> None:
    from drivers.clock import SystemClock
    from drivers.livox.driver import LivoxLidar
    from drivers.livox.settings import LivoxPorts, LivoxSettings

    settings = LivoxSettings(lidar_ip="127.0.0.2", host_ip="127.0.0.1")
    with LivoxLidar(settings, SystemClock(), LivoxPorts(points=0, imu=0, push=0)) as lidar:
        result = _measure(lidar, options.seconds)
    if options.json:
        print_json(result)
    else:
        print(_table(result))
    if result["lost"] or result["refused"]:
        raise Failure(
            f"{result['lost']} packets were lost and {result['refused']} refused: the machine is busy, or raise the "
            "receive buffer with: sudo sysctl -w net.core.rmem_max=8388608"
        )


def _measure(lidar: LivoxLidar, seconds: float) -> dict[str, Any]:
    command = [sys.executable, "-m", "sim_fakes.sensors.livox_emulator", "--seconds", str(seconds), "--any-lidar-port"]
    command += [word for name, port in lidar.ports.items() for word in (f"--host-{name}-port", str(port))]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as emulator:
        started_s = _await_first_packet(lidar, emulator)
        points, clouds = _count_until_end(lidar, emulator)
        cpu_s = time.process_time() - started_s
        report = emulator.stdout.read() if emulator.stdout else ""
    if emulator.returncode:
        raise Failure(f"the emulated lidar ended with status {emulator.returncode}; its message is above")
    sent = json.loads(report)
    _settle(lidar, sent)
    health = lidar.health()
    return {
        "seconds": seconds,
        "sent": {"points": sent["points"], "imu": sent["imu"]},
        "packets": health.packets,
        "points_per_s": round(96 * health.packets / seconds),
        "clouds": clouds,
        "points_kept": points,
        "imu_samples": health.imu_packets,
        "lost": _missing(lidar, sent),
        "lost_by_counter": health.lost + health.imu_lost,
        "refused": sum(health.refused.values()),
        "cpu_share": round(cpu_s / seconds, 4),
        "receive_buffer_bytes": health.receive_buffer_bytes,
    }


def _await_first_packet(lidar: LivoxLidar, emulator: subprocess.Popen[str]) -> float:
    """Our CPU seconds when the stream begins: the other process takes a moment to start."""
    while not lidar.health().packets and emulator.poll() is None:
        time.sleep(0.01)
    return time.process_time()


def _settle(lidar: LivoxLidar, sent: dict[str, int]) -> None:
    """The last packets are still in the socket: until all have come, or for ten seconds."""
    deadline_s = time.monotonic() + SETTLE_S
    while _missing(lidar, sent) and time.monotonic() < deadline_s:
        time.sleep(POLL_S)


def _missing(lidar: LivoxLidar, sent: dict[str, int]) -> int:
    health = lidar.health()
    return sent["points"] - health.packets + sent["imu"] - health.imu_packets


def _count_until_end(lidar: LivoxLidar, emulator: subprocess.Popen[str]) -> tuple[int, int]:
    """(points kept, clouds) taken as a recorder would take them."""
    points = clouds = 0
    while emulator.poll() is None:
        time.sleep(POLL_S)
        lidar.take_imu()
        for cloud in lidar.take_clouds():
            points, clouds = points + len(cloud.points), clouds + 1
    return points, clouds


def _table(result: dict[str, Any]) -> str:
    return "\n".join(
        [
            f"{result['points_per_s']} points/s for {result['seconds']} s: {result['packets']} packets, "
            f"{result['clouds']} clouds, {result['imu_samples']} IMU samples",
            f"CPU share of the receiver: {100 * result['cpu_share']:.1f} % of one core",
            f"lost: {result['lost']} packets ({result['lost_by_counter']} by the lidar's counter), "
            f"refused: {result['refused']}",
            f"receive buffer granted: {result['receive_buffer_bytes']} bytes",
        ]
    )
