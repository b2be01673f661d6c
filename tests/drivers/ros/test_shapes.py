"""Humble, Jazzy (Kilted) and Lyrical are told apart by what decodes, whatever the end of the padding."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.ros.messages import DISTRIBUTIONS, WireError, codec
from drivers.ros.shapes import ORDER, shapes_of

NAVIGATE, PLAN = "nav2_msgs/action/NavigateToPose", "nav2_msgs/action/ComputePathToPose"
RESULT, FEEDBACK, PATH = f"{NAVIGATE}_GetResult_Response", f"{NAVIGATE}_FeedbackMessage", f"{PLAN}_GetResult_Response"
TOLD = {"humble": ("humble",), "jazzy": ("jazzy",), "kilted": ("jazzy",), "lyrical": ("lyrical",)}


def payload(distribution, type_name, **fields):
    shapes = codec(distribution)
    return shapes.encode(shapes.make(type_name, **fields))


@pytest.mark.parametrize("padding", range(4))
@pytest.mark.parametrize("kinds", [(RESULT, FEEDBACK), (PATH, FEEDBACK), (FEEDBACK, RESULT)])
@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_a_result_and_a_feedback_tell_the_distribution(distribution, kinds, padding):
    """ROS fills the end of a message up to four bytes."""
    shapes = shapes_of()
    for kind in kinds:
        shapes.decode(payload(distribution, kind) + bytes(padding), kind)
    assert shapes.distributions == TOLD[distribution]


def test_what_every_distribution_says_decides_nothing_and_is_read_in_the_first():
    shapes = shapes_of()
    assert shapes.distributions == ORDER
    answer = shapes.decode(
        payload("lyrical", f"{NAVIGATE}_SendGoal_Response", accepted=True), f"{NAVIGATE}_SendGoal_Response"
    )
    assert answer.accepted and shapes.distributions == ORDER


def test_a_result_of_humble_has_no_error_code():
    assert not hasattr(shapes_of().decode(payload("humble", RESULT, status=6), RESULT).result, "error_code")


@pytest.mark.parametrize(("first", "then"), [("humble", "jazzy"), ("jazzy", "humble"), ("lyrical", "humble")])
def test_a_robot_that_changes_its_distribution_is_still_read(first, then):
    shapes = shapes_of()
    for kind in (RESULT, FEEDBACK):
        shapes.decode(payload(first, kind), kind)
    for kind in (RESULT, FEEDBACK):
        shapes.decode(payload(then, kind), kind)
    assert shapes.distributions == TOLD[then]


def test_garbage_is_refused_and_teaches_nothing():
    shapes = shapes_of()
    shapes.decode(payload("humble", RESULT), RESULT)
    with pytest.raises(WireError):
        shapes.decode(b"\x00\x01\x00\x00 this is no message", RESULT)
    assert shapes.distributions == ("humble",)


def test_a_distribution_set_by_hand_is_not_guessed_at():
    with pytest.raises(WireError, match="jazzy"):
        shapes_of("jazzy").decode(payload("humble", RESULT), RESULT)


def test_a_path_question_has_two_shapes_and_a_goal_has_one():
    shapes = shapes_of()
    questions = shapes.encodings(lambda each: each.make(f"{PLAN}_SendGoal_Request"))
    assert [tuple(c.distribution for c in codecs) for codecs in questions.values()] == [
        ("jazzy", "humble"),
        ("lyrical",),
    ]
    assert len(shapes.encodings(lambda each: each.make(f"{NAVIGATE}_SendGoal_Request"))) == 1


def test_an_answer_to_a_shape_keeps_what_was_known_besides():
    shapes = shapes_of()
    shapes.decode(payload("humble", RESULT), RESULT)
    shapes.keep((codec("jazzy"), codec("humble")))
    assert shapes.distributions == ("humble",)
    shapes.keep((codec("lyrical"),))
    assert shapes.distributions == ("lyrical",)


def test_messages_made_for_any_are_the_same_in_all():
    made = {
        name: payload(name, "unique_identifier_msgs/msg/UUID", uuid=np.arange(16, dtype=np.uint8)) for name in ORDER
    }
    assert len(set(made.values())) == 1
