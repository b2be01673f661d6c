"""The independent oracle: the vendor's own SDK, inside the py-livox2 wheel, takes the emulated lidar for a real one.

It runs where the wheel is installed (requirements/livox_oracle.txt) and the lidar's factory ports are free.
"""

from __future__ import annotations

import importlib.util
import json
import socket
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SystemClock
from drivers.livox.control_wire import CommandId, Found
from drivers.livox.keys import Key
from drivers.livox.wire import RECORDS, DataType, decode_packet
from sim_fakes.sensors.livox_emulator import EmulatorSettings, LivoxEmulator
from sim_fakes.sensors.livox_scan import open_room
from sim_fakes.sensors.livox_stream import LivoxStream

WANTED, LIMIT_S = 500, 15
LIDAR_PORTS = {"cmd_data": 56100, "push_msg": 56200, "point_data": 56300, "imu_data": 56400, "log_data": 56500}
HOST_PORTS = {name: port + 1 for name, port in LIDAR_PORTS.items()}
DEVICES = {9: "MID360", 35: "Mid360s"}


def is_free(ip: str, port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((ip, port))
        except OSError:
            return False
        return True


def configuration(device: str) -> dict:
    host = {"host_ip": "127.0.0.1", "lidar_ip": ["127.0.0.2"]}
    host |= {f"{name}_port": port for name, port in HOST_PORTS.items()}
    lidar = {f"{name}_port": port for name, port in LIDAR_PORTS.items()}
    return {"master_sdk": True, device: {"lidar_net_info": lidar, "host_net_info": [host]}}


def sent_points_mm(stamp_ns: int) -> np.ndarray:
    """(96, 3) what the emulated lidar sent in the packet with that stamp."""
    stream = LivoxStream(open_room, Found(9, "", "127.0.0.2", 56100))
    packets = [decode_packet(datagram) for channel, datagram in stream.due(stamp_ns) if channel == "points"]
    packet = next(packet for packet in packets if packet.stamp_ns == stamp_ns)
    return np.frombuffer(packet.records, RECORDS[DataType.CARTESIAN_MM])["xyz"]


@pytest.mark.skipif(
    importlib.util.find_spec("livox_sdk") is None,
    reason="py-livox2 is not installed: pip install --no-deps -r requirements/livox_oracle.txt",
)
@pytest.mark.parametrize("device_type", DEVICES)
def test_the_vendors_sdk_takes_the_emulated_lidar_for_a_real_one(tmp_path: Path, device_type: int) -> None:
    needed = [("127.0.0.1", 56000), *(("127.0.0.1", port) for port in HOST_PORTS.values()), ("127.0.0.2", 56000)]
    if taken := [f"{ip}:{port}" for ip, port in needed if not is_free(ip, port)]:
        pytest.skip(f"another program holds {', '.join(taken)}")
    config = tmp_path / "sdk.json"
    config.write_text(json.dumps(configuration(DEVICES[device_type])))
    command = [sys.executable, str(Path(__file__).with_name("livox_oracle.py")), str(config), str(WANTED), str(LIMIT_S)]
    with LivoxEmulator(EmulatorSettings(device_type=device_type), clock=SystemClock()) as emulator:
        oracle = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60, check=False)
    assert oracle.returncode == 0, oracle.stderr
    understood = json.loads(oracle.stdout.splitlines()[-1])
    assert understood["found"] == [device_type]
    assert understood["packets"] >= WANTED
    assert understood["dots"] == 96
    np.testing.assert_array_equal(understood["xyz_mm"], sent_points_mm(understood["stamp_ns"]))
    np.testing.assert_allclose(understood["last_imu"], [[0, 0, 0], [0, 0, 1]], atol=1e-6)
    assert CommandId.SET in [received.frame.command for received in emulator.received if received.frame]
    assert {Key.POINTS_DESTINATION, Key.IMU_DESTINATION} <= set(emulator.answers.written)
