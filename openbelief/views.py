"""Which keyframes show which objects: in the image, and nothing measured before them (the depth image decides)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from openbelief.arrays import Array, read_only
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.observation import Intrinsics
from openbelief.pose import apply, inverse
from openbelief.surroundings import CameraView
from openbelief.visibility import depth_tolerance, in_image, thinned

POINTS = 200  # of an object: its share in view is as good from every k-th
SHARE_SEEN = 0.15  # of all its points, the far side too, which it hides itself
POINTS_SEEN = 5
POSE_ERROR_M = 0.05  # between a view's pose and the map


@dataclass(frozen=True)
class Sighting:
    """An object in a view. share: of its points seen. box: x0, y0, x1, y1 of them as shares of the image, None where
    only the evidence says that it was seen."""

    object_id: int
    share: float
    box: tuple[float, float, float, float] | None

    @property
    def worth(self) -> float:
        """How good a picture of it this is: much of it, and large."""
        x0, y0, x1, y1 = self.box or (0.0, 0.0, 0.0, 0.0)
        return self.share * float(np.sqrt((x1 - x0) * (y1 - y0)))


@dataclass(frozen=True, eq=False)
class View:
    """A frame and what it shows, by object id. T_map_camera: (4, 4), None where the file does not say."""

    recording: str
    stamp_ns: int
    sightings: tuple[Sighting, ...]
    T_map_camera: Array | None = field(repr=False, default=None)
    camera: CameraView | None = field(repr=False, default=None)

    @property
    def objects(self) -> tuple[int, ...]:
        return tuple(sighting.object_id for sighting in self.sightings)

    def sighting(self, object_id: int) -> Sighting | None:
        return next((s for s in self.sightings if s.object_id == object_id), None)


def views_of(memory: ObjectMemory, objects: Sequence[ObjectNode] | None = None) -> tuple[View, ...]:
    """Every keyframe, by recording and stamp, with those of the objects (all by default) that it shows.

    A file from before keyframes were kept gives the frames that evidence came from, without poses.
    """
    nodes = list(memory.objects if objects is None else objects)
    evidence = _evidence(nodes)
    if not memory.surroundings.views:
        keys = sorted({(f.recording, f.stamp_ns) for f in memory.frames if f.skipped is None} | set(evidence))
        return tuple(View(*key, tuple(Sighting(i, 0.0, None) for i in evidence.get(key, ()))) for key in keys)
    stack = _Stack(nodes)
    views = []
    for camera in memory.surroundings.views:
        depth_m, intrinsics = memory.surroundings.depth_m(camera)
        seen = {s.object_id: s for s in stack.seen(camera.T_map_camera, depth_m, intrinsics)}
        for i in evidence.get(camera.key, ()):
            seen.setdefault(i, Sighting(i, 0.0, None))
        sightings = tuple(seen[i] for i in sorted(seen))
        views.append(View(*camera.key, sightings, camera.T_map_camera, camera))
    return tuple(views)


def best_views(views: Sequence[View]) -> dict[int, int]:
    """Object id -> the index of the view that shows it best; objects that none shows are not there."""
    best: dict[int, tuple[float, int]] = {}
    for index, view in enumerate(views):
        for sighting in view.sightings:
            if sighting.object_id not in best or sighting.worth > best[sighting.object_id][0]:
                best[sighting.object_id] = (sighting.worth, index)
    return {object_id: index for object_id, (_, index) in best.items()}


def _evidence(nodes: Sequence[ObjectNode]) -> dict[tuple[str, int], list[int]]:
    """(recording, stamp) -> ids of the objects that have a mask in that frame."""
    seen: dict[tuple[str, int], list[int]] = {}
    for node in nodes:
        for key in sorted({(o.recording, o.provenance.stamp_ns) for o in node.observations if o.provenance}):
            seen.setdefault(key, []).append(node.id)
    return seen


class _Stack:
    """The points of many objects, so that a view is compared with all of them at once."""

    def __init__(self, nodes: Sequence[ObjectNode]) -> None:
        clouds = [thinned(node.points, POINTS).astype(np.float64) for node in nodes]
        self._ids = np.array([node.id for node in nodes], dtype=np.int64)
        self._points = read_only(np.concatenate(clouds)) if clouds else np.empty((0, 3))
        self._of = np.repeat(np.arange(len(nodes)), [len(cloud) for cloud in clouds])
        self._sizes = np.bincount(self._of, minlength=len(nodes))
        self._centres = np.array([cloud.mean(axis=0) for cloud in clouds]).reshape(-1, 3)
        self._radii = np.array([np.linalg.norm(c - c.mean(axis=0), axis=1).max() for c in clouds])

    def seen(self, T_map_camera: Array, depth_m: Array, camera: Intrinsics) -> list[Sighting]:
        """Sightings in one view."""
        T_camera_map = inverse(T_map_camera)
        near = self._may_be_seen(apply(T_camera_map, self._centres), float(depth_m.max(initial=0.0)))
        chosen = near[self._of]
        points, of = apply(T_camera_map, self._points[chosen]), self._of[chosen]
        shown, column, row = in_image(points, camera)
        measured = depth_m[row, column]
        shown &= (measured > 0) & (np.abs(measured - points[:, 2]) <= depth_tolerance(points, POSE_ERROR_M))
        counts = np.bincount(of[shown], minlength=len(self._ids))
        enough = (counts >= np.minimum(POINTS_SEEN, self._sizes)) & (counts >= SHARE_SEEN * self._sizes)
        scale = np.array([camera.width, camera.height, camera.width, camera.height], dtype=float)
        sightings = []
        for i in np.flatnonzero(enough & (counts > 0)):
            mine = shown & (of == i)
            x, y = column[mine], row[mine]
            box = np.array([x.min(), y.min(), x.max() + 1, y.max() + 1]) / scale
            x0, y0, x1, y1 = box.tolist()
            sightings.append(Sighting(int(self._ids[i]), float(counts[i] / self._sizes[i]), (x0, y0, x1, y1)))
        return sightings

    def _may_be_seen(self, centres_camera: Array, farthest_m: float) -> Array:
        """(N,) bool: not behind the camera and not beyond all that it measured."""
        z = centres_camera[:, 2]
        return (z + self._radii > 0) & (z - self._radii < farthest_m + POSE_ERROR_M + 1.0)
