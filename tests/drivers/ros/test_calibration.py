from __future__ import annotations

import numpy as np
import pytest

from drivers.ros.calibration import described, intrinsics, is_rectified
from drivers.ros.messages import decode, encode, make
from drivers.ros.refusals import ImageRefused

P = np.array([500.0, 0, 310, 0, 0, 510, 230, 0, 0, 0, 1, 0])


def camera_info(**changes):
    k = np.array([600.0, 0, 320, 0, 610, 240, 0, 0, 1])
    fields = {"width": 640, "height": 480, "k": k, "d": np.zeros(5), "distortion_model": "plumb_bob"} | changes
    return make("sensor_msgs/msg/CameraInfo", **fields)


def test_a_camera_info_becomes_intrinsics_with_its_distortion():
    camera = intrinsics(camera_info(d=np.array([0.1, -0.2, 0.001, 0.002, 0.05])))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (600, 610, 320, 240)
    assert camera.distortion == (0.1, -0.2, 0.001, 0.002, 0.05)
    assert intrinsics(camera_info()).distortion == ()


@pytest.mark.parametrize(
    "changes",
    [
        {"k": np.zeros(9)},
        {"k": np.full(9, np.nan)},
        {"d": np.full(4, 0.1), "distortion_model": "equidistant"},
        {"distortion_model": "equidistant"},  # a fisheye lens is none without its coefficients either
        {"d": np.full(3, 0.1)},
        {"d": np.full(5, np.nan)},
    ],
)
def test_a_calibration_that_would_have_to_be_guessed_is_refused(changes):
    with pytest.raises(ImageRefused):
        intrinsics(camera_info(**changes))


@pytest.mark.parametrize(
    ("topic", "rectified"),
    [
        ("/camera/image_rect", True),
        ("/camera/image_rect_color/compressed", True),
        ("/zed/zed_node/rgb/color/rect/image", True),
        ("/stereo/left/rectified", True),
        ("/camera/color/image_raw", False),
        ("/direct/image", False),
    ],
)
def test_the_name_of_a_topic_tells_whether_its_image_is_rectified(topic, rectified):
    assert is_rectified(topic) is rectified


def test_a_rectified_image_has_the_projection_and_no_distortion_whatever_the_lens():
    info = camera_info(p=P, d=np.full(4, 0.3), distortion_model="equidistant", k=np.full(9, np.nan))
    camera = intrinsics(info, rectified=True)
    assert (camera.fx, camera.fy, camera.cx, camera.cy, camera.distortion) == (500, 510, 310, 230, ())


@pytest.mark.parametrize("p", [np.zeros(12), np.full(12, np.nan), P + np.eye(1, 12, 3)[0] * -35.0])
def test_a_rectified_image_without_its_own_projection_is_refused(p):
    """The third is the right camera of a stereo pair: its frame_id is the left one's."""
    with pytest.raises(ImageRefused, match=r"has P|baseline"):
        intrinsics(camera_info(p=p), rectified=True)


@pytest.mark.parametrize("unused", [{"p": np.full(12, np.nan)}, {"r": np.full(9, np.nan)}, {"p": np.zeros(12)}])
def test_what_is_not_used_may_be_anything_also_over_the_wire(unused):
    info = decode(encode(camera_info(**unused)), "sensor_msgs/msg/CameraInfo")
    assert intrinsics(info).fx == 600


def roi(**fields):
    return make("sensor_msgs/msg/RegionOfInterest", **fields)


def test_binning_and_a_region_of_interest_are_worked_into_the_matrix():
    binned = intrinsics(camera_info(binning_x=2, binning_y=2))
    assert (binned.width, binned.height, binned.fx, binned.cx) == (320, 240, 300, 160)
    cut = intrinsics(camera_info(roi=roi(x_offset=100, y_offset=40, width=200, height=160)))
    assert (cut.width, cut.height, cut.fx, cut.cx, cut.cy) == (200, 160, 600, 220, 200)
    both = camera_info(roi=roi(x_offset=100, y_offset=40, width=200, height=160), binning_x=2, binning_y=4)
    camera = intrinsics(both)
    assert (camera.width, camera.height, camera.cx, camera.cy) == (100, 40, 110, 50)
    assert described(both) == "camera info 640x480 with binning 2x4 and roi 200x160 at (100, 40)"


def test_a_region_outside_the_image_and_one_of_the_raw_image_are_refused():
    with pytest.raises(ImageRefused, match="not inside"):
        intrinsics(camera_info(roi=roi(x_offset=600, width=200, height=160)))
    with pytest.raises(ImageRefused, match="do_rectify"):
        intrinsics(camera_info(p=P, roi=roi(width=200, height=160, do_rectify=True)), rectified=True)
