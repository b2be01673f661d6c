"""How the check on arrival is scored: frames kept out of mapping are arrivals at right and wrong candidates."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.arrays import normalize
from openbelief.evaluation.truth import TrueObject, TrueQuery, Truth
from openbelief.evaluation.verification import ArrivalCase, Looks, cases_of, evaluate, kept_out, rates
from openbelief.grounded.arrival import Naming, RelativeCheck
from openbelief.grounded.levels import DoubtLevels
from openbelief.observation import Intrinsics, Provenance, RgbdFrame
from openbelief.perception.sentence import SentenceEncoder
from openbelief.run_lengths import encode_rle
from openbelief.verification import verify

ENCODER = SentenceEncoder()
CAMERA = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)
SAID = ["wardrobe", "shoe cabinet", "bookshelf", "sofa", "floor lamp"]
LEVELS = DoubtLevels(0.65, 0.55)


def view(k: int, stamp: int, phrase: str) -> tuple[Observation, RgbdFrame]:
    """A plane 2 m before a camera that stands before thing k."""
    pixels = np.zeros((48, 64), bool)
    pixels[16:32, 24:40] = True
    T = np.eye(4)
    T[0, 3] = 4.0 * k
    grid = np.meshgrid(np.arange(-0.3, 0.3, 0.02), np.arange(-0.3, 0.3, 0.02))
    points = np.stack((grid[0] + 4.0 * k, grid[1], np.full_like(grid[0], 2.0)), axis=-1).reshape(-1, 3)
    source = Provenance("walk", stamp, (24, 16, 40, 32), encode_rle(pixels), b"")
    feature = normalize(ENCODER.encode([phrase])[0])
    seen = Observation(stamp, 0, phrase, 0.9, points.astype(np.float32), feature.astype(np.float32), source)
    return seen, RgbdFrame(0, stamp, np.zeros((48, 64, 3), np.uint8), np.full((48, 64), 2.0, np.float32), CAMERA, T)


@pytest.fixture(scope="module")
def site() -> tuple[ObjectMemory, Truth, list[RgbdFrame]]:
    """Five things, each seen six times: frames 0 and 3 of a thing are kept out of mapping."""
    views = [view(k, 6 * k + n, phrase) for k, phrase in enumerate(SAID) for n in range(6)]
    memory = ObjectMemory.build([seen for seen, _ in views], ENCODER, Parameters())
    boxes = {
        k: TrueObject(k, phrase, np.array([[4.0 * k - 0.4, -0.4, 1.9], [4.0 * k + 0.4, 0.4, 2.1]]))
        for k, phrase in enumerate(SAID)
    }
    queries = [TrueQuery(phrase, "direct", (k,), findable=True) for k, phrase in enumerate(SAID)]
    truth = Truth(boxes, (*queries, TrueQuery("piano", "absent", (), findable=True)), {}, ())
    return memory, truth, [frame for _, frame in views]


def test_every_third_frame_is_kept_out_of_the_memory_and_nothing_else_changes(site):
    memory, _, _ = site
    mapped, arrivals = kept_out(memory)
    assert sorted(arrivals) == list(range(0, 30, 3)) and len(mapped.observations) == 20
    assert (mapped.parameters, mapped.text_encoder_id, len(mapped.objects)) == (memory.parameters, ENCODER.id, 5)
    assert len(memory.observations) == 30


def test_right_candidates_are_confirmed_and_wrong_ones_are_not(site):
    told = []
    result = evaluate(*site, lambda done, total: told.append((done, total)))
    assert told[-1] == (5, 5) and result["queries"] == 5 and result["arrival_frames"] == 10
    assert result["cases"] == {"true": 10, "wrong": 40, "unmapped": 40}
    relative = result["checks"]["relative"]
    assert relative["true"]["confirmed"] == 1.0 and relative["wrong"]["confirmed"] == 0.0
    assert relative["true"]["interval"][0] == pytest.approx(0.722, abs=1e-3) and relative["at"] == 0.65
    assert {point["at"] for point in result["curves"]["paper"]} >= {0.3, 0.45, 0.7}
    true = [point["true"] for point in result["curves"]["relative"]]
    assert true == sorted(true, reverse=True)


def test_the_papers_check_is_scored_as_it_decides(site):
    """At every threshold: `verify` itself confirms exactly what the evaluation counts."""
    memory, truth, frames = site
    mapped, arrivals = kept_out(memory)
    looks = Looks(mapped, {f.stamp_ns: f for f in frames if f.stamp_ns in arrivals}, arrivals)
    query = truth.queries[1]
    cases = [case for case in cases_of(mapped, query, truth, looks) if case.kind == "wrong"]
    ranked = [c.object_id for c in mapped.rank(query.query, "grounded") if c.object_id != 1][:5]
    asked = mapped.asked(query.query)
    at = 0
    for i in ranked:
        for frame in sorted((f for f in frames if f.stamp_ns in (6 * i, 6 * i + 3)), key=lambda f: f.stamp_ns):
            (_, masks) = looks.at(i)[0]
            checks = verify(
                mapped.objects[i].points, frame, masks, asked.f_q.astype(np.float32), ENCODER, mapped.parameters
            )
            assert cases[at].paper(checks.tau_q) is checks.confirmed
            assert cases[at].similar == pytest.approx(checks.semantic)
            at += 1
    assert at == len(cases)


def check(likeness: float, *, lead: float = 1.0, contrast: float = 0.5, like: float = 0.9) -> RelativeCheck:
    return RelativeCheck(likeness, lead, 1, Naming("thing", contrast, like, "other", 0.5))


@pytest.mark.parametrize(
    ("first", "both", "confirmed"),
    [
        (check(0.9), None, True),
        (check(0.5, contrast=-0.1), check(0.9), False),  # not found, and called something else: no second look
        (check(0.5), check(0.9), True),
        (check(0.6), check(0.6), True),  # unsure, and no less like the words than like other phrases
        (check(0.6, contrast=-0.1), check(0.6, contrast=-0.1), False),
        (check(0.9, lead=-0.1), check(0.9), True),
        (check(0.9, lead=-0.1), check(0.9, lead=-0.1), False),
        (check(0.9, contrast=-0.2, like=0.3), check(0.9, contrast=-0.2, like=0.3), False),  # called something else
        (check(0.9, contrast=-0.2, like=0.6), None, True),
        (None, check(0.9), True),
        (None, None, False),
    ],
)
def test_a_case_is_confirmed_at_the_first_look_or_at_the_second_after_a_doubt(first, both, confirmed):
    assert ArrivalCase("q", "true", None, (first, both)).confirmed(LEVELS) is confirmed


def test_rates_carry_their_interval_and_count_queries_alike():
    cases = [ArrivalCase(q, "true", s, (None, None)) for q, s in (("a", 0.9), ("a", 0.1), ("a", 0.1), ("b", 0.9))]
    found = rates(cases, lambda case: case.paper(0.5))
    assert found["true"]["confirmed"] == 0.5 and found["true"]["by_query"] == pytest.approx((1 / 3 + 1) / 2)
    assert found["true"]["interval"] == pytest.approx([0.150, 0.850], abs=1e-3)
    assert found["wrong"] == {"confirmed": None, "interval": None, "cases": 0, "by_query": None}


def test_frames_of_another_recording_are_refused(site):
    memory, truth, frames = site
    with pytest.raises(ValueError, match="the one that it was mapped from"):
        evaluate(memory, truth, [view(0, 10**6, "sofa")[1] for _ in frames])
