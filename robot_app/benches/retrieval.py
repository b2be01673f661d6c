"""Ranking every object of a large memory, the best ten: CPU time of each readout, beside one read of the matrices that
it needs (their sum), and the same ten by scores in float64, object by object.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from robot_app.benches.cpu import count, cpu_s, peak_mb
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.arrays import Array
    from openbelief.memory import ObjectMemory
    from openbelief.node_table import NodeTable

READOUTS = ("consensus", "early", "belief")
BEST, TIMES = 10, 7


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--objects", type=count, nargs="+", default=[100_000], metavar="N", help="sizes of the memory (default 100000)"
    )


def run(options: argparse.Namespace) -> None:
    rows = [row for size in sorted(options.objects) for row in _measured(size)]
    print_json({"rankings": rows}) if options.json else print("\n".join(_line(row) for row in rows))
    if not all(row["equal"] for row in rows):
        raise Failure("float64 ranks others first: that is a defect, please report it with this machine's name")


def _measured(objects: int) -> list[dict[str, Any]]:
    import numpy as np

    from openbelief.memory import ObjectMemory
    from robot_app.benches.synthetic_memory import DIM, node_table

    table = node_table(objects)
    memory, query = ObjectMemory(table), np.random.default_rng(1).normal(size=DIM)
    return [_ranked(memory, query, readout) for readout in READOUTS]


def _ranked(memory: ObjectMemory, query: Array, readout: str) -> dict[str, Any]:
    table = memory.table
    language = table.consensus if readout == "consensus" else table.concept_embedding
    ours_s, best = cpu_s(lambda: memory.rank(query, readout, limit=BEST), TIMES)
    read_s, _ = cpu_s(lambda: (table.feature.sum(), language.sum()), TIMES)
    plain_s, order = cpu_s(lambda: _plain(table, query, readout))
    return {
        "objects": len(table),
        "readout": readout,
        "cpu_s": round(ours_s, 5),
        "read_cpu_s": round(read_s, 5),
        "reads": round(ours_s / read_s, 2),
        "plain_cpu_s": round(plain_s, 4),
        "ratio": round(plain_s / ours_s, 1),
        "equal": order == [c.object_id for c in best],
        "peak_mb": peak_mb(),
    }


def _plain(table: NodeTable, query: Array, readout: str) -> list[int]:
    """Eq. retrieval-score object by object, then sorted."""
    import numpy as np

    parameters, unit = table.evidence.parameters, query / np.linalg.norm(query)
    scored = []
    for i in range(len(table)):
        concepts = table.concept_embedding[table.concept_start[i] : table.concept_start[i + 1]].astype(np.float64)
        belief = table.belief[table.concept_start[i] : table.concept_start[i + 1]]
        language = (
            table.consensus[i].astype(np.float64) @ unit
            if readout == "consensus"
            else concepts[0] @ unit
            if readout == "early"
            else belief @ (concepts @ unit)
        )
        weight = parameters.lambda_trusted if table.trusted[i] else parameters.lambda_degraded
        visual = table.feature[i].astype(np.float64) @ unit
        scored.append((-(weight * visual + (1.0 - weight) * language), i))
    return [i for _, i in sorted(scored)[:BEST]]


def _line(row: dict[str, Any]) -> str:
    return (
        f"{row['objects']} objects, {row['readout']}: {1e3 * row['cpu_s']:.3g} ms of CPU, {row['reads']:g} reads of "
        f"its matrices ({1e3 * row['read_cpu_s']:.3g} ms); object by object {row['plain_cpu_s']:.3g} s, "
        f"{row['ratio']:g}x, {'equal' if row['equal'] else 'NOT EQUAL'}"
    )
