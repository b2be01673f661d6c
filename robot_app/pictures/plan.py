"""The site from above: walls, rooms, objects and where the camera walked, one drawing for each floor."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from openbelief.arrays import Array
from openbelief.node import ObjectNode
from openbelief.phrase import printable
from openbelief.scene_graph import FloorNode, SceneGraph
from openbelief.traversability import OCCUPIED, OccupancyGrid
from robot_app.outputs import writing
from robot_app.pictures.style import CONFIRMED, FAINT, INK, OTHER, PAPER, boxes_for_unknown_letters, label_of, spread

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.text import Text

ROOM_COLOURS = ("#dbe9f6", "#fbe6cf", "#dff0dc", "#f6dbe3", "#e6dff3", "#f5f0cf", "#d6efee", "#ece0d6")
WALL, PATH = "#4a5862", "#8a6fb0"
LABELLED = 120  # of more objects the boxes alone are drawn
KINDS = (".png", ".svg")


def draw_plan(graph: SceneGraph, ranks: Mapping[int, int] | None = None, title: str | None = None) -> Figure:
    """ranks: object id -> its place, for ranked candidates; others are then drawn faintly."""
    from matplotlib.figure import Figure

    floors = graph.floors
    figure = Figure(figsize=(10.5 * len(floors), 9), layout="constrained")
    labels: list[tuple[Axes, list[Text]]] = []
    for axes, floor in zip(np.atleast_1d(figure.subplots(1, len(floors))), reversed(floors), strict=True):
        labels.append((axes, _draw_floor(axes, floor, graph, ranks or {})))
        height = f"floor {floor.floor.id}, z = {floor.floor.height_m:.2f} m"
        axes.set_title(height if len(floors) > 1 else "", loc="right", color=INK, fontsize=10)
    if labels:
        _draw_legend(figure, bool(ranks))
    if title:
        figure.suptitle(printable(title, 100), color=INK, parse_math=False)
    for axes, texts in labels:
        spread(axes, texts, drop=not ranks)  # a candidate is never left out
    return figure


def write_plan(path: Path, figure: Figure) -> None:
    """As the name's ending says. The same plan gives the same bytes. Raises Failure where it cannot be written."""
    import matplotlib

    svg = matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "openbelief"})
    with writing(path), svg, boxes_for_unknown_letters():
        figure.savefig(path, dpi=110, facecolor=PAPER, metadata={"Date": None} if path.suffix == ".svg" else None)


def _draw_floor(axes: Axes, floor: FloorNode, graph: SceneGraph, ranks: Mapping[int, int]) -> list[Text]:
    from matplotlib.patches import Polygon

    if floor.floor.grid is not None:
        _draw_walls(axes, floor.floor.grid)
    rooms = [room.room for room in floor.rooms if room.room is not None]
    for k, room in enumerate(rooms):
        colour = ROOM_COLOURS[k % len(ROOM_COLOURS)]
        axes.add_patch(Polygon(room.polygon_xy, facecolor=colour, edgecolor=FAINT, linewidth=0.8, zorder=0))
    _draw_path(axes, floor, graph)
    nodes = [graph.memory.objects[i] for room in floor.rooms for i in room.objects]
    nodes = [node for node in nodes if not node.background or node.id in ranks]
    for node in nodes:
        _draw_box(axes, node, ranks)
    named = sorted((n for n in nodes if n.id in ranks), key=lambda n: ranks[n.id])
    texts = [_label(axes, n, f"{ranks[n.id]}. {label_of(n)} ({n.id})", 10, CONFIRMED) for n in named]
    names = [_room_name(axes, room.name, room.polygon_xy) for room in rooms]
    if not ranks and len(nodes) <= LABELLED:
        texts += [_label(axes, n, label_of(n), 7, INK) for n in sorted(nodes, key=lambda n: -len(n.observations))]
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x in the map, m", color=INK)
    axes.set_ylabel("y in the map, m", color=INK)
    return names + texts


def _draw_legend(figure: Figure, ranked: bool) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles: list[Line2D | Patch] = [
        Patch(facecolor=WALL, alpha=0.75, label="walls and what else stands on the map"),
        Patch(facecolor=OTHER, edgecolor=INK, linewidth=0.6, alpha=0.55, label="mapped objects, as boxes"),
        Line2D([], [], color=PATH, marker=".", linewidth=1.2, label="where the camera walked"),
    ]
    if ranked:
        handles.insert(0, Patch(facecolor=CONFIRMED, edgecolor=INK, label="candidates, best first (object)"))
    figure.legend(handles=handles, loc="outside lower center", ncol=4, frameon=False, fontsize=9)  # never cut off


def _draw_walls(axes: Axes, grid: OccupancyGrid) -> None:
    height, width = grid.cells.shape
    x, y = grid.origin_xy
    image = np.zeros((height, width, 4))
    image[grid.cells >= OCCUPIED] = (*_rgb(WALL), 0.75)
    extent = (x, x + width * grid.resolution_m, y, y + height * grid.resolution_m)
    axes.imshow(image, origin="lower", extent=extent, interpolation="nearest", zorder=1)


def _draw_path(axes: Axes, floor: FloorNode, graph: SceneGraph) -> None:
    """A line for each recording, in the order of its stamps."""
    walks: dict[str, list[Array]] = {}
    for view in graph.memory.surroundings.views:
        if floor.floor.holds(view.T_map_camera[2, 3] - 0.3):
            walks.setdefault(view.recording, []).append(view.T_map_camera[:2, 3])
    for points in walks.values():
        x, y = np.array(points).T
        axes.plot(x, y, color=PATH, linewidth=1.2, marker=".", markersize=4, alpha=0.8, zorder=2)
        axes.plot(x[0], y[0], color=PATH, marker="o", markersize=7, zorder=2)


def _draw_box(axes: Axes, node: ObjectNode, ranks: Mapping[int, int]) -> None:
    from matplotlib.patches import Rectangle

    low, high = np.asarray(node.aabb, np.float64)[:, :2]
    ranked = node.id in ranks
    colour, alpha = (CONFIRMED, 0.9) if ranked else (OTHER, 0.25 if ranks else 0.55)
    width, height = (high - low).tolist()
    box = Rectangle((low[0], low[1]), width, height, facecolor=colour, edgecolor=INK, linewidth=0.6, alpha=alpha)
    box.set_zorder(4 if ranked else 3)
    axes.add_patch(box)


def _label(axes: Axes, node: ObjectNode, words: str, size: float, colour: str) -> Text:
    x, y = node.centroid[:2].tolist()
    box = {"boxstyle": "round,pad=0.15", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.7}
    return axes.text(
        x, y, words, fontsize=size, color=colour, ha="center", va="center", parse_math=False, bbox=box, zorder=6
    )


def _room_name(axes: Axes, name: str, polygon: Array) -> Text:
    x, y = ((polygon.min(axis=0) + polygon.max(axis=0)) / 2).tolist()
    return axes.text(
        x, y, name, fontsize=13, weight="bold", color=INK, ha="center", va="center", parse_math=False, zorder=7
    )


def _rgb(colour: str) -> tuple[float, ...]:
    return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
