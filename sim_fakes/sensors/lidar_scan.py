"""Points of a MID-360 in the simulated flat: a rosette that never repeats, with range noise."""

from __future__ import annotations

import numpy as np

from drivers.ports import LidarCloud
from openbelief.arrays import Array
from sim_fakes.world.renderer import Renderer

FRAME_ID = "livox_frame"
POINTS = 3000  # a scan; the sensor itself sends 20 000 in 0.1 s
ELEVATION_RAD = (float(np.deg2rad(-7)), float(np.deg2rad(52)))  # in the sensor's own frame, which hangs upside down
RANGE_M = (0.1, 40.0)
NOISE_M = 0.02
GOLDEN = (np.sqrt(5) - 1) / 2


def directions(stamp_ns: int) -> Array:
    """(3000, 3) unit rays of the livox frame: evenly spread, another set at every stamp."""
    k = np.arange(POINTS) + (stamp_ns // 1000) % 1_000_003 * 0.618
    azimuth = 2 * np.pi * (k * GOLDEN % 1)
    low, high = np.sin(ELEVATION_RAD)
    z = low + (high - low) * (k * (np.sqrt(2) - 1) % 1)
    radius = np.sqrt(1 - z * z)
    return np.column_stack((radius * np.cos(azimuth), radius * np.sin(azimuth), z))


def scan(renderer: Renderer, T_map_lidar: Array, *, seed: int, stamp_ns: int) -> LidarCloud:
    """One cloud in the livox frame, no-returns removed. The same seed and stamp give the same points."""
    rng = np.random.default_rng([seed, stamp_ns & 0xFFFFFFFF, stamp_ns >> 32, 0x360])
    rays = directions(stamp_ns)
    ranges = renderer.scan(T_map_lidar, rays)
    noisy = ranges + NOISE_M * rng.standard_normal(len(ranges))
    seen = np.isfinite(ranges) & (noisy > RANGE_M[0]) & (noisy < RANGE_M[1])
    return LidarCloud(stamp_ns, (rays[seen] * noisy[seen, None]).astype(np.float32), FRAME_ID)
