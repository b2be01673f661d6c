"""What a person is asked before a candidate is driven to, and why this one."""

from __future__ import annotations

from collections.abc import Sequence

from behaviors.attempt import Attempt
from drivers.ports import Option, Question
from openbelief.memory import Candidate, ObjectMemory, ObjectNode

CONCEPTS_NAMED = 3


def approval_question(
    attempt: Attempt, ranking: Sequence[Candidate], memory: ObjectMemory, target: str, doubt: str = ""
) -> Question:
    """Bound to the candidate, its goal pose and the memory; a yes to it is a yes to nothing else.

    target: the thing that was asked for. doubt: why it may not be what was asked for, "" where it surely is.
    """
    approach, sentence = attempt.approach, _sentence(attempt, target)
    return Question(
        sentence=f"I am not sure: {doubt}. {sentence}" if doubt else sentence,
        memory_hash=memory.state_hash,
        object_id=attempt.node.id,
        goal=approach.goal.pose if approach else None,
        path_length_m=approach.length_m if approach else None,
        because=why(attempt.candidate, ranking, memory),
        doubt=doubt,
        options=tuple(
            Option(number, each.object_id, _name(memory.objects[each.object_id]), float(each.score))
            for number, each in enumerate(ranking, start=1)
        ),
    )


def why(candidate: Candidate, ranking: Sequence[Candidate], memory: ObjectMemory) -> str:
    """The evidence for a candidate, and the one that comes next."""
    node = memory.objects[candidate.object_id]
    named = ", ".join(f"{c.label} (support {c.support:.1f})" for c in node.concepts[:CONCEPTS_NAMED])
    seen = f"Seen {len(node.observations)} times in {node.frames} frames"
    says = f"{seen}, called {named}." if named else f"{seen}, and never named."
    others = [each for each in ranking if each.object_id != candidate.object_id]
    if not others:
        return f"{says} It scores {candidate.score:.2f}; there is no other candidate."
    rival = _name(memory.objects[others[0].object_id])
    return f"{says} It scores {candidate.score:.2f}; the next one, {rival}, {others[0].score:.2f}."


def destination(attempt: Attempt, target: str) -> str:
    """Where the robot would go, how far that is, and why there where the map calls it by another name."""
    return f"the {attempt.label}{_room(attempt)}{_length(attempt)}{_other_name(attempt.node, target)}"


def _sentence(attempt: Attempt, target: str) -> str:
    if attempt.unseen_because:
        where = f"The {attempt.label}{_room(attempt)}{_other_name(attempt.node, target)}"
        return f"{where}: {attempt.unseen_because} May I walk there{_length(attempt)}, and try all the same?"
    return f"May I walk to {destination(attempt, target)}, and look at it?"


def _room(attempt: Attempt) -> str:
    return f" in the {attempt.node.room}" if attempt.node.room else ""


def _length(attempt: Attempt) -> str:
    return f", {attempt.approach.length_m:.1f} m away" if attempt.approach else ""


def _other_name(node: ObjectNode, target: str) -> str:
    """ " (mapped as ...; 2 of 9 looks say ...)"; empty where the map calls it what was asked."""
    label, asked = (node.label or "").lower(), target.lower()
    if not label or asked in label or label in asked:
        return ""
    says = sum(asked in (observation.phrase or "").lower() for observation in node.observations)
    looks = f"; {says} of {len(node.observations)} looks say {target!r}" if says else ""
    return f" (mapped as {node.label!r}{looks})"


def _name(node: ObjectNode) -> str:
    return node.label or f"object {node.id}"
