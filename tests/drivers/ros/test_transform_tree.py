from __future__ import annotations

import numpy as np
import pytest

from drivers.ports import PoseUnavailable
from drivers.ros.transform_edge import (
    TransformInvalid,
    TransformMissing,
    TransformNotYet,
    TransformStale,
    TransformTooOld,
)
from drivers.ros.transform_tree import TransformTree
from openbelief.pose import quaternion_from_rpy, quaternion_from_yaw, transform

MS = 1_000_000


def tree(**options) -> TransformTree:
    """map -> odom (10 Hz) -> base (20 Hz, driving and turning) -> camera (static, pitched down)."""
    t = TransformTree(**options)
    for k in range(11):
        t.add(k * 100 * MS, "map", "odom", [1.0, 0.0, 0.0], [0, 0, 0, 1])
    for k in range(21):
        t.add(k * 50 * MS, "odom", "base", [0.1 * k, 0.0, 0.0], quaternion_from_yaw(0.1 * k))
    t.add(0, "base", "camera", [0.0, 0.0, 1.2], quaternion_from_rpy(0, 0.4, 0), static=True)
    return t


def test_a_stamp_between_samples_is_interpolated_along_the_whole_chain():
    expected = transform([1.25, 0, 0], quaternion_from_yaw(0.25)) @ transform(
        [0, 0, 1.2], quaternion_from_rpy(0, 0.4, 0)
    )
    np.testing.assert_allclose(tree().lookup(125 * MS, "map", "camera"), expected, atol=1e-12)


def test_the_way_back_is_the_inverse_and_siblings_meet_at_their_common_ancestor():
    t = tree()
    t.add(0, "base", "lidar", [0.0, 0.0, 1.3], [1, 0, 0, 0], static=True)
    there, back = t.lookup(33 * MS, "map", "camera"), t.lookup(33 * MS, "camera", "map")
    np.testing.assert_allclose(there @ back, np.eye(4), atol=1e-12)
    # Two frames of one rigid body: no moving edge is asked, so a stamp outside the recording does not matter.
    assert t.lookup(10**12, "lidar", "camera")[2, 3] == pytest.approx(0.1)
    assert t.newest_stamp("lidar", "camera") is None


def test_nothing_is_extrapolated():
    with pytest.raises(TransformNotYet, match=r"0\.001 s older"):
        tree().lookup(1001 * MS, "map", "camera")
    with pytest.raises(TransformTooOld):
        tree().lookup(-1, "map", "camera")


def test_a_gap_between_the_bracketing_samples_is_stale_but_an_exact_sample_is_not():
    t = TransformTree(max_gap_s=0.25)
    for stamp in (0, 250, 600):
        t.add(stamp * MS, "map", "base", [0, 0, 0], [0, 0, 0, 1])
    t.lookup(100 * MS, "map", "base")
    t.lookup(600 * MS, "map", "base")
    with pytest.raises(TransformStale, match=r"0\.350 s apart"):
        t.lookup(300 * MS, "map", "base")


@pytest.mark.parametrize("quaternion", [[np.nan, 0, 0, 1], [0, 0, 0, 0]])
def test_a_sample_that_is_no_transform_refuses_the_stamps_it_brackets(quaternion):
    t = tree()
    t.add(75 * MS, "odom", "base", [0, 0, 0], quaternion)
    t.lookup(40 * MS, "map", "base")
    with pytest.raises(TransformInvalid, match="not rigid"):
        t.lookup(60 * MS, "map", "base")


def test_a_missing_chain_names_the_frames_that_are_known():
    with pytest.raises(TransformMissing, match="base, camera, map, odom"):
        tree().lookup(0, "map", "gripper")
    assert issubclass(TransformMissing, PoseUnavailable)


def test_a_frame_with_two_parents_is_refused_by_name():
    t = tree()
    t.add(0, "vicon", "base", [0, 0, 0], [0, 0, 0, 1])
    with pytest.raises(TransformInvalid, match="'base' has two parents, 'odom' and 'vicon'"):
        t.lookup(0, "map", "camera")


def test_a_loop_is_refused():
    t = TransformTree()
    t.add(0, "a", "b", [0, 0, 0], [0, 0, 0, 1])
    t.add(0, "b", "a", [0, 0, 0], [0, 0, 0, 1])
    with pytest.raises(TransformInvalid, match="loop"):
        t.lookup(0, "a", "b")


