from __future__ import annotations

import numpy as np

from openbelief.keyframes import Keyframes
from openbelief.observation import Intrinsics, RgbdFrame


def at(stamp_ns, x, recording="walk"):
    pose = np.eye(4)
    pose[0, 3] = x
    camera = Intrinsics(4, 3, 5.0, 5.0, 1.5, 1.0)
    color, depth = np.zeros((3, 4, 3), np.uint8), np.ones((3, 4), np.float32)
    return RgbdFrame(0, stamp_ns, color, depth, camera, pose, recording)


def test_a_camera_that_hardly_moved_gives_no_keyframe():
    keyframes = Keyframes(lambda recording: [])
    assert [keyframes.take(at(t, x)) for t, x in ((0, 0.0), (1, 0.2), (2, 0.3), (3, 0.5), (4, 0.6))] == [
        *(True, False, True, False, True)
    ]


def test_a_frame_is_compared_with_the_last_before_it_in_time_not_in_the_file():
    keyframes = Keyframes(lambda recording: [])
    assert keyframes.take(at(10, 0.0)) and keyframes.take(at(30, 9.0))
    assert not keyframes.take(at(20, 0.1)) and keyframes.take(at(40, 0.1))


def test_what_an_earlier_run_left_counts_for_its_recording_alone():
    keyframes = Keyframes(lambda recording: [(5, at(5, 1.0).T_map_camera)] if recording == "walk" else [])
    assert not keyframes.take(at(6, 1.1)) and keyframes.take(at(6, 1.1, "other"))
