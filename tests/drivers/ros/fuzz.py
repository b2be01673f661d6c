"""Spoiled bytes for every decoder, in a process of its own: what kills it kills no test run, and is seen.

`python tests/drivers/ros/fuzz.py CASE ROUNDS` decodes spoiled payloads of one case (or "all"), ROUNDS of them at
random, with 3 GiB of memory. Only the errors of a wire may come out (ValueError's kinds, PortError): anything else ends
it with status 1 and the payload.
"""

from __future__ import annotations

import resource
import sys
import traceback
from collections.abc import Callable, Iterator

import numpy as np

from drivers.dds.action import without_header
from drivers.livox import control_wire, hms, wire
from drivers.nav2.result import navigation_result, path_plan
from drivers.ports import LidarCloud, PortError
from drivers.ros import rvl
from drivers.ros.action import CANCEL, STATUS_ARRAY, acceptances, statuses
from drivers.ros.calibration import intrinsics
from drivers.ros.clouds import cloud_message, cloud_of
from drivers.ros.convert import (
    battery_message,
    grid_message,
    grid_of,
    imu_message,
    path_message,
    path_of,
    pose_message,
    pose_of,
    transforms_message,
    transforms_of,
)
from drivers.ros.diagnosis import Diagnosis, Severity, diagnoses_of, diagnostics_message
from drivers.ros.image_messages import (
    camera_info_message,
    color_message,
    depth_message,
    depth_png_message,
    jpeg_message,
)
from drivers.ros.image_size import declared_size
from drivers.ros.images import color_image, depth_image
from drivers.ros.messages import Message, decode, encode, make
from drivers.ros.transform_tree import TransformTree
from drivers.watchdog.latch import WatchdogState
from drivers.watchdog.wire import HeartbeatMessage, WatchdogStatus, packed, unpacked
from openbelief.documents import from_json
from openbelief.g1 import COLOR_INTRINSICS
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid
from robot_app.remote.messages import RemoteReply
from robot_app.voice.audio import AudioClip, clip_of_pcm16, clip_of_wav

MEMORY_BYTES = 3 << 30
WORDS = [0, 1, 2, 7, 255, 0x7FFF, 0xFFFF, 0x7FFFFFF0, 0x7FFFFFFF, 0x80000000, 0xFFFFFFF0, 0xFFFFFFFF]
NAVIGATE, PLAN = "nav2_msgs/action/NavigateToPose", "nav2_msgs/action/ComputePathToPose"
Case = tuple[bytes, Callable[[bytes], object]]
RGB = np.random.default_rng(0).integers(0, 255, (24, 32, 3), np.uint8)
DEPTH = np.linspace(0.3, 4.0, 24 * 32, dtype=np.float32).reshape(24, 32)


def message(made: Message, use: Callable[[Message], object]) -> Case:
    kind = made.__msgtype__
    return encode(made), lambda payload: use(decode(payload, kind))


def in_tree(found: Message) -> object:
    tree = TransformTree(horizon_s=1.0)
    for t in transforms_of(found):
        tree.add(**vars(t))
    return tree.lookup(5, "map", "base_link")


