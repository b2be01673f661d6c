"""Sensors at full rate for benches, as a process of its own: RGB-D at 30 Hz, 200 000 points/s, IMU, transforms, map.

The images and clouds are rendered once and sent again with new stamps, so that sending costs little beside receiving.
On stdin, a line begins the sending; on stdout the endpoint comes first, and what was sent, as JSON, last.
"""

from __future__ import annotations

import argparse
import json
import struct
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drivers.livox.assembler import LivoxCloud
from drivers.livox.wire import TimeType
from drivers.ros.clouds import cloud_message
from drivers.ros.convert import grid_message, imu_message, transforms_message
from drivers.ros.image_messages import camera_info_message, color_message, depth_message
from drivers.ros.messages import encode
from drivers.ros.zenoh_link import open_router
from drivers.topics import CAMERA_INFO, COLOR, DEPTH, LIDAR, LIDAR_IMU, MAP, TF, TF_STATIC, TRANSFORMS, Topic
from openbelief.arrays import Array
from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA, T_BASE_LIDAR
from sim_fakes.sensors.eyes import RenderedEyes
from sim_fakes.wire.sim_bridge import SimBridge
from sim_fakes.world.renderer import Renderer
from sim_fakes.world.world import World

CAMERA_FRAME, LIDAR_FRAME = "camera_color_optical_frame", "livox_frame"
RATES_HZ = {COLOR: 30, DEPTH: 30, CAMERA_INFO: 30, LIDAR: 10, LIDAR_IMU: 200, TF: 50}
POINTS_PER_S = 200_000
VIEWS = 8  # different images, sent in turn
STAMP = struct.Struct("<iI")


@dataclass
class Sender:
    """One topic: its payloads in turn, and when the next is due."""

    topic: Topic
    payloads: list[bytearray]
    sent: int = 0

    @property
    def due_s(self) -> float:
        return self.sent / RATES_HZ[self.topic]

    def next_payload(self, stamp_ns: int) -> bytes:
        """The next payload, stamped anew: the header comes first, in a TFMessage behind the sequence's length."""
        payload = self.payloads[self.sent % len(self.payloads)]
        STAMP.pack_into(payload, 8 if self.topic.type_name == TRANSFORMS else 4, *divmod(stamp_ns, 10**9))
        self.sent += 1
        return bytes(payload)


def views(world: World) -> Iterator[tuple[Array, Array, LivoxCloud]]:
    """Colour, depth and a cloud, along the scene's walk."""
    eyes = RenderedEyes(Renderer(world), COLOR_INTRINSICS, seed=1)
    for pose in world.walk[:VIEWS]:
        T = pose.matrix()
        cloud = eyes.cloud(T @ T_BASE_LIDAR, 0)
        color, depth_m = eyes.image(T @ T_BASE_CAMERA, 0)
        yield color, depth_m, full(cloud.points)


def full(points: Array) -> LivoxCloud:
    """A tenth of a second at full rate with all that a MID-360 tells of a point, no two the same: repeats would be
    packed too well."""
    rng, count = np.random.default_rng(1), POINTS_PER_S // RATES_HZ[LIDAR]
    many = np.resize(points, (count, 3)) + rng.normal(0.0, 0.01, (count, 3))
    return LivoxCloud(
        0,
        many.astype(np.float32),
        LIDAR_FRAME,
        reflectivity=rng.integers(0, 256, count, dtype=np.uint8),
        offset_ns=np.sort(rng.integers(0, 10**9 // RATES_HZ[LIDAR], count)),
        tag=np.zeros(count, np.uint8),
        device_stamp_ns=0,
        time_type=TimeType.UPTIME,
        sequence=0,
        packets=count // 96,
        no_returns=0,
        doubtful=0,
    )


def senders(world: World) -> list[Sender]:
    seen = list(views(world))
    imu = imu_message(0, LIDAR_FRAME, np.zeros(3), np.array([0.0, 0.0, 9.81]))
    edges = [
        ("map", "odom", np.eye(4)),
        ("odom", "base_link", np.eye(4)),
        ("base_link", CAMERA_FRAME, T_BASE_CAMERA),
    ]
    made = {
        COLOR: [color_message(0, CAMERA_FRAME, color) for color, _, _ in seen],
        DEPTH: [depth_message(0, CAMERA_FRAME, depth_m) for _, depth_m, _ in seen],
        CAMERA_INFO: [camera_info_message(0, CAMERA_FRAME, COLOR_INTRINSICS)],
        LIDAR: [cloud_message(cloud) for _, _, cloud in seen],
        LIDAR_IMU: [imu],
        TF: [transforms_message(0, [edge]) for edge in edges],
    }
    return [Sender(topic, [bytearray(encode(m)) for m in messages]) for topic, messages in made.items()]


def send(bridge: SimBridge, streams: list[Sender], seconds: float) -> float:
    """Send each message when it is due; returns how far the sending fell behind at worst, in seconds."""
    begin_s, behind_s = time.monotonic(), 0.0
    while (stream := min(streams, key=lambda s: s.due_s)).due_s < seconds:
        late_s = time.monotonic() - begin_s - stream.due_s
        if late_s < 0:
            time.sleep(-late_s)
        behind_s = max(behind_s, late_s)
        bridge.publish(stream.topic, stream.next_payload(time.time_ns()))
    return behind_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, required=True)
    options = parser.parse_args()
    world = World.load("flat")
    with open_router() as endpoint, SimBridge(endpoint) as bridge:
        streams = senders(world)
        bridge.publish(MAP, encode(grid_message(world.occupancy_grid())))
        bridge.publish(TF_STATIC, encode(transforms_message(0, [("base_link", LIDAR_FRAME, T_BASE_LIDAR)])))
        print(endpoint, flush=True)
        sys.stdin.readline()
        behind_s = send(bridge, streams, options.seconds)
        sent = {stream.topic.name: stream.sent for stream in streams}
        print(json.dumps({"sent": sent, "behind_s": behind_s}), flush=True)
        sys.stdin.readline()  # the session stays until everything has been received


if __name__ == "__main__":
    main()
