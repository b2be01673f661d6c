"""Ranking every object of a large memory, the best ten: CPU time of each readout, beside one read of the matrices that
it needs (their sum), and the same ten by scores in float64, object by object.

`grounded` makes tables at its first answer and keeps them: first and later answers are told apart. Its sentences ask
for a thing beside another in a place, and for the nearest of all that fit; nothing plain stands beside those.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from robot_app.benches.cpu import beside_plain, count, cpu_s, peak_mb, said
from robot_app.benches.plain_grounded import plain_grounded
from robot_app.cli import Failure, print_json

if TYPE_CHECKING:
    from openbelief.arrays import Array
    from openbelief.memory import ObjectMemory
    from openbelief.node_table import NodeTable

READOUTS = ("consensus", "early", "belief")
BEST, TIMES = 10, 7
SENTENCES = ("the red chair next to the lamp in the kitchen", "the nearest chair")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--objects", type=count, nargs="+", default=[100_000], metavar="N", help="sizes of the memory (default 100000)"
    )


def run(options: argparse.Namespace) -> None:
    rows = [row for size in sorted(options.objects) for row in _measured(size)]
    print_json({"rankings": rows}) if options.json else print("\n".join(_line(row) for row in rows))
    if any(row["equal"] is False for row in rows):
        raise Failure("float64 ranks others first: that is a defect, please report it with this machine's name")


def _measured(objects: int) -> list[dict[str, Any]]:
    import numpy as np

    from openbelief.memory import ObjectMemory
    from robot_app.benches.synthetic_memory import DIM, node_table

    table = node_table(objects)
    memory, query = ObjectMemory(table), np.random.default_rng(1).normal(size=DIM)
    rows = [_ranked(memory, query, readout) for readout in READOUTS]
    return [*rows, _grounded(memory, query), *(_sentence(memory, sentence) for sentence in SENTENCES)]


def _grounded(memory: ObjectMemory, query: Array) -> dict[str, Any]:
    """Of a vector, which asks for the thing alone."""
    table = memory.table
    first_s, _ = cpu_s(lambda: memory.rank(query, "grounded", limit=BEST))
    later_s, best = cpu_s(lambda: memory.rank(query, "grounded", limit=BEST), TIMES)
    read_s, _ = cpu_s(table.feature.sum, TIMES)
    plain_s, order = cpu_s(lambda: plain_grounded(table, query, BEST))
    return {
        "objects": len(table),
        "readout": "grounded",
        "first_cpu_s": round(first_s, 4),
        "cpu_s": round(later_s, 5),
        "read_cpu_s": round(read_s, 5),
        "reads": round(later_s / read_s, 2),
        **beside_plain(later_s, plain_s, order == [c.object_id for c in best]),
        "peak_mb": peak_mb(),
    }


def _sentence(memory: ObjectMemory, sentence: str) -> dict[str, Any]:
    """Of a whole sentence, by somebody who stands at the map's origin, with the sentence encoder loaded."""
    from openbelief.grounded.geometry import Viewer
    from openbelief.memory import ObjectMemory
    from openbelief.node_table import NodeTable
    from openbelief.perception.sentence import SentenceEncoder

    encoder = SentenceEncoder()
    encoder.encode([sentence])
    evidence = replace(memory.evidence, text_encoder_id=encoder.id)
    hearing = ObjectMemory(NodeTable(evidence, memory.table.columns), encoder)
    viewer = Viewer(0.0, 0.0, 0.0)
    first_s, _ = cpu_s(lambda: hearing.answer(sentence, limit=BEST, viewer=viewer))
    later_s, _ = cpu_s(lambda: hearing.answer(sentence, limit=BEST, viewer=viewer), TIMES)
    return {
        "objects": len(memory.table),
        "readout": "grounded",
        "sentence": sentence,
        "first_cpu_s": round(first_s, 4),
        "cpu_s": round(later_s, 5),
        **beside_plain(later_s, None, None),
        "peak_mb": peak_mb(),
    }


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
        **beside_plain(ours_s, plain_s, order == [c.object_id for c in best]),
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
    first = f", the first answer {1e3 * row['first_cpu_s']:.3g} ms" if "first_cpu_s" in row else ""
    head = f"{row['objects']} objects, {row['readout']}: {1e3 * row['cpu_s']:.3g} ms of CPU{first}"
    if "sentence" in row:
        return f"{head}; {row['sentence']!r}"
    reads = f"{row['reads']:g} reads of its matrices ({1e3 * row['read_cpu_s']:.3g} ms)"
    return f"{head}, {reads}; object by object {said(row)}"
