"""Why an object is what it is, as one page: beliefs, every look with its mask, what early commitment would have said,
its best view, its place on the plan, what stands near, and what may be pieces of the same thing."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from openbelief.grounded.options import GroundedOptions
from openbelief.node import ObjectNode
from openbelief.scene_graph import SceneGraph
from openbelief.views import View
from robot_app.pages.document import data_uri, document, text, write
from robot_app.pages.drawing import floor_data, still
from robot_app.pictures.sightings import crop_with_mask, view_with_thing
from robot_app.seen_in import best_view_of

CROP_PX, VIEW_PX = 300, 760
CROPS_SHOWN = 60  # the heaviest looks; the table has all
NEIGHBOURS = 6


def write_why_page(path: Path, graph: SceneGraph, node: ObjectNode, report: dict[str, Any]) -> None:
    """report: as `openbelief why --json` prints it. Raises Failure where it cannot be written."""
    title = f"{node.label or 'never named'} (object {node.id})"
    x, y, z = report["centroid"]
    where = f"in {node.room or 'no known room'}, centre {x:.2f} {y:.2f} {z:.2f} m, {node.trust}, "
    seen = f"{len(report['observations'])} observations in {report['frames']} frames"
    alarm = report["extent_alarm"]
    sections = [
        f'<header><h1>{text(title)}</h1><p class="soft">{text(where + seen)}</p></header><main class="why">',
        _section("May be more than one object", f"<p>{text(alarm)}</p>") if alarm else "",
        _concepts(report),
        _early(report),
        '<div class="two">',
        _best_view(graph, node),
        _place(graph, node),
        "</div>",
        _near(graph, node),
        _crops(node, report),
        _observations(report),
        "</main>",
    ]
    write(path, document(title, "\n".join(sections)))


def _section(heading: str, body: str) -> str:
    return f'<section class="card"><h2>{text(heading)}</h2>{body}</section>'


def _table(heads: Iterable[tuple[str, bool]], rows: Iterable[Iterable[Any]], names: Iterable[str] = ()) -> str:
    """heads: words, and whether they stand over numbers. Cells are words, or markup made here as a `_Markup`."""
    heads, kinds = list(heads), list(names)
    row_list = [list(row) for row in rows]
    kinds += [""] * (len(row_list) - len(kinds))
    head = "".join(f"<th{' class=n' if number else ''}>{text(words)}</th>" for words, number in heads)
    body = ""
    for row, kind in zip(row_list, kinds, strict=True):
        cells = "".join(
            f"<td{' class=n' if number else ''}>{cell if isinstance(cell, _Markup) else text(cell)}</td>"
            for cell, (_, number) in zip(row, heads, strict=True)
        )
        body += f"<tr{f' class={kind}' if kind else ''}>{cells}</tr>"
    return f'<div class="scroll"><table><tr>{head}</tr>{body}</table></div>'


class _Markup(str):
    """Markup written here, not words of unknown origin."""

    __slots__ = ()


def _concepts(report: dict[str, Any]) -> str:
    if not report["concepts"]:
        return _section("What it may be", "<p>No look at it was named.</p>")
    rows = [
        (
            c["label"],
            _Markup(f'<progress max="1" value="{c["belief"]:.4f}"></progress> {c["belief"]:.3f}'),
            f"{c['support']:.1f}",
            ", ".join(c["phrases"]),
        )
        for c in report["concepts"]
    ]
    heads = (("concept", False), ("belief", True), ("support", True), ("phrases", False))
    return _section("What it may be", _table(heads, rows))


def _early(report: dict[str, Any]) -> str:
    """What is left where one name is chosen while mapping (paper: the early-commitment baseline)."""
    concepts = report["concepts"]
    if not concepts:
        return ""
    total = sum(c["support"] for c in concepts)
    kept, thrown = concepts[0], concepts[1:]
    share = 1 - kept["support"] / total if total else 0.0
    lost = f"{len(thrown)} other concepts: {share:.0%} of the support"
    said = f"It would have said “{kept['label']}” and thrown away {lost}."
    rows = [(c["label"], f"{c['support']:.1f}", ", ".join(c["phrases"])) for c in concepts]
    heads = (("concept", False), ("support", True), ("phrases", False))
    return _section("Early commitment", f"<p>{text(said)}</p>" + _table(heads, rows, ["", *["thrown"] * len(thrown)]))


def _best_view(graph: SceneGraph, node: ObjectNode) -> str:
    view = best_view_of(graph.memory, node.id)
    if view is None or view.camera is None:
        return _section("Best view", f"<p>{text(graph.lacks or 'No keyframe shows it.')}</p>")
    masks = [o for o in node.observations if o.provenance and (o.recording, o.provenance.stamp_ns) == _key(view)]
    picture = view_with_thing(graph.memory.surroundings.picture(view.camera), view.sighting(node.id), masks, VIEW_PX)
    caption = f"{view.recording} at {view.stamp_ns} ns"
    image = f'<img class="crop" alt="best view" src="{data_uri(picture)}"><p class="small soft">{text(caption)}</p>'
    return _section("Best view", image)


def _key(view: View) -> tuple[str, int]:
    return view.recording, view.stamp_ns


def _place(graph: SceneGraph, node: ObjectNode) -> str:
    floor = next(f for f in graph.floors if any(node.id in room.objects for room in f.rooms))
    others = [
        graph.memory.objects[i]
        for room in floor.rooms
        for i in room.objects
        if i != node.id and not graph.memory.objects[i].background
    ]
    boxes = [(_box(other), "thing faint") for other in others] + [(_box(node), "thing chosen")]
    return _section("Where it stands", still(floor_data(floor, graph), boxes))


def _box(node: ObjectNode) -> list[float]:
    return np.asarray(node.aabb[:, :2], np.float64).ravel().tolist()


def _near(graph: SceneGraph, node: ObjectNode) -> str:
    others = [o for o in graph.memory.objects if o.id != node.id and not o.background]
    distances = [float(np.linalg.norm(o.centroid - node.centroid)) for o in others]
    order = np.argsort(distances, kind="stable")[:NEIGHBOURS]
    rows = [
        (others[k].id, others[k].label or "never named", f"{distances[k]:.2f}", others[k].room or "-") for k in order
    ]
    heads = (("object", True), ("label", False), ("metres away", True), ("room", False))
    body = _table(heads, rows) if rows else "<p>Nothing else was mapped.</p>"
    pieces = _fragments(graph, node)
    if pieces:
        said = [(o.id, o.label or "never named", f"{share:.0%}") for o, share in pieces]
        body += "<h2>May be pieces of the same thing</h2>"
        body += _table((("object", True), ("label", False), ("points in common", True)), said)
    else:
        body += '<p class="soft">No other object seems to be a piece of it.</p>'
    return _section("What stands near", body)


def _fragments(graph: SceneGraph, node: ObjectNode) -> list[tuple[ObjectNode, float]]:
    """Objects that overlap it and look like it, the most overlapping first."""
    pieces = graph.memory.table.pieces
    mine = (pieces.pair == node.id).any(axis=1) & (pieces.share >= GroundedOptions.fragment_overlap)
    others, shares = pieces.pair[mine].sum(axis=1) - node.id, pieces.share[mine]
    order = np.argsort(-shares, kind="stable")
    return [(graph.memory.objects[int(others[k])], float(shares[k])) for k in order]


def _crops(node: ObjectNode, report: dict[str, Any]) -> str:
    looks = sorted(zip(node.observations, report["observations"], strict=True), key=lambda pair: -pair[1]["weight"])
    figures = []
    for observation, said in looks[:CROPS_SHOWN]:
        crop = crop_with_mask(observation, CROP_PX)
        if crop is not None:
            caption = f"{said['phrase'] or 'no phrase'}: weight {said['weight']:.1f}, frame {said['frame']}"
            image = f'<img class="crop" alt="crop with its mask" src="{data_uri(crop)}">'
            figures.append(f"<figure>{image}<figcaption>{text(caption)}</figcaption></figure>")
    more = len(looks) - CROPS_SHOWN
    note = f'<p class="soft">and {more} lighter ones</p>' if more > 0 else ""
    body = f'<div class="crops">{"".join(figures)}</div>{note}' if figures else "<p>No crops were kept.</p>"
    return _section("Every look at it, heaviest first", body)


def _observations(report: dict[str, Any]) -> str:
    numbers = ("weight", "frame", "stamp, ns", "mask", "confidence", "points")
    heads = [("phrase", False), *((name, True) for name in numbers), ("concept", False), ("recording", False)]
    rows = [
        (
            *(o["phrase"] or "-", f"{o['weight']:.1f}", o["frame"], "-" if o["stamp_ns"] is None else o["stamp_ns"]),
            *(o["mask"], f"{o['confidence']:.2f}", o["points"], o["concept"] or "-", o["recording"] or "-"),
        )
        for o in sorted(report["observations"], key=lambda o: -o["weight"])
    ]
    return _section(f"{len(rows)} observations", _table(heads, rows))
