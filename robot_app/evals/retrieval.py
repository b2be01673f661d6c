"""Free-form retrieval against a TRUTH.json.

R@k: one of the first k candidates has its centroid inside an accepted object's box grown by 0.25 m, or by the truth's
`margin_m`. SR@1m: the first one's centroid is within 1 m of such a box, seen from above. With --readout grounded also
what doubt keeps of things that are there and refuses of absent ones; --plot draws that curve.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from robot_app.answers import READOUTS
from robot_app.cli import Failure, Usage, print_json

if TYPE_CHECKING:
    from openbelief.evaluation.truth import Truth
    from openbelief.memory import ObjectMemory

SAME_SITE_M = 1.0  # nearer to nothing than this is no mapping error


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("memory", type=Path, metavar="SITE.belief")
    parser.add_argument("truth", type=Path, metavar="TRUTH.json")
    parser.add_argument("--readout", choices=READOUTS, default="consensus", help="default consensus, the paper's")
    parser.add_argument("--rooms", type=Path, metavar="ROOMS.json", help="rooms for this evaluation, as `map --rooms`")
    parser.add_argument(
        "--plot", type=Path, metavar="FILE.png|svg", help="the curve of kept and refused (grounded only)"
    )


def run(options: argparse.Namespace) -> None:
    from openbelief.evaluation.retrieval import evaluate
    from openbelief.evaluation.truth import TruthError, read_truth
    from robot_app.evals.plots import plot_doubt
    from robot_app.memories import open_with_encoder
    from robot_app.outputs import require_kind, require_writable
    from robot_app.room_files import read_rooms

    try:
        truth = read_truth(options.truth)
    except TruthError as error:
        raise Failure(str(error)) from error
    if options.plot and options.readout != "grounded":
        raise Usage("--plot draws what doubt keeps and refuses: it goes with --readout grounded")
    if options.plot:
        require_writable(options.plot)
        require_kind(options.plot, "--plot", (".png", ".svg", ".pdf"))
    memory = open_with_encoder(options.memory)
    if options.rooms:
        memory = memory.with_rooms(read_rooms(options.rooms))
    _require_same_site(memory, truth, options.truth)
    result = evaluate(memory, truth, options.readout) | {
        "memory": str(options.memory),
        "truth": str(options.truth),
        "content_hash": memory.content_hash,
        "parameters": memory.parameters.to_dict(),
    }
    if options.plot:
        plot_doubt(result, options.plot)
        result["plot"] = str(options.plot)
    print_json(result) if options.json else _show(result)


def _require_same_site(memory: ObjectMemory, truth: Truth, path: Path) -> None:
    """Raises Failure where nothing that the memory holds lies near anything that the truth names."""
    centroids = [node.centroid for node in memory.objects]
    if centroids and not any(thing.contains(c, SAME_SITE_M) for thing in truth.objects.values() for c in centroids):
        raise Failure(
            f"{path} is of another site: none of the memory's {len(centroids)} objects lies within {SAME_SITE_M:g} m "
            "of a thing that it names. Give the truth beside the recording that was mapped."
        )


def _show(result: dict[str, Any]) -> None:
    from robot_app.tables import cell, show

    show(_scores(result))
    absent, nodes = result["absent"], result["nodes"]
    if absent["auc"] is not None:
        print(f"absent: {absent['queries']} queries, best score {absent['mean_top_score']:.3f} on average; a present")
        print(f"  thing scores higher than an absent one in {absent['auc']:.1%} of the pairs")
    if "doubt" in result:
        print("\n".join(_doubt_lines(result)))
    print(f"nodes: {nodes['nodes']} for {nodes['true_objects']} true objects")
    if nodes["purity"] is not None:
        print(f"  {nodes['nodes_per_object']:.2f} nodes per mapped object, purity {nodes['purity']:.3f}")
    for miss in result["misses"]:
        first = miss["candidates"][0]["label"] if miss["candidates"] else "nothing"
        print(f"miss: {cell(miss['query'])} -> {cell(first or 'an object never named')}; {miss['because']}")
    print(f"memory {cell(result['memory'])}, content hash {result['content_hash']}")


def _doubt_lines(result: dict[str, Any]) -> Iterator[str]:
    """What is kept and refused, and the same at other levels of `found`."""
    doubt, absent = result["doubt"], result.get("absent_nouns")
    said = f"kept: {_share(result['kept'])} of the findable answered found"
    if absent:
        said += f"; of {absent['queries']} absent nouns {absent['refused']:.0%} refused"
        said += f" ({absent['unsure']:.0%} unsure, {absent['not_found']:.0%} not found)"
    yield f"{said}, found at {doubt['found_at']:.2f}"
    if told := result.get("colours"):
        yield f"in its own colour {_share(told['kept'])} of {told['queries']} things are answered found"
        yield f"  in a colour that none of the name has {_share(told['refused'])} of {told['others']} are refused"
    for point in doubt["curve"][::2]:
        shares = f"kept {_share(point['kept'])}, refused {_share(point['refused'])}"
        yield f"  found at {point['found_at']:.2f}: {shares}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.0%}"


def _scores(result: dict[str, Any]) -> Any:
    from rich.table import Table

    from robot_app.tables import cell, number

    title = f"{Path(result['truth']).name}, {result['readout']}"
    table = Table("queries", "n", "R@1", "R@3", "SR@1m", title=cell(title), title_justify="left")
    rows = {"all findable": result, **result["by_kind"]}
    if "language_alone" in result:
        rows["all findable, language alone"] = result["language_alone"]
    if result["unfindable"]["queries"]:
        rows["unfindable (not scored)"] = result["unfindable"]
    for name, row in rows.items():
        table.add_row(cell(name), str(row["queries"]), *(number(row[k], 2) for k in ("r_at_1", "r_at_3", "sr_at_1m")))
    return table
