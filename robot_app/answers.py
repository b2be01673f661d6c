"""What the readout `grounded` answered, for a screen and as JSON."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from openbelief.grounded.answer import Answer, GroundedCandidate
    from openbelief.memory import ObjectMemory
    from openbelief.request import Request
    from openbelief.request.encoded import EncodedRequest

READOUTS = ("grounded", "consensus", "early", "belief")


def request_of(sentence: str) -> Request:
    """Raises Failure where the sentence names nothing, or tells the robot what to do with itself."""
    from openbelief.request import command, parse
    from robot_app.cli import Failure

    if (told := command(sentence)) is not None:
        raise Failure(f"{sentence!r} is the command {told.value!r}, not a thing: name what to look for.")
    try:
        return parse(sentence)
    except ValueError as error:
        raise Failure(str(error)) from error


def answer_as_json(memory: ObjectMemory, answer: Answer, asked: EncodedRequest) -> dict[str, Any]:
    """The answer's own part of `query --json`; the candidates are described by whoever shows them."""
    return {
        "answer": answer.answer,
        "because": answer.because,
        "understood": answer.understood,
        "notes": list(answer.notes),
        "did_you_mean": list(answer.did_you_mean),
        "offers": [offer(memory, i) for i in answer.offers],
        "consensus": consensus(memory, asked),
    }


def offer(memory: ObjectMemory, object_id: int) -> dict[str, Any]:
    node = memory.objects[object_id]
    return {"object_id": node.id, "label": node.label, "room": node.room}


def consensus(memory: ObjectMemory, asked: EncodedRequest) -> dict[str, Any] | None:
    """What the paper's consensus would have answered, None where it has nothing."""
    best = next(iter(memory.rank(asked, "consensus", limit=1)), None)
    return None if best is None else offer(memory, best.object_id) | {"score": best.score}


def terms_as_json(candidate: GroundedCandidate) -> dict[str, Any]:
    return {"terms": candidate.terms, "head": candidate.head, "contradicted": candidate.contradicted}


def told(report: dict[str, Any]) -> Iterator[str]:
    """The answer of a report in lines for a person: what was found, how sure, what could not be used, what else."""
    best = report["candidates"][0] if report["candidates"] else None
    if report["answer"] == "found" and best is not None:
        yield f"Found: {named(best)}."
    else:
        yield f"{report['answer'].capitalize()}: {report['because']}."
        offers = ", ".join(named(offer) for offer in report["offers"])
        if offers:
            yield f"The nearest are: {offers}."
    understood = report["understood"]
    parts = [
        f"{name} {understood[name]!r}" for name in ("target", "place", "relation", "which", "not") if understood[name]
    ]
    yield f"Understood: {', '.join(parts)}."
    yield from (f"Note: {note}." for note in report["notes"])
    if understood["unused"]:
        yield f"Not used: {' '.join(understood['unused'])}."
    if report["did_you_mean"]:
        yield f"Did you mean {' or '.join(map(repr, report['did_you_mean']))}?"
    other = report["consensus"]
    if other is not None and best is not None and other["object_id"] != best["object_id"]:
        yield f"The paper's consensus would have answered: {named(other)}."


def named(thing: dict[str, Any]) -> str:
    room = f" in the {thing['room']}" if thing["room"] else ""
    return f"{thing['label'] or 'a thing never named'} (object {thing['object_id']}){room}"
