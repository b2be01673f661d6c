"""Images through the real librealsense: syncer, filters, alignment; and what comes out when the camera misbehaves."""

from __future__ import annotations

import numpy as np
import pytest

from drivers.realsense.gate import DuplicateFilter
from drivers.realsense.messages import CameraGone, CameraRefused, RealSenseSettings, TimestampDomain
from drivers.realsense.sdk import SdkStream
from sim_fakes.sensors.realsense_faults import Fault
from sim_fakes.sensors.realsense_software import GRAVITY, TURN, RealSenseTwin, TwinSpec, box_images

MICROSECOND = 1_000


def test_colour_and_depth_of_one_moment_come_out_as_one_pair(bench) -> None:
    first = bench.settled()
    second = bench.moment()
    assert second.color_number == second.depth_number == first.color_number + 1
    assert abs(second.device_stamp_ns - bench.stamp_ns) < MICROSECOND
    assert second.color.shape == (480, 848, 3) and second.color.dtype == np.uint8
    assert second.depth.shape == (480, 848) and second.depth.dtype == np.uint16


@pytest.mark.parametrize("domain", list(TimestampDomain))
def test_the_timestamp_domain_is_kept(make_bench, domain) -> None:
    assert make_bench(TwinSpec(domain=domain)).settled().domain is domain


def test_a_dropped_colour_image_leaves_a_gap_and_no_half_frame(bench) -> None:
    gate = DuplicateFilter()
    first = bench.settled()
    gate.admit(first)
    bench.twin.state.fault = Fault.DROPPED
    pairs = [bench.moment() for _ in range(9)]
    came = [pair for pair in pairs if pair is not None]
    assert all(pair.color_number == pair.depth_number for pair in came)
    assert all(gate.admit(pair) for pair in came)
    assert gate.lost == came[-1].color_number - first.color_number - len(came) > 0


def test_a_late_colour_image_keeps_its_own_stamp(bench) -> None:
    """So that its age shows, and it is never paired with a newer depth image."""
    bench.settled()
    bench.twin.state.fault = Fault.LATE
    late = [(bench.stamp_ns, pair) for _ in range(12) if (pair := bench.moment()) is not None]
    assert late
    for now_ns, pair in late:
        assert now_ns - pair.device_stamp_ns >= 50_000_000
        assert abs(pair.device_stamp_ns - pair.depth_device_stamp_ns) < MICROSECOND


@pytest.mark.parametrize("fault", [Fault.REPEATED, Fault.STAMP_FROZEN, Fault.PIXELS_FROZEN])
def test_frozen_images_are_no_news(bench, fault) -> None:
    gate = DuplicateFilter()
    gate.admit(bench.settled())
    bench.twin.state.fault = fault
    bench.moment()
    pairs = [bench.moment() for _ in range(6)]
    assert not any(gate.admit(pair) for pair in pairs if pair is not None)
    assert gate.frozen + bench.stream.unpaired >= len(pairs)


def test_silence_is_none_and_a_disconnect_is_named(bench) -> None:
    bench.settled()
    bench.twin.state.fault = Fault.SILENT
    assert bench.moment() is None
    bench.twin.state.fault = Fault.UNPLUGGED
    with pytest.raises(CameraGone, match="disconnected"):
        bench.moment()


def test_the_imu_comes_beside_the_images(bench) -> None:
    for _ in range(10):
        bench.moment()
    motions = bench.stream.motions()
    gyro = [motion for motion in motions if motion.kind == "gyro"]
    accel = [motion for motion in motions if motion.kind == "accel"]
    assert 60 <= len(gyro) <= 70 and 75 <= len(accel) <= 88  # 200 and 250 Hz for a third of a second
    assert gyro[0].value == pytest.approx(TURN) and accel[0].value == pytest.approx(GRAVITY)
    assert bench.stream.motions() == []


def test_a_camera_without_imu_says_so(make_bench) -> None:
    bench = make_bench(TwinSpec(has_imu=False))
    assert not bench.info.has_imu and bench.info.T_imu_color is None
    bench.settled()
    assert bench.stream.motions() == []


