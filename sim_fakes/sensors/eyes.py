"""The simulated robot's sensors in a rendered flat: images with a D435's depth noise, and lidar scans."""

from __future__ import annotations

from drivers.ports import LidarCloud
from openbelief.arrays import Array
from openbelief.observation import Intrinsics
from sim_fakes.sensors.depth_noise import noisy_depth
from sim_fakes.sensors.lidar_scan import scan
from sim_fakes.world.renderer import Renderer


class RenderedEyes:
    """The same seed, pose and stamp give the same images and points."""

    def __init__(self, renderer: Renderer, intrinsics: Intrinsics, *, seed: int) -> None:
        self._renderer, self._intrinsics, self._seed = renderer, intrinsics, seed

    def image(self, T_map_camera: Array, stamp_ns: int) -> tuple[Array, Array]:
        """(h, w, 3) uint8 RGB and (h, w) float32 metres."""
        seen = self._renderer.render(T_map_camera, self._intrinsics)
        return seen.color, noisy_depth(seen.depth_m, seen.color, seed=self._seed, stamp_ns=stamp_ns)

    def cloud(self, T_map_lidar: Array, stamp_ns: int) -> LidarCloud:
        """Points in livox_frame."""
        return scan(self._renderer, T_map_lidar, seed=self._seed, stamp_ns=stamp_ns)
