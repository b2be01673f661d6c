"""Gyroscope and accelerometer of one IMU, which sample at different rates, as one stream."""

from __future__ import annotations

from collections import deque

import numpy as np

from drivers.realsense.messages import Motion

KEPT = 64  # samples that wait for the other sensor, a quarter of a second


class ImuPairing:
    """Each gyroscope sample with the acceleration interpolated to its stamp; never extrapolated."""

    def __init__(self) -> None:
        self._gyro: deque[Motion] = deque(maxlen=KEPT)
        self._accel: deque[Motion] = deque(maxlen=KEPT)

    def add(self, motion: Motion) -> list[tuple[Motion, np.ndarray]]:
        """The gyroscope samples that this one completes, each with its (3,) acceleration."""
        kept = self._gyro if motion.kind == "gyro" else self._accel
        if kept and (motion.device_stamp_ns <= kept[-1].device_stamp_ns or motion.domain != kept[-1].domain):
            kept.clear()  # the device's clock started anew
        kept.append(motion)
        return self._completed()

    def _completed(self) -> list[tuple[Motion, np.ndarray]]:
        done = []
        while self._gyro and self._accel and self._gyro[0].device_stamp_ns <= self._accel[-1].device_stamp_ns:
            gyro = self._gyro.popleft()
            if gyro.domain == self._accel[-1].domain and gyro.device_stamp_ns >= self._accel[0].device_stamp_ns:
                done.append((gyro, self._acceleration_at(gyro.device_stamp_ns)))
        return done

    def _acceleration_at(self, stamp_ns: int) -> np.ndarray:
        start_ns = self._accel[0].device_stamp_ns
        stamps = [motion.device_stamp_ns - start_ns for motion in self._accel]
        values = np.array([motion.value for motion in self._accel])
        return np.array([np.interp(stamp_ns - start_ns, stamps, values[:, axis]) for axis in range(3)])
