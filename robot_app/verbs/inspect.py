"""What a memory holds: floors, their rooms with the objects in them, and the views that show these.

Rooms that nobody gave are found on the map and named by what stands in them; the words behind a name say why.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.scene_graph import SceneGraph

EXAMPLE = "openbelief inspect demo-out/site.belief --plan demo-out/plan.png"
OBJECTS_SHOWN = 12  # of a room


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("--plan", type=Path, metavar="FILE.png|svg", help="draw rooms, objects, walls and the walk")
    parser.add_argument("--html", type=Path, metavar="FILE", help="the whole site as one page that needs nothing else")
    parser.add_argument("--view", type=int, metavar="N", help="tell of view N alone: where it was, what it shows")
    parser.add_argument("--out", type=Path, metavar="FILE.jpg", help="with --view: write its picture")


def run(options: argparse.Namespace) -> None:
    from openbelief.scene_graph import scene_graph
    from robot_app.memories import open_memory
    from robot_app.outputs import require_kind, require_writable

    if options.out and options.view is None:
        raise Failure("--out writes the picture of a view: name one with --view N.")
    for path in filter(None, (options.plan, options.html, options.out)):
        require_writable(path)
    if options.plan:
        require_kind(options.plan, "--plan", (".png", ".svg"))
    graph = scene_graph(open_memory(options.memory))
    if options.view is not None:
        _view(graph, options)
        return
    written = {}
    if options.plan:
        from robot_app.pictures.plan import draw_plan, write_plan

        write_plan(options.plan, draw_plan(graph))
        written["plan"] = str(options.plan)
    if options.html:
        from robot_app.pages.site import write_site_page

        write_site_page(options.html, graph, options.memory.name)
        written["html"] = str(options.html)
    if options.json:
        print_json(graph.as_json() | {"memory": str(options.memory), "lacks": graph.lacks} | written)
        return
    _show(graph)
    for kind, path in written.items():
        print(f"{kind}: {path}")


def _show(graph: SceneGraph) -> None:
    from rich.console import Console
    from rich.tree import Tree

    from robot_app.tables import cell

    memory = graph.memory
    views = len(memory.surroundings.views)
    tree = Tree(cell(f"{len(memory.objects)} objects, {len(memory.rooms)} rooms, {views} keyframes"))
    for floor in graph.floors:
        branch = tree.add(f"floor {floor.floor.id} at {floor.floor.height_m:.2f} m")
        for room in floor.rooms:
            why = "" if room.room is None else " (given)" if room.room.given else f" ({room.room.because})"
            named = [memory.objects[i] for i in room.objects if not memory.objects[i].background]
            leaf = branch.add(cell(f"{room.name or 'in no room'}: {len(named)} objects{why}"))
            for node in named[:OBJECTS_SHOWN]:
                leaf.add(cell(f"{node.id} {node.label or 'never named'}"))
            if len(named) > OBJECTS_SHOWN:
                leaf.add(f"and {len(named) - OBJECTS_SHOWN} more (--json lists them)")
    Console().print(tree)
    if graph.lacks:
        print(graph.lacks)


def _view(graph: SceneGraph, options: argparse.Namespace) -> None:
    from robot_app.outputs import writing

    views = graph.views
    if not 0 <= options.view < len(views):
        most = f"it holds 0 to {len(views) - 1}" if views else "it holds none"
        raise Failure(f"{options.memory} has no view {options.view}: {most}.")
    view = views[options.view]
    report = graph.as_json()["views"][options.view] | {"view": options.view}
    if options.out:
        if view.camera is None:
            raise Failure(f"{options.memory} holds no picture of view {options.view}. {graph.lacks}")
        with writing(options.out):
            options.out.write_bytes(graph.memory.surroundings.picture(view.camera))
        report["picture"] = str(options.out)
    if options.json:
        print_json(report)
        return
    from robot_app.tables import cell

    where = ""
    if view.T_map_camera is not None:
        where = " at ({:.2f}, {:.2f}, {:.2f}) m".format(*view.T_map_camera[:3, 3])
    print(cell(f"view {options.view}: frame {view.stamp_ns} of {view.recording}{where}"))
    for object_id in view.objects:
        print(cell(f"  {object_id} {graph.memory.objects[object_id].label or 'never named'}"))