class BrokenImu:
    """A device whose motion module fails in one call, as without librealsense's udev rules."""

    WORDS = "Failed to open scan_element in_accel_x_en Last Error: Permission denied"

    def __init__(self, part, call: str) -> None:
        self._part, self._call = part, call

    def query_sensors(self):
        rs = _rs()
        return [
            BrokenImu(s, self._call) if rs.stream.gyro in {p.stream_type() for p in s.get_stream_profiles()} else s
            for s in self._part.query_sensors()
        ]

    def _broken(self, *_):
        raise RuntimeError(self.WORDS)

    def is_motion_sensor(self) -> bool:
        return True

    def __getattr__(self, name: str):
        return self._broken if name == self._call else getattr(self._part, name)


@pytest.mark.parametrize("call", ["open", "start", "get_stream_profiles"])
def test_an_imu_that_cannot_be_opened_costs_the_imu_and_not_the_camera(call: str) -> None:
    twin = RealSenseTwin(box_images(TwinSpec()), TwinSpec())
    stream = SdkStream(BrokenImu(twin.device, call), RealSenseSettings())
    try:
        info = stream.start()
        assert not info.has_imu and info.T_imu_color is None and "Permission denied" in str(info.imu_trouble)
    finally:
        stream.close()


def test_an_imu_that_nobody_wants_is_left_alone() -> None:
    twin = RealSenseTwin(box_images(TwinSpec()), TwinSpec())
    stream = SdkStream(BrokenImu(twin.device, "open"), RealSenseSettings(imu=False))
    try:
        info = stream.start()
        assert not info.has_imu and info.imu_trouble is None
    finally:
        stream.close()


def test_extrinsics_and_scale_are_read_from_the_device(bench) -> None:
    assert np.allclose(bench.info.T_depth_color, bench.twin.spec.T_depth_color, atol=1e-6)
    assert bench.info.T_imu_color[0, 3] == pytest.approx(0.0205, abs=1e-6)  # 15 mm + 5.5 mm
    assert bench.info.depth_unit_m == 0.001


def test_emitter_exposure_and_global_time_are_set(bench) -> None:
    set_options = {
        (sensor.get_info(_rs().camera_info.name), option.name): sensor.get_option(option)
        for sensor in bench.twin.device.query_sensors()
        for option in sensor.get_supported_options()
    }
    assert set_options["Stereo Module", "emitter_enabled"] == 1
    assert set_options["Stereo Module", "enable_auto_exposure"] == 1
    assert set_options["Stereo Module", "global_time_enabled"] == 1
    assert set_options["RGB Camera", "auto_exposure_priority"] == 0


def _rs():
    from sim_fakes.sensors import realsense_software

    return realsense_software.rs


@pytest.mark.parametrize("usb", ["2.1", "2.0", "1.1"])
def test_usb_2_is_refused_with_the_remedy(make_bench, usb) -> None:
    with pytest.raises(CameraRefused, match=rf"USB {usb}.*USB 3 port"):
        make_bench(TwinSpec(usb=usb))


def test_a_colour_size_that_is_not_offered_is_refused(make_bench) -> None:
    with pytest.raises(CameraRefused, match="no color of 1280x720"):
        make_bench(settings=RealSenseSettings(color_size=(1280, 720)))


def test_a_colour_size_that_no_d435i_has_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match=r"color_size: the camera offers \[848, 480\] and \[1280, 720\]"):
        RealSenseSettings(color_size=(1000, 1000))


def test_standing_still_averages_over_time_and_walking_does_not(make_bench) -> None:
    """Noise of one count in every pixel: the average over time has less of it."""
    rng = np.random.default_rng(5)
    color = np.full((480, 848, 3), 120, np.uint8)

    def noisy(_spec):
        return lambda _stamp_ns: (color, (2.0 + rng.normal(0, 0.01, (480, 848))).astype(np.float32))

    bench = make_bench(images=noisy)
    bench.settled()

    def spread() -> float:
        depths = [bench.moment().depth[200:280, 300:500].astype(float) for _ in range(8)]
        return float(np.std(depths[-1]))

    walking = spread()
    bench.stream.stand_still(True)
    standing = spread()
    bench.stream.stand_still(False)
    assert standing < 0.8 * walking
    assert spread() > 0.9 * walking
