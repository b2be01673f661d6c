"""How many masks pass the semantic arrival check at a threshold: `calibrate_tau_q.py SITE.belief TRUTH.json`.

true: masks of the objects that a query accepts. similar: masks of the five other objects whose masks are on average
most similar to the query, what retrieval could take for it. others: masks of all other objects. Each query counts the
same. error: the mean of the true that fail and the similar that pass; the threshold with the least is the calibrated
one. The truth has to say from which object each mask was drawn (`mask_origin`).
"""

from __future__ import annotations

import argparse
import sys
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from openbelief.evaluation.truth import ABSENT, TrueQuery, Truth, read_truth  # noqa: E402
from openbelief.memory import ObjectMemory  # noqa: E402
from openbelief.observation import Mask, Observation  # noqa: E402
from openbelief.target_phrase import target_phrase  # noqa: E402
from openbelief.verification import similarities  # noqa: E402
from robot_app.memories import open_with_encoder  # noqa: E402

THRESHOLDS = (0.35, 0.40, 0.45, 0.50, 0.55, 0.60)
SIMILAR = 5
Pools = tuple[np.ndarray, np.ndarray, np.ndarray]  # similarities of true, similar and all other masks


def of_objects(memory: ObjectMemory, truth: Truth) -> dict[int, list[Observation]]:
    """True object -> the observations that were drawn from it."""
    drawn: dict[int, list[Observation]] = defaultdict(list)
    for o in memory.observations:
        origin = truth.mask_origin.get((o.provenance.stamp_ns, o.mask)) if o.provenance else None
        if origin in truth.objects:
            drawn[origin].append(o)
    return drawn


def pools(query: TrueQuery, memory: ObjectMemory, drawn: dict[int, list[Observation]]) -> Pools:
    assert memory.text_encoder is not None
    [vector] = memory.text_encoder.encode([target_phrase(query.query).text])

    def compared(observations: Sequence[Observation]) -> np.ndarray:
        masks = [Mask(o.mask, np.ones((1, 1), bool), o.phrase, o.confidence, o.feature) for o in observations]
        found = similarities(masks, vector, memory.text_encoder, memory.parameters, memory.feature_text_aligned)
        return np.array([s for s in found if s is not None])

    scored = {i: compared(observations) for i, observations in drawn.items()}
    wrong = sorted((i for i in scored if i not in query.accept), key=lambda i: -scored[i].mean())
    true = [scored[i] for i in query.accept if i in scored]
    return tuple(
        np.concatenate(part) for part in (true, [scored[i] for i in wrong[:SIMILAR]], [scored[i] for i in wrong])
    )


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("memory", type=Path)
    parser.add_argument("truth", type=Path)
    options = parser.parse_args(arguments)
    memory, truth = open_with_encoder(options.memory), read_truth(options.truth)
    drawn = of_objects(memory, truth)
    queries = [q for q in truth.queries if q.kind != ABSENT and q.findable]
    found = [pools(q, memory, drawn) for q in queries if any(i in drawn for i in q.accept)]
    print(
        f"{sum(map(len, drawn.values()))} masks of {len(drawn)} objects, {len(found)} queries, {memory.text_encoder_id}"
    )
    for threshold in THRESHOLDS:
        true, similar, others = (float(np.mean([(p[k] > threshold).mean() for p in found])) for k in range(3))
        error = (1 - true + similar) / 2
        print(f"{threshold:.2f}  true {true:.1%}  similar {similar:.1%}  others {others:.1%}  error {error:.3f}")


if __name__ == "__main__":
    main()