def cases() -> Iterator[tuple[str, Case]]:
    cloud = LidarCloud(5, np.ones((20, 3), np.float32), "livox_frame")
    pose, step = pose_message(Pose2(1.0, 2.0, 0.5)), np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 1.0]])
    grid = OccupancyGrid(np.zeros((6, 8), np.int8), 0.05, (0.0, 0.0))
    yield "cloud", message(cloud_message(cloud), cloud_of)
    yield "image", message(color_message(5, "camera", RGB), color_image)
    yield "depth", message(depth_message(5, "camera", DEPTH), depth_image)
    yield "jpeg", message(jpeg_message(5, "camera", RGB), color_image)
    yield "depth png", message(depth_png_message(5, "camera", DEPTH), depth_image)
    yield "camera info", message(camera_info_message(5, "camera", COLOR_INTRINSICS), intrinsics)
    yield "map", message(grid_message(grid), grid_of)
    yield "tf", message(transforms_message(5, [("map", "base_link", np.eye(4))]), in_tree)
    yield "pose", message(pose, pose_of)
    yield "path", message(path_message(step, 5), path_of)
    yield "imu", message(imu_message(5, "imu", np.ones(3), np.ones(3)), lambda found: found)
    yield "battery", message(battery_message(5, 0.5), lambda found: found.percentage)
    said = [Diagnosis("lidar", Severity.WARN, "no cloud", "look at it")]
    yield "diagnosis", message(diagnostics_message(5, said), diagnoses_of)
    planned = make(f"{PLAN}_Result", path=path_message(step, 5))
    yield "plan", message(make(f"{PLAN}_GetResult_Response", status=4, result=planned), path_plan)
    ended = make(f"{NAVIGATE}_GetResult_Response", status=6)
    yield "result", message(ended, lambda r: navigation_result(r.status, r.result, replaced=False))
    told = make(f"{NAVIGATE}_FeedbackMessage", feedback=make(f"{NAVIGATE}_Feedback", current_pose=pose))
    yield "feedback", message(told, lambda f: pose_of(f.feedback.current_pose))
    goals = [make("action_msgs/msg/GoalStatus", status=2) for _ in range(3)]
    yield "status", message(make(STATUS_ARRAY, status_list=goals), lambda a: (statuses(a), acceptances(a)))
    info = make("action_msgs/msg/GoalInfo")
    yield "cancel", message(make(f"{CANCEL}_Response", goals_canceling=[info]), lambda r: r.return_code)
    yield "rvl", (rvl.encode((DEPTH * 1000).astype(np.uint16)), lambda data: rvl.decode(data, DEPTH.size))
    yield "image size", (bytes(jpeg_message(5, "camera", RGB).data), declared_size)
    yield (
        "heartbeat",
        (packed(HeartbeatMessage(workstation="a" * 32, sequence=1)), lambda p: unpacked(HeartbeatMessage, p)),
    )
    status = WatchdogStatus(state=WatchdogState.ARMED, watched=("a" * 32,))
    yield "watchdog", (packed(status), lambda p: unpacked(WatchdogStatus, p))
    yield "dds header", (b"\x00\x01\x00\x00" + bytes(40), without_header)
    frame = control_wire.encode(control_wire.set_request(1, {}))
    yield "livox control", (frame, lambda data: control_wire.parse_values(control_wire.decode(data).data))
    yield "livox values", (bytes(64), control_wire.parse_values)
    yield "livox health", (bytes(32), hms.parse_health)
    spoken = AudioClip(np.sin(np.arange(1600, dtype=np.float32)))
    yield "wav", (spoken.wav(), clip_of_wav)
    yield "pcm", (spoken.pcm16(), clip_of_pcm16)
    yield "json", (b'{"a": [1, {"b": null}], "c": "text"}', from_json)
    yield "remote reply", (b'{"ok": true, "order": 7, "refused": ""}', RemoteReply.model_validate_json)
    yield "livox packet", (bytes(36 + 96 * 14), lambda data: wire.decode_points([wire.decode_packet(data)]))


def spoiled(payload: bytes, seed: int) -> bytes:
    """One of: a few bytes, a few words of the worst numbers, cut off, longer."""
    rng, data = np.random.default_rng(seed), bytearray(payload)
    kind = seed % 4
    if kind == 0:
        for at in rng.integers(0, len(data), rng.integers(1, 9)):
            data[at] = rng.integers(0, 256)
    elif kind == 1:
        for at in rng.integers(0, max(len(data) // 4, 1), rng.integers(1, 4)):
            data[4 * at : 4 * at + 4] = int(rng.choice(WORDS)).to_bytes(4, "little")
    elif kind == 2:
        del data[rng.integers(0, len(data)) :]
    else:
        data += rng.bytes(int(rng.integers(1, 64)))
    return bytes(data)


def swept(payload: bytes) -> Iterator[bytes]:
    """Each of the worst numbers in each of the first words, where the sizes stand."""
    for at in range(0, min(len(payload) - 4, 256), 4):
        for word in WORDS:
            yield payload[:at] + word.to_bytes(4, "little") + payload[at + 4 :]


def survives(use: Callable[[bytes], object], payload: bytes) -> bool:
    try:
        use(payload)
    except (ValueError, PortError):
        return True
    except BaseException:  # noqa: BLE001 - whatever it is, it is what is looked for
        traceback.print_exc()
        return False
    return True


def main() -> int:
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    wanted, rounds = sys.argv[1], int(sys.argv[2])
    for name, (payload, use) in cases():
        if wanted not in ("all", name):
            continue
        print(name, flush=True)
        payloads = [payload, *swept(payload), *(spoiled(payload, seed) for seed in range(rounds))]
        for number, data in enumerate(payloads):
            if not survives(use, data):
                print(f"{name} number {number}: {data[:400].hex()}", flush=True)
                return 1
    print("done", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
