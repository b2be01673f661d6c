"""Rank the objects of a memory for a sentence, best first, with the evidence for each.

The whole sentence counts: the thing, its place, what it stands next to, which one, and what it is not; what could not
be used is said. --readout consensus, early or belief ranks by the paper's heads instead. Walls, floors and the like are
left out unless they are asked for by name.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from openbelief.phrase import printable
from robot_app.answers import READOUTS
from robot_app.arguments import a_pose, from_one
from robot_app.cli import Failure, print_json
from robot_app.tables import add_wide

if TYPE_CHECKING:
    from openbelief.memory import Candidate, ObjectMemory
    from openbelief.request.encoded import EncodedRequest

EXAMPLE = 'openbelief query demo-out/site.belief "red chair"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("sentence", help='what to look for, in plain words: "take me to the lamp"')
    parser.add_argument("--readout", choices=READOUTS, default="grounded", help="default grounded")
    parser.add_argument(
        "--at", type=a_pose, metavar="X,Y[,YAW]", help="where you stand, metres and degrees: for 'nearest' and 'left'"
    )
    parser.add_argument(
        "--limit", type=from_one, default=10, metavar="N", help="show at most N candidates (default 10)"
    )
    parser.add_argument("--picture", type=Path, metavar="FILE.png|svg", help="draw the candidates on the plan")
    parser.add_argument("--views", action="store_true", help="where was the best seen: its views, newest first")
    parser.add_argument("--views-dir", type=Path, metavar="DIR", help="where --views writes pictures (default views)")
    add_wide(parser)


def run(options: argparse.Namespace) -> None:
    from robot_app.answers import request_of
    from robot_app.memories import open_with_encoder

    _require_outputs(options)
    request = request_of(options.sentence)
    memory = open_with_encoder(options.memory)
    asked = memory.asked(request)
    grounded = options.readout == "grounded"
    report = {
        "query": options.sentence,
        "target": request.target if grounded else request.text,
        "readout": options.readout,
        "memory": str(options.memory),
        "content_hash": memory.content_hash,
        "state_hash": memory.state_hash,
    }
    report |= _grounded(memory, asked, options) if grounded else _paper(memory, asked, options)
    said = _extras(memory, report, options)
    if options.json:
        print_json(report)
        return
    _show(report, wide=options.wide)
    for line in said:
        print("  " * line.startswith(" ") + printable(line, 400))


def _require_outputs(options: argparse.Namespace) -> None:
    """Raises Failure where a picture could not be written, before anything is asked."""
    from robot_app.outputs import require_kind, require_writable

    if options.views_dir and not options.views:
        raise Failure("--views-dir says where the pictures of --views go: give --views too.")
    if options.views_dir and options.views_dir.is_file():
        raise Failure(f"{options.views_dir} is a file: name a folder for the views' pictures.")
    if options.picture:
        require_writable(options.picture)
        require_kind(options.picture, "--picture", (".png", ".svg"))


def _extras(memory: ObjectMemory, report: dict[str, Any], options: argparse.Namespace) -> list[str]:
    """Draws and looks up what was asked for beside the ranking, adds it to the report, and says it for people."""
    said = []
    candidates = report["candidates"]
    if options.picture:
        from openbelief.scene_graph import scene_graph
        from robot_app.pictures.plan import draw_plan, write_plan

        ranks = {c["object_id"]: rank for rank, c in enumerate(candidates, start=1)}
        write_plan(options.picture, draw_plan(scene_graph(memory), ranks, f"“{report['query']}”"))
        report["picture"] = str(options.picture)
        said.append(f"picture: {options.picture}")
    if options.views:
        from robot_app.seen_in import seen_in, told

        rows = seen_in(memory, candidates[0]["object_id"], options.views_dir or Path("views")) if candidates else []
        report["views"] = rows
        said += told(rows, candidates[0]["label"] if candidates else None)
    return said


def _grounded(memory: ObjectMemory, asked: EncodedRequest, options: argparse.Namespace) -> dict[str, Any]:
    from openbelief.retrieval import Candidate
    from robot_app.answers import answer_as_json, terms_as_json

    answer = memory.answer(asked, limit=options.limit + 1, viewer=options.at)  # one more for the margin
    rows = [
        describe(memory, Candidate(c.object_id, c.score, c.visual, c.head)) | terms_as_json(c)
        for c in answer.candidates
    ]
    return answer_as_json(memory, answer, asked) | _candidates(rows, options.limit)


def _paper(memory: ObjectMemory, asked: EncodedRequest, options: argparse.Namespace) -> dict[str, Any]:
    ranked = memory.rank(asked, options.readout, limit=options.limit + 1)
    report: dict[str, Any] = {"answer": None, "understood": asked.request.as_json()}
    if not ranked:
        report["because"] = memory.nothing_because(asked)
    return report | _candidates([describe(memory, candidate) for candidate in ranked], options.limit)


def _candidates(rows: list[dict[str, Any]], limit: int) -> dict[str, Any]:
    margin = rows[0]["score"] - rows[1]["score"] if len(rows) > 1 else None
    return {"margin": margin, "candidates": rows[:limit]}


def describe(memory: ObjectMemory, candidate: Candidate) -> dict[str, Any]:
    """A candidate and what speaks for it, as JSON."""
    node = memory.objects[candidate.object_id]
    return {
        "object_id": node.id,
        "score": candidate.score,
        "visual": candidate.visual,
        "language": candidate.language,
        "label": node.label,
        "phrases": [phrase for concept in node.concepts for phrase in concept.phrases],
        "trust": node.trust,
        "observations": len(node.observations),
        "frames": node.frames,
        "centroid": node.centroid.tolist(),
        "aabb": node.aabb.tolist(),
        "room": node.room,
    }


FITTING = ("object", "score", "label", "room", "said of it")  # in 80 columns, beside what the sentence's parts added


def _show(report: dict[str, Any], *, wide: bool) -> None:
    from rich.table import Table

    from robot_app.answers import told
    from robot_app.tables import cell, chosen, number, show

    if not report["candidates"]:
        print(f"No candidate: {report['because']}.")
        return
    if report["answer"]:
        print("\n".join(printable(line, 400) for line in told(report)))
    table = Table(title=cell(f"{report['target']} ({report['readout']})"), title_justify="left")
    added = list(report["candidates"][0].get("terms", ()))  # what the parts of the sentence added
    shown = [name for name in added if name == "thing" or any(c["terms"][name] for c in report["candidates"])]
    denied = ("contradicted",) if any(c.get("contradicted") for c in report["candidates"]) else ()
    for name in ("object", "score", *shown, "visual", "language", *denied):
        table.add_column(name, justify="right")
    for name in ("label", "room", "trust", "seen", "centre (m)", "said of it"):
        table.add_column(name)
    for c in report["candidates"]:
        terms = [number(c["terms"][name], 2) for name in shown]
        values = (*terms, *(number(c[k]) for k in ("visual", "language", *denied)))
        numbers = [str(c["object_id"]), number(c["score"]), *values]
        centre = " ".join(f"{x:.2f}" for x in c["centroid"])
        seen = f"{c['observations']} x in {c['frames']} frames"
        words = [cell(c["label"] or "-"), cell(c["room"] or "-"), c["trust"], seen, centre]
        table.add_row(*numbers, *words, cell(", ".join(c["phrases"][:5])))
    show(chosen(table, {*FITTING, *shown}, wide=wide), wide=wide)
