"""The check on arrival against ground truth: frames kept out of mapping are arrivals at right and wrong candidates.

A memory of two frames in three is made of the evidence; the third frames that show a candidate's place are arrivals
there. true: candidates inside an accepted object's box. wrong: the five best-ranked others. unmapped: the same wrong
ones, as if the right things and whatever ranks above stood on no map: there only the words can tell. Each (query,
candidate, frame) is one case. Of several right ones each is asked alone: any of them answers the query.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from openbelief.arrival_look import Looked, look_at
from openbelief.evaluation.statistics import wilson
from openbelief.evaluation.truth import ABSENT, TrueQuery, Truth
from openbelief.grounded.arrival import RelativeCheck
from openbelief.grounded.levels import DoubtLevels
from openbelief.memory import ObjectMemory
from openbelief.observation import Mask, Observation, RgbdFrame
from openbelief.relative_verification import Wanted, confirms, in_doubt, judge_relative
from openbelief.request.encoded import EncodedRequest
from openbelief.run_lengths import decode_rle
from openbelief.verification import is_unseen, semantic_threshold, similarities

KEPT_OUT_OF = 3  # every third frame
WRONG = 5
FRAMES_MAX = 3  # arrivals per candidate
RIGHT_MAX = 2
PAPER_SWEPT = tuple(round(0.30 + 0.05 * step, 2) for step in range(9))
RELATIVE_SWEPT = tuple(round(0.40 + 0.05 * step, 2) for step in range(11))
KINDS = ("true", "wrong", "unmapped")


@dataclass(frozen=True)
class ArrivalCase:
    """One arrival at one candidate. similar: the paper's best similarity of a mask at the place, None without one.

    relative: of the first look and of both, None where nothing was seen at the place.
    """

    query: str
    kind: str
    similar: float | None
    relative: tuple[RelativeCheck | None, RelativeCheck | None]

    def paper(self, tau_q: float) -> bool:
        """Whether the paper's check confirms: a mask more similar than tau_q, at the stored place."""
        return self.similar is not None and self.similar > tau_q

    def confirmed(self, levels: DoubtLevels) -> bool:
        """Whether the relative check confirms: at the first look, or at the second where that one was in doubt."""
        first, both = self.relative
        if _passes(first, levels, first=True):
            return True
        return (first is None or in_doubt(first, levels)) and _passes(both, levels, first=False)


def _passes(relative: RelativeCheck | None, levels: DoubtLevels, *, first: bool) -> bool:
    return relative is not None and confirms(relative, levels, first=first)


def evaluate(
    memory: ObjectMemory, truth: Truth, frames: Iterable[RgbdFrame], tell: Callable[[int, int], None] = lambda *_: None
) -> dict[str, Any]:
    """The result of `eval verification`. frames: of the memory's recording, in any order. Raises ValueError."""
    mapped, arrivals = kept_out(memory)
    held = {frame.stamp_ns: frame for frame in frames if frame.stamp_ns in arrivals}
    if not held:
        raise ValueError("None of the memory's frames lies in this recording: give the one that it was mapped from.")
    looks, cases = Looks(mapped, held, arrivals), list[ArrivalCase]()
    queries = [q for q in truth.queries if q.kind != ABSENT and q.findable]
    for number, query in enumerate(queries, start=1):
        cases += cases_of(mapped, query, truth, looks)
        tell(number, len(queries))
    tau_q, levels = semantic_threshold(memory.text_encoder, memory.parameters), mapped.reader().levels
    band = levels.found - levels.unsure
    return {
        "text_encoder": memory.text_encoder_id,
        "queries": len(queries),
        "arrival_frames": len(held),
        "cases": {kind: sum(c.kind == kind for c in cases) for kind in KINDS},
        "checks": {
            "paper": {"at": tau_q, **rates(cases, lambda c: c.paper(tau_q))},
            "relative": {"at": levels.found, **rates(cases, lambda c: c.confirmed(levels))},
        },
        "curves": {
            "paper": _curve(cases, PAPER_SWEPT, lambda case, at: case.paper(at)),
            "relative": _curve(cases, RELATIVE_SWEPT, lambda case, at: case.confirmed(DoubtLevels(at, at - band))),
        },
    }


def kept_out(memory: ObjectMemory) -> tuple[ObjectMemory, dict[int, list[Observation]]]:
    """The memory of the other frames, and the observations of those kept out by stamp."""
    stamps = sorted({o.provenance.stamp_ns for o in memory.observations if o.provenance})
    out = set(stamps[::KEPT_OUT_OF])
    arrivals: dict[int, list[Observation]] = {}
    rest = []
    for o in memory.observations:
        if o.provenance and o.provenance.stamp_ns in out:
            arrivals.setdefault(o.provenance.stamp_ns, []).append(o)
        else:
            rest.append(o)
    if memory.text_encoder is None:
        raise ValueError("The memory was opened without its text encoder.")
    aligned = memory.feature_text_aligned
    built = ObjectMemory.build(rest, memory.text_encoder, memory.parameters, feature_text_aligned=aligned)
    return built.with_rooms(memory.rooms), arrivals


