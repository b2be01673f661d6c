"""What a person is asked before a candidate is driven to, and why this one."""

from __future__ import annotations

from collections.abc import Sequence

from behaviors.attempt import Attempt
from drivers.ports import Option, Question
from openbelief.memory import Candidate, ObjectMemory, ObjectNode

CONCEPTS_NAMED = 3


def approval_question(
    attempt: Attempt, ranking: Sequence[Candidate], memory: ObjectMemory, doubt: str = ""
) -> Question:
    """Bound to the candidate, its goal pose and the memory; a yes to it is a yes to nothing else.

    doubt: why it may not be what was asked for, "" where it surely is.
    """
    approach = attempt.approach
    return Question(
        sentence=f"I am not sure: {doubt}. {_sentence(attempt)}" if doubt else _sentence(attempt),
        memory_hash=memory.state_hash,
        object_id=attempt.node.id,
        goal=approach.goal.pose if approach else None,
        path_length_m=approach.length_m if approach else None,
        because=why(attempt.candidate, ranking, memory),
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


def _sentence(attempt: Attempt) -> str:
    length = f", {attempt.approach.length_m:.1f} m away" if attempt.approach else ""
    room = f" in the {attempt.node.room}" if attempt.node.room else ""
    if attempt.unseen_because:
        return f"The {attempt.label}{room}: {attempt.unseen_because} May I walk there{length}, and try all the same?"
    return f"May I walk to the {attempt.label}{room}{length}, and look at it?"


def _name(node: ObjectNode) -> str:
    return node.label or f"object {node.id}"
