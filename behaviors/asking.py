"""What a query asks the memory: the ranking of each attempt, and whether anything on the map is like what was asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from behaviors.arrival import robot_pose
from behaviors.policy import MissionPolicy
from drivers.ports import Ports
from openbelief.grounded.answer import Answer
from openbelief.grounded.geometry import DIRECTIONS, Viewer
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.which import BY_VIEWER
from openbelief.memory import Candidate, ObjectMemory
from openbelief.request import Request
from openbelief.request.encoded import EncodedRequest
from openbelief.request.places import HERE

Doubt = Literal["found", "unsure", "not found"]


@dataclass(frozen=True)
class Retrieved:
    """candidates: best first. answer: of the readout "grounded", None for the paper's, which know no doubt."""

    candidates: Sequence[Candidate]
    answer: Answer | None = None

    @property
    def doubt(self) -> Doubt:
        return "found" if self.answer is None else self.answer.answer

    def told(self, memory: ObjectMemory) -> str:
        """Why it is in doubt, what could not be used, and what is nearest, for the operator."""
        if self.answer is None:
            return ""
        parts = [self.answer.because, *(note for note in self.answer.notes if note not in self.answer.because)]
        if self.doubt == "not found" and self.answer.offers:
            nodes = [memory.objects[i] for i in self.answer.offers]
            near = ", ".join(node.label or f"object {node.id}" for node in nodes)
            parts.append(f"the nearest are {near}")
        if self.answer.did_you_mean:
            parts.append(f"did you mean {' or '.join(map(repr, self.answer.did_you_mean))}?")
        return "; ".join(part for part in parts if part)


def retrieve(
    asked: EncodedRequest,
    memory: ObjectMemory,
    policy: MissionPolicy,
    options: GroundedOptions,
    excluded: frozenset[int],
    limit: int,
    viewer: Viewer | None,
) -> Retrieved:
    if policy.readout != "grounded":
        return Retrieved(memory.rank(asked, policy.readout, excluded, limit))
    answer = memory.answer(asked, excluded, limit, viewer=viewer, options=options)
    return Retrieved([Candidate(c.object_id, c.score, c.visual, c.head) for c in answer.candidates], answer)


def viewer_of(request: Request, policy: MissionPolicy, ports: Ports) -> Viewer | None:
    """Where the robot stands, where the sentence needs it ("nearest", "left of", "here"); else nobody is asked."""
    by_pose = request.which is not None and request.which.kind in BY_VIEWER
    by_side = any(relation.kind in DIRECTIONS for relation in request.every_relation)
    by_room = request.place in HERE or any(negation.place in HERE for negation in request.negations)
    if policy.readout != "grounded" or not (by_pose or by_side or by_room):
        return None
    pose = robot_pose(ports, policy)
    return Viewer(pose.x, pose.y, pose.yaw)