class Looks:
    """What the arrivals show of each place; measured once, for all queries."""

    def __init__(
        self, memory: ObjectMemory, frames: dict[int, RgbdFrame], arrivals: dict[int, list[Observation]]
    ) -> None:
        self._memory, self._frames, self._arrivals = memory, frames, arrivals
        self._masks = {stamp: [_mask(o) for o in seen] for stamp, seen in arrivals.items() if stamp in frames}
        self._known: dict[int, list[tuple[Looked, list[Mask]]]] = {}

    def at(self, candidate: int) -> list[tuple[Looked, list[Mask]]]:
        """Of up to FRAMES_MAX frames that show enough of it and hold a mask that meets its box, the nearest first."""
        if candidate not in self._known:
            self._known[candidate] = list(self._look(candidate))
        return self._known[candidate]

    def _look(self, candidate: int) -> Iterable[tuple[Looked, list[Mask]]]:
        node, parameters = self._memory.objects[candidate], self._memory.parameters
        low, high = node.aabb
        met = [
            (float(np.linalg.norm(self._frames[stamp].T_map_camera[:3, 3] - node.centroid)), stamp)
            for stamp in self._masks
            if any(_meets(o, low, high) for o in self._arrivals[stamp])
        ]
        dim, found = self._memory.text_dim if self._memory.feature_text_aligned else None, 0
        for _, stamp in sorted(met):
            looked = look_at(node.points, self._frames[stamp], self._masks[stamp], parameters, dim)
            if not is_unseen(looked.shown, parameters):
                yield looked, self._masks[stamp]
                found += 1
            if found == FRAMES_MAX:
                return


def _meets(o: Observation, low: np.ndarray, high: np.ndarray) -> bool:
    return bool((o.points.min(axis=0) <= high).all() and (low <= o.points.max(axis=0)).all())


def _mask(o: Observation) -> Mask:
    if o.provenance is None:
        raise ValueError("An observation does not say where its mask was.")
    return Mask(o.mask, decode_rle(o.provenance.rle), o.phrase or "", float(o.confidence), o.feature)


def cases_of(memory: ObjectMemory, query: TrueQuery, truth: Truth, looks: Looks) -> list[ArrivalCase]:
    """Every case of one query."""
    asked, reader = memory.asked(query.query), memory.reader()
    reading = reader.read(asked)
    ranked = [c.object_id for c in memory.rank(asked, "grounded")]
    is_right = {i: _is_right(memory, i, query, truth) for i in ranked}
    right = frozenset(i for i in ranked if is_right[i])
    cases: list[ArrivalCase] = []
    for i in [i for i in ranked if is_right[i]][:RIGHT_MAX]:
        cases += _cases(memory, query.query, "true", Wanted(reader, reading, asked, i, right - {i}), looks)
    for i in [i for i in ranked if not is_right[i]][:WRONG]:
        wanted = Wanted(reader, reading, asked, i)
        above = right | frozenset(ranked[: ranked.index(i)])
        cases += _cases(memory, query.query, "wrong", wanted, looks)
        cases += _cases(memory, query.query, "unmapped", replace(wanted, excluded=above), looks)
    return cases


def _is_right(memory: ObjectMemory, i: int, query: TrueQuery, truth: Truth) -> bool:
    centroid = memory.objects[i].centroid
    return any(truth.objects[k].contains(centroid, truth.margin_m) for k in query.accept)


def _cases(memory: ObjectMemory, query: str, kind: str, wanted: Wanted, looks: Looks) -> list[ArrivalCase]:
    """One of each look at a candidate; the next look is the second one."""
    seen, parameters = looks.at(wanted.candidate), memory.parameters
    cases = []
    for k, (looked, masks) in enumerate(seen):
        first, again = judge_relative(looked, wanted, parameters), seen[(k + 1) % len(seen)][0]
        both = judge_relative(again, wanted, parameters, before=(first.seen,)) if len(seen) > 1 else None
        second = both.relative if both and both.seen else None
        cases.append(ArrivalCase(query, kind, _similar(memory, wanted.asked, looked, masks), (first.relative, second)))
    return cases


def _similar(memory: ObjectMemory, asked: EncodedRequest, looked: Looked, masks: Sequence[Mask]) -> float | None:
    """As `verify`: the largest similarity of a mask that is at the place."""
    here = {one.index for one in looked.at_place(memory.parameters.tau_arr)}
    vector, aligned = asked.f_q.astype(np.float32), memory.feature_text_aligned
    alike = similarities(masks, vector, memory.text_encoder, memory.parameters, aligned)
    return max((s for s, mask in zip(alike, masks, strict=True) if s is not None and mask.index in here), default=None)


def rates(cases: Sequence[ArrivalCase], said: Callable[[ArrivalCase], bool]) -> dict[str, Any]:
    """By kind: the share confirmed, its Wilson interval, and the mean of the queries' shares, each the same weight."""
    found: dict[str, Any] = {}
    for kind in KINDS:
        told = [(case.query, said(case)) for case in cases if case.kind == kind]
        confirmed = sum(yes for _, yes in told)
        found[kind] = {
            "confirmed": confirmed / len(told) if told else None,
            "interval": list(wilson(confirmed, len(told))) if told else None,
            "cases": len(told),
            "by_query": _by_query(told),
        }
    return found


def _by_query(told: Sequence[tuple[str, bool]]) -> float | None:
    queries: dict[str, list[bool]] = {}
    for query, yes in told:
        queries.setdefault(query, []).append(yes)
    return float(np.mean([np.mean(each) for each in queries.values()])) if queries else None


def _curve(
    cases: Sequence[ArrivalCase], swept: Iterable[float], said: Callable[..., bool]
) -> list[dict[str, float | None]]:
    rows = [(at, rates(cases, partial(said, at=at))) for at in swept]
    return [{"at": at, **{kind: row[kind]["confirmed"] for kind in KINDS}} for at, row in rows]
