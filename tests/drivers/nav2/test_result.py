"""Nav2's numbers in an operator's words."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.nav2.result import WAY_M, navigation_result, path_plan, result_from_status
from drivers.ports import NavigationStatus, PortError
from drivers.ros.action import ABORTED, CANCELED, SUCCEEDED, UNKNOWN
from drivers.ros.convert import path_message
from drivers.ros.messages import codec, make

PLAN = "nav2_msgs/action/ComputePathToPose_"


def planned(status, distribution="jazzy", **result):
    shapes = codec(distribution)
    return shapes.make(f"{PLAN}GetResult_Response", status=status, result=shapes.make(f"{PLAN}Result", **result))


def navigated(**result):
    return make("nav2_msgs/action/NavigateToPose_Result", **result)


def test_a_path_has_its_length():
    path = path_message(np.array([[0.0, 0.0], [3.0, 4.0], [3.0, 5.0]]), 0)
    assert path_plan(planned(SUCCEEDED, path=path)).length_m == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("points", "way"),
    [
        ([[0.0, 0.0], [1.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]]),
        ([[0.0, 0.0], [0.0, 8.0]], [[0.0, 0.0], [0.0, WAY_M]]),
        ([[0.0, 0.0], [2.0, 0.0], [2.0, 4.0]], [[0.0, 0.0], [2.0, 0.0], [2.0, WAY_M - 2.0]]),
    ],
)
def test_of_a_path_the_first_metres_are_told_to_their_very_end(points, way):
    path = path_message(np.array(points), 0)
    assert np.allclose(path_plan(planned(SUCCEEDED, path=path)).path_prefix, way)


def test_an_aborted_plan_says_why_where_the_distribution_can():
    plan = path_plan(planned(ABORTED, error_code=206, error_msg="lethal"))
    assert plan.length_m is None and "occupied" in plan.reason and "lethal" in plan.reason
    assert path_plan(planned(ABORTED, "humble")).length_m is None, "Humble gives no code"


def test_an_empty_path_is_no_way():
    path = path_message(np.zeros((0, 2)), 0)
    assert path_plan(planned(SUCCEEDED, path=path)).length_m is None


@pytest.mark.parametrize("status", [UNKNOWN, CANCELED])
def test_a_plan_that_did_not_finish_is_no_statement(status):
    with pytest.raises(PortError, match="ask again"):
        path_plan(planned(status))


def test_a_path_of_another_frame_is_refused_as_a_port_error():
    path = path_message(np.array([[0.0, 0.0], [1.0, 0.0]]), 0)
    path.header.frame_id = "odom"
    with pytest.raises(PortError, match="frame 'map'"):
        path_plan(planned(SUCCEEDED, path=path))


@pytest.mark.parametrize(
    ("status", "code", "replaced", "end"),
    [
        (SUCCEEDED, 0, False, NavigationStatus.SUCCEEDED),
        (SUCCEEDED, 0, True, NavigationStatus.SUCCEEDED),
        (CANCELED, 0, False, NavigationStatus.CANCELED),
        (ABORTED, 0, True, NavigationStatus.PREEMPTED),
        (ABORTED, 0, False, NavigationStatus.ABORTED),
        (ABORTED, 105, True, NavigationStatus.ABORTED),
    ],
)
def test_every_end_has_its_name_and_a_sentence(status, code, replaced, end):
    result = navigation_result(status, navigated(error_code=code), replaced=replaced)
    assert (result.status, result.code) == (end, code)
    assert result.reason.endswith(".") and result.reason[0].isupper()


@pytest.mark.parametrize(
    ("status", "replaced", "end"),
    [
        (SUCCEEDED, True, NavigationStatus.LOST),
        (CANCELED, False, NavigationStatus.CANCELED),
        (ABORTED, True, NavigationStatus.PREEMPTED),
        (ABORTED, False, NavigationStatus.ABORTED),
    ],
)
def test_the_status_alone_names_every_end_but_success(status, replaced, end):
    assert result_from_status(status, replaced=replaced).status == end
