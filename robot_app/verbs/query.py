"""Rank the objects of a memory for a sentence, best first, with the evidence for each.

Walls, floors and the like are left out unless they are asked for by name.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.arguments import from_one
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.memory import Candidate, ObjectMemory

EXAMPLE = 'openbelief query demo-out/site.belief "red chair"'
READOUTS = ("consensus", "early", "belief")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("sentence", help='what to look for, in plain words: "take me to the lamp"')
    parser.add_argument("--readout", choices=READOUTS, default="consensus", help="language head (default consensus)")
    parser.add_argument(
        "--limit", type=from_one, default=10, metavar="N", help="show at most N candidates (default 10)"
    )


def run(options: argparse.Namespace) -> None:
    from openbelief.target_phrase import target_phrase
    from robot_app.memories import open_with_encoder

    try:
        target = target_phrase(options.sentence)
    except ValueError as error:
        raise Failure(str(error)) from error
    memory = open_with_encoder(options.memory)
    ranked = memory.rank(options.sentence, options.readout, limit=options.limit + 1)  # one more for the margin
    candidates = ranked[: options.limit]
    report = {
        "query": options.sentence,
        "target": target.text,
        "place": target.place,
        "readout": options.readout,
        "memory": str(options.memory),
        "content_hash": memory.content_hash,
        "state_hash": memory.state_hash,
        "margin": ranked[0].score - ranked[1].score if len(ranked) > 1 else None,
        "candidates": [describe(memory, candidate) for candidate in candidates],
    }
    if not candidates:
        report["because"] = memory.nothing_because(options.sentence)
    print_json(report) if options.json else _show(report)


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


def _show(report: dict[str, Any]) -> None:
    from rich.table import Table

    from robot_app.tables import cell, number, show

    if "because" in report:
        print(f"No candidate: {report['because']}.")
        return
    table = Table(title=cell(f"{report['target']} ({report['readout']})"), title_justify="left")
    for name in ("object", "score", "visual", "language"):
        table.add_column(name, justify="right")
    for name in ("label", "room", "trust", "seen", "centre (m)", "said of it"):
        table.add_column(name)
    for c in report["candidates"]:
        numbers = [str(c["object_id"]), *(number(c[k]) for k in ("score", "visual", "language"))]
        centre = " ".join(f"{x:.2f}" for x in c["centroid"])
        seen = f"{c['observations']} x in {c['frames']} frames"
        words = [cell(c["label"] or "-"), cell(c["room"] or "-"), c["trust"], seen, centre]
        table.add_row(*numbers, *words, cell(", ".join(c["phrases"][:5])))
    show(table)
