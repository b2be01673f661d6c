"""What of a site does not change while a page looks at it: the map as a picture, the objects, rooms and zones."""

from __future__ import annotations

from typing import Any

import numpy as np

from behaviors.safety_policy import SafetyPolicy
from openbelief.memory import ObjectMemory
from openbelief.node import ObjectNode
from openbelief.traversability import FREE, OccupancyGrid

JPEG_QUALITY = 80
SHADE_FREE, SHADE_UNKNOWN, SHADE_OCCUPIED = 255, 128, 0  # the page gives each of them its theme's colour


def site_json(memory: ObjectMemory, safety: SafetyPolicy) -> dict[str, Any]:
    """Objects as boxes in the map frame, metres; walls and floors are not among them."""
    return {
        "memory_hash": memory.content_hash,
        "objects": [_object_json(node) for node in memory.objects if not node.background],
        "rooms": [room.as_json() for room in memory.rooms],
        "keep_out": [[list(point) for point in polygon] for polygon in safety.keep_out],
        "allowed": [list(point) for point in safety.allowed],
    }


def grid_json(grid: OccupancyGrid) -> dict[str, Any]:
    height, width = grid.cells.shape
    x, y = grid.origin_xy
    resolution = grid.resolution_m
    return {"width": width, "height": height, "resolution_m": resolution, "origin": [x, y], "stamp": str(grid.stamp_ns)}


def grid_png(grid: OccupancyGrid) -> bytes:
    """One grey pixel for each cell, north up."""
    import cv2

    shades = np.full(grid.cells.shape, SHADE_UNKNOWN, np.uint8)
    shades[grid.cells == FREE] = SHADE_FREE
    shades[grid.cells > FREE] = SHADE_OCCUPIED
    return bytes(cv2.imencode(".png", shades[::-1])[1])


def jpeg(color: np.ndarray) -> bytes:
    """(h, w, 3) uint8 RGB."""
    import cv2

    return bytes(cv2.imencode(".jpg", color[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1])


def _object_json(node: ObjectNode) -> dict[str, Any]:
    low, high = np.asarray(node.aabb, np.float64).round(3).tolist()
    centroid = [round(float(v), 3) for v in node.centroid]
    return {"id": node.id, "label": node.label, "room": node.room, "low": low, "high": high, "centroid": centroid}
