"""Is it here at all? The best candidate's H against what the text encoder gives to things that are there and not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

import numpy as np

from openbelief.grounded.reading import Reading

Verdict = Literal["found", "unsure", "not found"]
GRAVITY: tuple[Verdict, ...] = ("found", "unsure", "not found")


def judge(reading: Reading, best: int | None) -> tuple[Verdict, str]:
    """The answer, and why, in the operator's words; `best` is the first candidate's row, None where there is none."""
    if best is None:
        return "not found", "the map holds nothing that could be meant"
    findings = list(_findings(reading, best))
    verdict: Verdict = max((verdict for verdict, _ in findings), key=GRAVITY.index, default="found")
    return verdict, "; ".join(because for found, because in findings if found == verdict)


def _findings(reading: Reading, best: int) -> Iterable[tuple[Verdict, str]]:
    request, levels = reading.request, reading.levels
    head = float(reading.head[best])
    where = f" in the {request.place}" if request.place and reading.place_known else ""
    if head < levels.unsure:
        yield "not found", f"nothing{where} on the map is like {request.target!r}"
    elif head < levels.found:
        yield "unsure", f"nothing{where} on the map is surely {request.target!r}"
    if reading.place_known and reading.place_outlined and reading.inside[best] < 0.5:
        where = f"no {request.target} stands in the {request.place}"
        yield ("not found", where) if reading.place_given else ("unsure", f"{where}, as far as the map's rooms tell")
    if reading.negation[best] < -reading.options.not_weight / 2:
        yield "not found", f"all that is like {request.target!r} is what you do not want"
    yield from (("unsure", note) for note in reading.doubts)
    yield from _denied(reading, best)
    if reading.fulfilled[best] < reading.options.related_at and np.isfinite(reading.fulfilled[best]):
        relations = " and ".join(map(str, request.relations))
        yield "unsure", f"no {request.target} is {relations}"


def _denied(reading: Reading, best: int) -> Iterable[tuple[Verdict, str]]:
    """Where nothing says the asked colour and other words say another. Unknown is no contradiction, except of a thing
    without a name: "the red one" asks for nothing else.
    """
    at = reading.options.contradicted_at
    if at is None:
        return
    if reading.contradicted[best] > at:
        yield "unsure", f"what fits best was {reading.attributes.denial(best)}"
    elif reading.request.generic and (unconfirmed := reading.attributes.unconfirmed(best)):
        yield "unsure", f"what fits best was never called {' and '.join(each.asked for each in unconfirmed)}"
