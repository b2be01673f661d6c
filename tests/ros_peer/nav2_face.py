"""NavigateToPose (Jazzy) made of a Fibonacci action: bodies are rewritten, the action protocol is left alone.

The wheels bring no nav2_msgs. Poses are read and written by rclpy; what surrounds them is put together by hand, which
works because uuid and PoseStamped end at multiples of 8 bytes. The goal's x is the number of steps; `order` in
server.py says what else it can be.
"""

from __future__ import annotations

import struct

from geometry_msgs.msg import PoseStamped
from rclpy.serialization import deserialize_message, serialize_message
from test_msgs.action import Fibonacci

CDR, UUID = b"\x00\x01\x00\x00", 16
ABORTED = 6
NO_PATH = 208


def goal(payload: bytes) -> bytes:
    """NavigateToPose_SendGoal_Request to Fibonacci's: the pose as rclpy reads it, in the frame that Nav2 needs."""
    pose = deserialize_message(CDR + payload[4 + UUID :], PoseStamped)
    if pose.header.frame_id != "map":
        raise ValueError(f"The goal is in frame {pose.header.frame_id!r}.")
    return payload[: 4 + UUID] + struct.pack("<i", round(pose.pose.position.x))


def result(payload: bytes) -> bytes:
    """Fibonacci_GetResult_Response to NavigateToPose's: the status stays, an abort gets a code and words."""
    status = payload[4]
    code, words = (NO_PATH, b"no valid path\0") if status == ABORTED else (0, b"\0")
    return CDR + struct.pack("<bxHI", status, code, len(words)) + words


def feedback(payload: bytes) -> bytes:
    """Fibonacci_FeedbackMessage to NavigateToPose's: the last step is the x of the current pose."""
    steps = list(deserialize_message(payload, Fibonacci.Impl.FeedbackMessage).feedback.sequence)
    pose = PoseStamped()
    pose.header.frame_id, pose.pose.position.x, pose.pose.orientation.w = "map", float(steps[-1]), 1.0
    surroundings = struct.pack("<iIiIhxxf", len(steps), 0, 7, 0, 0, 1.25)
    return payload[: 4 + UUID] + bytes(serialize_message(pose))[4:] + surroundings
