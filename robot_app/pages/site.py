"""The whole site as one page: the plan of each floor, a search over labels, rooms and phrases, evidence on click."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from openbelief.belief import phrase_support
from openbelief.node import ObjectNode
from openbelief.observation import Observation
from openbelief.phrase import printable
from openbelief.scene_graph import SceneGraph
from robot_app.pages.document import ASSETS, data_uri, document, text, write
from robot_app.pages.drawing import floor_data
from robot_app.pictures.sightings import crop_with_mask, view_with_thing

CROP_PX, SMALL_CROP_PX, MANY = 220, 130, 500  # of more objects the crops are smaller
VIEW_PX = 360
PHRASES = 12  # of a concept

BODY = """<header><h1>{title}</h1><p class="soft">{said}</p></header>
<main class="site">
<section class="card plan" aria-label="plan"><div class="tabs" id="tabs"></div><svg id="plan"></svg></section>
<div class="side">
<section class="card found" aria-label="search">
<label for="ask" class="small soft">Search labels, rooms and phrases</label>
<input type="search" id="ask" autocomplete="off" spellcheck="false">
<p class="small soft" id="count" role="status"></p>
<ol id="list"></ol>
</section>
<section class="card detail" id="detail" aria-live="polite">
<p class="soft">Choose an object on the plan or in the list.</p>
</section>
</div>
</main>"""


def write_site_page(path: Path, graph: SceneGraph, name: str) -> None:
    """Raises Failure where it cannot be written."""
    memory = graph.memory
    views = len(memory.surroundings.views)
    said = (
        f"{len(memory.objects)} objects, {len(memory.rooms)} rooms, {views} keyframes, memory {memory.state_hash[:12]}."
    )
    body = BODY.format(title=text(name), said=" ".join(map(text, filter(None, (said, graph.lacks)))))
    script = (ASSETS / "site.js").read_text(encoding="utf-8")
    write(path, document(name, body, script=script, data=site_data(graph)))


def site_data(graph: SceneGraph) -> dict[str, Any]:
    """All that the page shows; words are made printable here and put in as text there."""
    floor_of = {i: floor.floor.id for floor in graph.floors for room in floor.rooms for i in room.objects}
    side_px = CROP_PX if len(graph.memory.objects) <= MANY else SMALL_CROP_PX
    objects = [_object(graph, node, floor_of.get(node.id, 0), side_px) for node in graph.memory.objects]
    used = sorted({o["view"] for o in objects if o["view"] is not None and not o["background"]})
    return {
        "floors": [floor_data(floor, graph) for floor in graph.floors],
        "objects": objects,
        "views": [{"recording": printable(v.recording), "stamp_ns": str(v.stamp_ns)} for v in graph.views],
        "pictures": {str(i): _picture(graph, i) for i in used},
    }


def _object(graph: SceneGraph, node: ObjectNode, floor: int, side_px: int) -> dict[str, Any]:
    observations = list(node.observations)
    weights = phrase_support(observations, graph.memory.parameters)
    best = graph.best_view.get(node.id)
    sighting = None if best is None else graph.views[best].sighting(node.id)
    return {
        "id": node.id,
        "label": printable(node.label or "never named"),
        "room": printable(node.room) if node.room else None,
        "floor": floor,
        "background": node.background,
        "box": np.round(node.aabb[:, :2].astype(np.float64), 3).ravel().tolist(),
        "centre": np.round(node.centroid, 3).tolist(),
        "trust": node.trust,
        "seen": len(observations),
        "frames": node.frames,
        "crop": None if node.background else data_uri(_best_crop(observations, side_px)),
        "view": best,
        "frame": None if sighting is None or sighting.box is None else [round(v, 4) for v in sighting.box],
        "concepts": [
            {
                "label": printable(c.label),
                "belief": c.belief,
                "support": c.support,
                "phrases": [[printable(p), weights.get(p, 0.0)] for p in c.phrases[:PHRASES]],
            }
            for c in node.concepts
        ],
    }


def _best_crop(observations: list[Observation], side_px: int) -> bytes | None:
    """Of the surest look with most points: the one a person recognises it by."""
    for observation in sorted(observations, key=lambda o: (-o.confidence * o.n**0.5, o.key)):
        if (crop := crop_with_mask(observation, side_px)) is not None:
            return crop
    return None


def _picture(graph: SceneGraph, index: int) -> str | None:
    camera = graph.views[index].camera
    if camera is None:
        return None
    return data_uri(view_with_thing(graph.memory.surroundings.picture(camera), None, (), VIEW_PX))