def test_samples_behind_the_horizon_are_dropped_and_late_ones_sorted_in():
    t = TransformTree(horizon_s=0.5)
    for stamp in (0, 400, 1000, 800):
        t.add(stamp * MS, "map", "base", [stamp, 0, 0], [0, 0, 0, 1])
    assert t.lookup(900 * MS, "/map", "base")[0, 3] == pytest.approx(900)
    assert t.newest_stamp("map", "base") == 1000 * MS
    with pytest.raises(TransformTooOld):
        t.lookup(400 * MS, "map", "base")


def test_after_the_publishers_clock_was_set_back_its_edge_begins_anew():
    t = TransformTree(horizon_s=10.0)
    for k in range(20):
        t.add(3_600_000 * MS + k * 50 * MS, "map", "base", [1.0, 0, 0], [0, 0, 0, 1])
    for k in range(3):
        t.add(k * 50 * MS, "map", "base", [2.0, 0, 0], [0, 0, 0, 1])
    assert t.newest_stamp("map", "base") == 100 * MS
    assert t.lookup(75 * MS, "map", "base")[0, 3] == pytest.approx(2.0)
    with pytest.raises(TransformNotYet):
        t.lookup(3_600_000 * MS, "map", "base")


def test_a_recordings_tree_keeps_what_came_before_its_clock_was_set_back():
    t = TransformTree()
    for stamp in (3_600_000, 0):
        t.add(stamp * MS, "map", "base", [float(stamp), 0, 0], [0, 0, 0, 1])
    assert t.lookup(3_600_000 * MS, "map", "base")[0, 3] == pytest.approx(3_600_000)


def live_tree() -> TransformTree:
    t = TransformTree(horizon_s=10.0)
    for k in range(11):
        t.add(k * 100 * MS, "odom", "base", [0.1 * k, 0.0, 0.0], [0, 0, 0, 1])
    t.add(1000 * MS, "vicon", "base", [9.0, 0.0, 0.0], [0, 0, 0, 1])
    return t


def test_a_second_parent_is_forgotten_once_its_publisher_has_fallen_silent():
    t = live_tree()
    for k in range(11, 32):
        with pytest.raises(TransformInvalid, match="two parents"):
            t.lookup(1000 * MS, "odom", "base")
        t.add(k * 100 * MS, "odom", "base", [0.1 * k, 0.0, 0.0], [0, 0, 0, 1])
    assert t.lookup(3000 * MS, "odom", "base")[0, 3] == pytest.approx(3.0)


def test_where_the_first_parents_publisher_falls_silent_the_second_counts():
    t = live_tree()
    for k in range(11, 42):
        t.add(k * 100 * MS, "vicon", "base", [9.0, 0.0, 0.0], [0, 0, 0, 1])
    assert t.lookup(4000 * MS, "vicon", "base")[0, 3] == pytest.approx(9.0)
    with pytest.raises(TransformMissing):
        t.lookup(4000 * MS, "odom", "base")


def test_two_publishers_that_both_go_on_stay_refused():
    t = live_tree()
    for k in range(11, 60):
        for parent in ("odom", "vicon"):
            t.add(k * 100 * MS, parent, "base", [0.0, 0.0, 0.0], [0, 0, 0, 1])
        with pytest.raises(TransformInvalid, match="two parents"):
            t.lookup(k * 100 * MS, "odom", "base")


def test_a_static_second_parent_is_not_silent_only_because_it_is_told_once():
    t = TransformTree(horizon_s=10.0)
    t.add(0, "base", "camera", [0, 0, 0], [0, 0, 0, 1], static=True)
    t.add(5000 * MS, "head", "camera", [1, 0, 0], [0, 0, 0, 1], static=True)
    with pytest.raises(TransformInvalid, match="two parents"):
        t.lookup(6000 * MS, "base", "camera")
    t.add(9000 * MS, "base", "camera", [0, 0, 0], [0, 0, 0, 1], static=True)  # told anew, and the other was not
    t.lookup(9000 * MS, "base", "camera")


def test_a_recording_forgets_no_second_parent():
    t = tree()
    t.add(0, "vicon", "base", [0, 0, 0], [0, 0, 0, 1])
    for k in range(21, 100):
        t.add(k * 50 * MS, "odom", "base", [0, 0, 0], [0, 0, 0, 1])
    with pytest.raises(TransformInvalid, match="two parents"):
        t.lookup(4000 * MS, "odom", "base")
