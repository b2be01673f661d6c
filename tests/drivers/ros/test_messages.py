"""CDR: the golden bytes that real ROS 2 nodes wrote, and a decoder that bad bytes cannot surprise."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.ros.convert import grid_message, pose_message, transforms_message, transforms_of
from drivers.ros.image_messages import color_message
from drivers.ros.messages import CHECKED_BY_THE_READER, DISTRIBUTIONS, WireError, codec, decode, encode, make
from drivers.ros.transform_edge import rigid
from openbelief.pose import Pose2
from openbelief.traversability import OccupancyGrid

NAVIGATE, PLAN = "nav2_msgs/action/NavigateToPose_", "nav2_msgs/action/ComputePathToPose_"
UUID = list(range(16))

# Serialised by rclpy with nav2_msgs Jazzy; padding is arbitrary. All but the ComputePathToPose request: the copy of it
# that was handed down lacks three bytes of padding in `start`. Here it is put together of what rclpy writes for its
# parts: the two poses as in nav_msgs/srv/GetPlan (144 bytes, which tests/ros_peer asks a real rclpy), a string, a bool.
GOLDEN = {
    "send_goal request": (
        NAVIGATE + "SendGoal_Request",
        "00010000000102030405060708090a0b0c0d0e0f0c00000022000000040000006d617000000000000000f03f00000000000004c0"
        "000000000000000000000000000000000000000000000000333333333333e33f9a9999999999e93f0100000000",
    ),
    "send_goal response": (NAVIGATE + "SendGoal_Response", "00010000015500000500000006000000"),
    "get_result request": (NAVIGATE + "GetResult_Request", "00010000000102030405060708090a0b0c0d0e0f"),
    "succeeded": (NAVIGATE + "GetResult_Response", "00010000045500000100000000"),
    "aborted": (
        NAVIGATE + "GetResult_Response",
        "000100000655d0000e0000006e6f2076616c6964207061746800",
    ),
    "feedback": (
        NAVIGATE + "FeedbackMessage",
        "00010000000102030405060708090a0b0c0d0e0f0000000000000000040000006d617000000000000000e03f0000000000000000"
        "0000000000000000000000000000000000000000000000000000000000000000000000000000f03f030000000000000007000000"
        "0000000002002a0a0000a03f",
    ),
    "cancel request": (
        "action_msgs/srv/CancelGoal_Request",
        "00010000000102030405060708090a0b0c0d0e0f0000000000000000",
    ),
    "cancel response": (
        "action_msgs/srv/CancelGoal_Response",
        "000100000055000001000000000102030405060708090a0b0c0d0e0f0500000000000000",
    ),
    "status": (
        "action_msgs/msg/GoalStatusArray",
        "0001000001000000000102030405060708090a0b0c0d0e0f050000000000000002",
    ),
    "plan request": (
        PLAN + "SendGoal_Request",
        "00010000000102030405060708090a0b0c0d0e0f0000000000000000040000006d617000000000000000f03f0000000000000000"
        "0000000000000000000000000000000000000000000000000000000000000000000000000000f03f000000000000000001000000"
        "00020000" + "00" * 48 + "000000000000f03f0a0000004772696442617365640000",
    ),
    "plan result": (
        PLAN + "GetResult_Response",
        "00010000045500000000000000000000040000006d617000010000000000000000000000040000006d617000000000000000f03f"
        "00000000000000000000000000000000000000000000000000000000000000000000000000000000000000000000f03f00000000"
        "e803000000002a0a0100000000",
    ),
}


def golden(name):
    type_name, text = GOLDEN[name]
    return type_name, bytes.fromhex(text)


def message(name):
    type_name, payload = golden(name)
    return decode(payload, type_name)


@pytest.mark.parametrize("name", GOLDEN)
def test_golden_bytes_decode_and_encode_again(name):
    type_name, payload = golden(name)
    first = decode(payload, type_name)
    again = encode(first)
    assert len(again) == len(payload)
    assert repr(decode(again, type_name)) == repr(first), "compared after decoding: padding is arbitrary"


def test_golden_requests_mean_what_was_sent():
    goal = message("send_goal request")
    assert goal.goal_id.uuid.tolist() == UUID
    pose = goal.goal.pose
    assert (pose.header.stamp.sec, pose.header.stamp.nanosec, pose.header.frame_id) == (12, 34, "map")
    assert (pose.pose.position.x, pose.pose.position.y, pose.pose.orientation.z, pose.pose.orientation.w) == (
        1.0,
        -2.5,
        0.6,
        0.8,
    )
    plan = message("plan request").goal
    assert (plan.goal.pose.position.x, plan.planner_id, plan.use_start) == (1.0, "GridBased", False)
    assert plan.start.pose.orientation.w == 1.0 and plan.start.header.frame_id == ""
    cancel = message("cancel request").goal_info
    assert cancel.goal_id.uuid.tolist() == UUID and cancel.stamp.sec == 0


def test_golden_replies_mean_what_was_answered():
    accepted = message("send_goal response")
    assert accepted.accepted and (accepted.stamp.sec, accepted.stamp.nanosec) == (5, 6)
    assert message("succeeded").status == 4
    aborted = message("aborted")
    assert (aborted.status, aborted.result.error_code, aborted.result.error_msg) == (6, 208, "no valid path")
    feedback = message("feedback").feedback
    assert (feedback.current_pose.pose.position.x, feedback.navigation_time.sec) == (0.5, 3)
    assert (feedback.estimated_time_remaining.sec, feedback.number_of_recoveries) == (7, 2)
    assert feedback.distance_remaining == 1.25
    cancelled = message("cancel response")
    assert cancelled.return_code == 0 and cancelled.goals_canceling[0].stamp.sec == 5
    assert message("status").status_list[0].status == 2
    path = message("plan result").result
    assert [p.pose.position.x for p in path.path.poses] == [1.0] and path.planning_time.nanosec == 1000


def test_what_we_send_is_what_ros_sends():
    """Our own builders reproduce the golden requests byte for byte, where there is no padding."""
    type_name, payload = golden("get_result request")
    uuid = make("unique_identifier_msgs/msg/UUID", uuid=np.arange(16, dtype=np.uint8))
    assert encode(make(type_name, goal_id=uuid)) == payload
    type_name, payload = golden("cancel request")
    info = make("action_msgs/msg/GoalInfo", goal_id=uuid)
    assert encode(make(type_name, goal_info=info)) == payload
    assert encode(make("std_srvs/srv/Trigger_Request")) == bytes.fromhex("0001000000"), "an empty request"


def test_a_quaternion_is_made_as_no_rotation():
    assert make("geometry_msgs/msg/Pose").orientation.w == 1.0


# Distributions


def test_humble_results_have_no_error_code_and_a_dummy_byte():
    shapes = codec("humble")
    payload = shapes.encode(shapes.make(NAVIGATE + "GetResult_Response", status=4))
    assert payload == bytes.fromhex("000100000400")
    with pytest.raises(WireError):
        codec("jazzy").decode(payload, NAVIGATE + "GetResult_Response")


def test_lyrical_adds_viapoints_and_two_floats():
    jazzy, lyrical = codec("jazzy"), codec("lyrical")
    for name in (PLAN + "SendGoal_Request", NAVIGATE + "FeedbackMessage"):
        assert len(lyrical.encode(lyrical.make(name))) > len(jazzy.encode(jazzy.make(name)))
    with pytest.raises(WireError):
        lyrical.decode(golden("feedback")[1], golden("feedback")[0])


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_every_distribution_knows_every_type_in_use(distribution):
    from drivers.topics import TOPICS

    shapes = codec(distribution)
    for topic in TOPICS:
        shapes.decode(shapes.encode(shapes.make(topic.type_name)), topic.type_name)


def test_an_unknown_distribution_is_refused_with_the_known_ones():
    with pytest.raises(WireError, match="humble, jazzy"):
        codec("indigo")


# Refusals


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b"", "encapsulation"),
        (b"\x00\x01\x00", "encapsulation"),
        (b"\x00\x03\x00\x00" + bytes(16), "encapsulation"),
        (b"\x07\x01\x00\x00" + bytes(16), "encapsulation"),
        (b"\x00\x01\x00\x00" + bytes(15), "smaller"),
        (b"\x00\x01\x00\x00" + bytes(20), "size mismatch"),
    ],
)
def test_bad_encapsulation_short_and_long_are_refused(payload, words):
    with pytest.raises(WireError, match=words):
        decode(payload, NAVIGATE + "GetResult_Request")


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_refused_by_name(bad):
    pose = pose_message(Pose2(1.0, 2.0, 0.0))
    pose.pose.position.y = bad
    with pytest.raises(WireError, match=r"pose\.position\.y is not finite"):
        decode(encode(pose), "geometry_msgs/msg/PoseStamped")


BATTERY_STATE = "sensor_msgs/msg/BatteryState"  # whose .msg file says: "If unmeasured NaN"


def test_a_battery_state_keeps_nan_for_what_it_does_not_measure():
    nan = float("nan")
    state = make(BATTERY_STATE, voltage=nan, temperature=nan, percentage=0.8, cell_voltage=np.float32([nan, 3.9]))
    back = decode(encode(state), BATTERY_STATE)
    assert np.isnan([back.voltage, back.temperature, back.cell_voltage[0]]).all()
    assert back.percentage == pytest.approx(0.8)


@pytest.mark.parametrize("bad", [{"voltage": np.inf}, {"cell_voltage": np.float32([np.inf])}])
def test_a_battery_state_has_no_infinite_numbers(bad):
    with pytest.raises(WireError, match=r"voltage is not finite"):
        decode(encode(make(BATTERY_STATE, **bad)), BATTERY_STATE)


def test_an_unknown_type_and_field_are_refused():
    with pytest.raises(WireError, match="No definition"):
        decode(b"\x00\x01\x00\x00\x00", "made_up/msg/Thing")
    with pytest.raises(WireError, match="no field colour"):
        make("geometry_msgs/msg/Pose", colour=1)


def test_a_value_that_does_not_fit_its_field_is_refused():
    with pytest.raises(WireError, match="cannot be encoded"):
        encode(make("builtin_interfaces/msg/Time", sec=1 << 40))


def test_a_schema_names_every_type_it_uses():
    text = codec().definition("geometry_msgs/msg/PoseStamped")
    assert "MSG: geometry_msgs/Quaternion" in text and "MSG: std_msgs/Header" in text


# Fuzzing: an error or a finite message, whatever comes

SAMPLES = {
    **{name: golden(name) for name in GOLDEN},
    "tf": ("tf2_msgs/msg/TFMessage", encode(transforms_message(5, [("map", "odom", np.eye(4))] * 2))),
    "grid": (
        "nav_msgs/msg/OccupancyGrid",
        encode(grid_message(OccupancyGrid(np.zeros((3, 4), np.int8), 0.05, (0, 0)))),
    ),
    "image": ("sensor_msgs/msg/Image", encode(color_message(5, "camera", np.zeros((2, 3, 3), np.uint8)))),
}


def decodes_or_refuses(payload, type_name):
    try:
        result = decode(payload, type_name)
    except WireError as error:
        assert str(error)
    else:
        assert type_name in CHECKED_BY_THE_READER or not re.search(r"\b(nan|inf)\b", repr(result))
        if type_name == "tf2_msgs/msg/TFMessage":
            read = [rigid(each.translation, each.quaternion_xyzw) for each in transforms_of(result)]
            assert all(np.isfinite(T).all() for T in read if T is not None)


@pytest.mark.parametrize("name", SAMPLES)
def test_a_message_cut_at_any_byte_is_refused(name):
    type_name, payload = SAMPLES[name]
    for length in range(len(payload)):
        with pytest.raises(WireError):
            decode(payload[:length], type_name)


def test_a_transform_that_is_not_finite_is_judged_by_its_reader_and_the_other_stays():
    type_name, payload = SAMPLES["tf"]
    flipped = bytearray(payload)
    flipped[1438 // 8] ^= 1 << 1438 % 8  # the exponent of the second one's w: 1 becomes infinite
    decodes_or_refuses(bytes(flipped), type_name)
    first, second = transforms_of(decode(bytes(flipped), type_name))
    assert rigid(first.translation, first.quaternion_xyzw) is not None
    assert rigid(second.translation, second.quaternion_xyzw) is None


@given(st.sampled_from(sorted(SAMPLES)), st.data())
@settings(max_examples=200, deadline=None)
def test_flipped_bits_are_refused_or_decode_to_finite_values(name, data):
    type_name, payload = SAMPLES[name]
    flipped = bytearray(payload)
    for _ in range(data.draw(st.integers(1, 4))):
        bit = data.draw(st.integers(0, 8 * len(payload) - 1))
        flipped[bit // 8] ^= 1 << bit % 8
    decodes_or_refuses(bytes(flipped), type_name)


@given(st.binary(max_size=200), st.sampled_from(sorted({t for t, _ in SAMPLES.values()})))
@settings(max_examples=200, deadline=None)
def test_random_bytes_are_refused_or_decode_to_finite_values(body, type_name):
    decodes_or_refuses(b"\x00\x01\x00\x00" + body, type_name)
