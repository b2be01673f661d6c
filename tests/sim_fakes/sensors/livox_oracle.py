"""A program, not a test: the vendor's SDK (py-livox2) listens to the lidar for a while and prints what it understood.

Run by test_livox_oracle.py in a process of its own, for the SDK owns threads and never gives its ports back.
Arguments: the configuration file, how many points packets to wait for, the time limit in seconds.
"""

from __future__ import annotations

import json
import sys
import threading

import livox_sdk
import numpy as np

RECORD = np.dtype([("xyz", "<i4", 3), ("reflectivity", "u1"), ("tag", "u1")])


def main() -> None:
    configuration, wanted, limit_s = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    enough, online = threading.Event(), threading.Event()
    packets: list[tuple[int, int, bytes]] = []
    imu: list[tuple[list[float], list[float]]] = []
    found: list[int] = []

    def on_points(packet: livox_sdk.PyLivoxLidarEthernetPacket) -> None:
        packets.append((int(packet.ts), int(packet.dot_num), packet.get_pts_data()))
        if len(packets) >= wanted:
            enough.set()

    def on_found(handle: int, kind: livox_sdk.LivoxLidarDeviceType) -> None:
        found.append(int(kind))
        online.set()

    livox_sdk.DisableLivoxSdkConsoleLogger()
    livox_sdk.SetLivoxLidarInfoChangeCallback(on_found)
    livox_sdk.SetLivoxLidarPointCloudCallBack(on_points)
    livox_sdk.SetLivoxLidarImuDataCallback(lambda packet: imu.append((list(packet.gyr), list(packet.acc))))
    if not livox_sdk.LivoxLidarSdkInit(configuration):
        raise SystemExit("The SDK refused its configuration.")
    online.wait(limit_s)
    enough.wait(limit_s)
    stamp, dots, records = packets[-1] if packets else (0, 0, b"")
    millimetres = np.frombuffer(records, dtype=RECORD)["xyz"].tolist()
    report = {"found": found, "packets": len(packets), "imu": len(imu), "last_imu": imu[-1] if imu else None}
    report |= {"stamp_ns": stamp, "dots": dots, "xyz_mm": millimetres}
    livox_sdk.LivoxLidarSdkUninit()
    print(json.dumps(report))


if __name__ == "__main__":
    main()
