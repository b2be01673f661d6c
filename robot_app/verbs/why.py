"""Every phrase, weight, frame and mask behind an object, and the belief that follows from them.

OBJECT is the number that `openbelief query` shows. --crops writes what each mask looked like; --html makes one page of
all of it. --asked SENTENCE says what the thing, its place and its relations added for this object, where it ranks, and
what the paper's consensus would have answered.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.arguments import a_pose
from robot_app.cli import Failure, print_json
from robot_app.tables import add_wide

if TYPE_CHECKING:
    from openbelief.memory import ObjectMemory, ObjectNode
    from openbelief.observation import Observation

EXAMPLE = "openbelief why demo-out/site.belief 0"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("object", type=int, metavar="OBJECT", help="object id, as shown by `openbelief query`")
    parser.add_argument("--crops", type=Path, metavar="DIR", help="write the JPEG crop of every mask to DIR")
    parser.add_argument("--html", type=Path, metavar="FILE", help="all of it as one page, with pictures and its place")
    parser.add_argument("--asked", metavar="SENTENCE", help="how this object answers it, by the readout grounded")
    parser.add_argument("--at", type=a_pose, metavar="X,Y[,YAW]", help="where you stand, with --asked: metres, degrees")
    add_wide(parser)


def run(options: argparse.Namespace) -> None:
    from robot_app.memories import open_memory, open_with_encoder
    from robot_app.outputs import require_writable

    if options.html:
        require_writable(options.html)
    memory = open_with_encoder(options.memory) if options.asked else open_memory(options.memory)
    if not 0 <= options.object < len(memory.objects):
        most = f"it holds 0 to {len(memory.objects) - 1}" if memory.objects else "it holds none"
        raise Failure(f"{options.memory} has no object {options.object}: {most}.")
    node = memory.objects[options.object]
    report = explain(memory, node) | {"memory": str(options.memory)}
    if options.crops:
        report["crops"] = [str(path) for path in _write_crops(node, options.crops)]
    if options.html:
        from openbelief.scene_graph import scene_graph
        from robot_app.pages.why import write_why_page

        write_why_page(options.html, scene_graph(memory), node, report)
        report["html"] = str(options.html)
    if options.asked:
        report["asked"] = _asked(memory, node.id, options)
    print_json(report) if options.json else _show(report, wide=options.wide)


def _asked(memory: ObjectMemory, object_id: int, options: argparse.Namespace) -> dict[str, Any]:
    """What each part of the sentence added for one object; rank None where it cannot be meant (a wall, a floor)."""
    from robot_app.answers import answer_as_json, request_of, terms_as_json

    asked = memory.asked(request_of(options.asked))
    answer = memory.answer(asked, viewer=options.at)
    mine = [(rank, c) for rank, c in enumerate(answer.candidates, start=1) if c.object_id == object_id]
    nothing: dict[str, Any] = {"terms": {}, "head": None, "contradicted": None}
    rank, terms = (mine[0][0], terms_as_json(mine[0][1])) if mine else (None, nothing)
    return {"sentence": options.asked, "rank": rank, **terms, **answer_as_json(memory, answer, asked)}


def explain(memory: ObjectMemory, node: ObjectNode) -> dict[str, Any]:
    """The node, its concepts and each observation, as JSON."""
    from openbelief.retrieval import visual_weight

    return {
        "object_id": node.id,
        "label": node.label,
        "trust": node.trust,
        "background": node.background,
        "heaviest_phrase": node.heaviest_phrase,
        "lambda": visual_weight(node, memory.parameters) if memory.feature_text_aligned else 0.0,
        "frames": node.frames,
        "centroid": node.centroid.tolist(),
        "aabb": node.aabb.tolist(),
        "room": node.room,
        "extent_alarm": next((a.because for a in memory.extent_alarms([node])), None),
        "concepts": [
            {"label": c.label, "phrases": list(c.phrases), "support": c.support, "belief": c.belief}
            for c in node.concepts
        ],
        "observations": [_explain_observation(memory, node, o) for o in node.observations],
    }


def _explain_observation(memory: ObjectMemory, node: ObjectNode, o: Observation) -> dict[str, Any]:
    from openbelief.belief import weight
    from openbelief.phrase import comparable

    concept = next((c for c in node.concepts if comparable(o.phrase) in c.phrases), None)
    return {
        "recording": o.recording,
        "frame": o.frame,
        "stamp_ns": o.provenance.stamp_ns if o.provenance else None,
        "mask": o.mask,
        "bbox": list(o.provenance.bbox) if o.provenance else None,
        "phrase": o.phrase,
        "concept": concept.label if concept else None,
        "belief": concept.belief if concept else None,
        "weight": weight(o, memory.parameters),
        "confidence": o.confidence,
        "points": o.n,
    }


def _write_crops(node: ObjectNode, folder: Path) -> list[Path]:
    from robot_app.outputs import writing

    written: list[Path] = []
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for o in node.observations:
            if o.provenance and o.provenance.crop_jpeg:
                path = folder / f"object{node.id}_frame{o.frame}_mask{o.mask}.jpg"
                if path in written:  # of another recording, or a repeat
                    path = path.with_stem(f"{path.stem}_{len(written)}")
                path.write_bytes(o.provenance.crop_jpeg)
                written.append(path)
    return written


FITTING = ("phrase", "weight", "frame", "mask", "confidence", "concept")  # of an observation, in 80 columns


def _show(report: dict[str, Any], *, wide: bool) -> None:
    from robot_app.tables import cell, chosen, show

    show(_concepts(report), wide=wide)
    show(chosen(_observations(report), FITTING, wide=wide), wide=wide)
    x, y, z = report["centroid"]
    room = f" in the {cell(report['room'])}" if report["room"] else ""
    print(f"centre {x:.2f} {y:.2f} {z:.2f} m{room}, weight of the visual branch {report['lambda']:g}")
    if report.get("asked"):
        print("\n".join(cell(line).plain for line in _asked_lines(report["asked"])))
    if report["extent_alarm"]:
        print(f"may be more than one object: {report['extent_alarm']}")
    if report.get("html"):
        print(f"page: {cell(report['html'])}")
    if report.get("crops"):
        print(f"{len(report['crops'])} crops written, the first is {cell(report['crops'][0])}")


def _asked_lines(asked: dict[str, Any]) -> list[str]:
    if asked["rank"] is None:
        return [f"{asked['sentence']!r} cannot mean this object."]
    added = ", ".join(f"{name} {value:+.2f}" for name, value in asked["terms"].items() if value)
    lines = [f"asked {asked['sentence']!r}: rank {asked['rank']}, likeness {asked['head']:.2f}; {added}"]
    if asked["contradicted"]:
        lines.append(f"of what was said of that colour, size or material {asked['contradicted']:.0%} is another")
    if asked["consensus"]:
        other = asked["consensus"]
        lines.append(f"the paper's consensus would have answered {other['label']} (object {other['object_id']})")
    return lines


def _concepts(report: dict[str, Any]) -> Any:
    from rich.table import Table

    from robot_app.tables import cell, number

    title = f"object {report['object_id']}: {report['label'] or 'never named'} ({report['trust']})"
    table = Table("belief", "support", "concept", "phrases", title=cell(title), title_justify="left")
    for c in report["concepts"]:
        phrases = ", ".join(c["phrases"])
        table.add_row(number(c["belief"]), number(c["support"], 1), cell(c["label"]), cell(phrases))
    return table


def _observations(report: dict[str, Any]) -> Any:
    from rich.table import Table

    from robot_app.tables import cell, number

    headings = ("phrase", "weight", "frame", "mask", "confidence", "points", "concept", "belief", "recording")
    table = Table(*headings, title=f"{len(report['observations'])} observations", title_justify="left")
    for o in report["observations"]:
        table.add_row(
            cell(o["phrase"] or "-"),
            number(o["weight"], 1),
            str(o["frame"]),
            str(o["mask"]),
            number(o["confidence"], 2),
            str(o["points"]),
            cell(o["concept"] or "-"),
            number(o["belief"]),
            cell(o["recording"]),
        )
    return table
