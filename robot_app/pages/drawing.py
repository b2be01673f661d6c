"""A floor as numbers that a page draws: its outline, rooms, walls as a picture, and where the camera walked."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from openbelief.scene_graph import FloorNode, SceneGraph
from openbelief.traversability import OCCUPIED, OccupancyGrid
from robot_app.pages.document import data_uri, text

MARGIN_M = 0.5
WALL_BGRA = (93, 83, 70, 190)


def floor_data(floor: FloorNode, graph: SceneGraph) -> dict[str, Any]:
    """box: x, y, width, height of the drawing, metres, y downwards as a page has it."""
    rooms = [room.room for room in floor.rooms if room.room is not None]
    return {
        "id": floor.floor.id,
        "height_m": floor.floor.height_m,
        "box": _box(floor, graph),
        "rooms": [
            {"name": r.name, "polygon": r.polygon_xy.tolist(), "because": r.because or "given by a person"}
            for r in rooms
        ],
        "walls": None if floor.floor.grid is None else _walls(floor.floor.grid),
        "walks": _walks(floor, graph),
    }


def still(data: dict[str, Any], boxes: list[tuple[list[float], str]]) -> str:
    """The floor as an SVG element. boxes: (x0, y0, x1, y1) with their class."""
    parts = [f'<svg class="still" viewBox="{" ".join(f"{v:.3f}" for v in data["box"])}" role="img">']
    for k, room in enumerate(data["rooms"]):
        points = " ".join(f"{x:.3f},{-y:.3f}" for x, y in room["polygon"])
        parts.append(f'<polygon class="room room{k % 8}" points="{points}"/>')
    if data["walls"]:
        w = data["walls"]
        where = f'x="{w["x"]:.3f}" y="{w["y"]:.3f}" width="{w["width"]:.3f}" height="{w["height"]:.3f}"'
        parts.append(f'<image href="{w["src"]}" {where} preserveAspectRatio="none"/>')
    for (x0, y0, x1, y1), name in boxes:
        where = f'x="{x0:.3f}" y="{-y1:.3f}" width="{max(x1 - x0, 0.05):.3f}" height="{max(y1 - y0, 0.05):.3f}"'
        parts.append(f'<rect class="{name}" {where}/>')
    for room in data["rooms"]:
        x, y = (np.min(room["polygon"], axis=0) + np.max(room["polygon"], axis=0)) / 2
        parts.append(f'<text class="roomname" x="{x:.3f}" y="{-y:.3f}">{text(room["name"])}</text>')
    return "\n".join([*parts, "</svg>"])


def _box(floor: FloorNode, graph: SceneGraph) -> list[float]:
    corners = [room.room.polygon_xy for room in floor.rooms if room.room is not None]
    corners += [graph.memory.objects[i].aabb[:, :2] for room in floor.rooms for i in room.objects]
    if not corners:
        return [0.0, 0.0, 1.0, 1.0]
    whole = np.concatenate([np.asarray(c, np.float64) for c in corners])
    (x0, y0), (x1, y1) = whole.min(axis=0) - MARGIN_M, whole.max(axis=0) + MARGIN_M
    return [float(x0), float(-y1), float(x1 - x0), float(y1 - y0)]


def _walls(grid: OccupancyGrid) -> dict[str, Any]:
    rows, columns = grid.cells.shape
    image = np.zeros((rows, columns, 4), np.uint8)
    image[grid.cells >= OCCUPIED] = WALL_BGRA
    x, y = grid.origin_xy
    width, height = columns * grid.resolution_m, rows * grid.resolution_m
    src = data_uri(cv2.imencode(".png", image[::-1])[1].tobytes(), "png")
    return {"src": src, "x": x, "y": -(y + height), "width": width, "height": height}


def _walks(floor: FloorNode, graph: SceneGraph) -> list[list[list[float]]]:
    walks: dict[str, list[list[float]]] = {}
    for view in graph.memory.surroundings.views:
        if floor.floor.holds(view.T_map_camera[2, 3] - 0.3):
            walks.setdefault(view.recording, []).append(np.round(view.T_map_camera[:2, 3], 3).tolist())
    return list(walks.values())
