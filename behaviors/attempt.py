"""One candidate being tried: where it can be looked at from, and how often that may be tried."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from behaviors.events import NO_PATH
from behaviors.path_prefix import PathPrefix
from behaviors.reobserve import ReObservation
from behaviors.to_records import goal_record
from drivers.ports import Ports
from logs.trial.journal import Journal
from openbelief.arrival_look import Look
from openbelief.goal_pose import GoalPose
from openbelief.memory import Candidate, ObjectNode

POSES_MAX = 2  # goal poses that a candidate may be approached from before it is set aside as unreached


@dataclass(frozen=True, slots=True)
class Approach:
    """A goal pose that the planner has a path to."""

    goal: GoalPose
    length_m: float
    path_prefix: PathPrefix  # its first metres


class Attempt:
    """Candidate i. goals: the goal poses not tried yet, best first; each is given out once."""

    def __init__(self, candidate: Candidate, node: ObjectNode, goals: list[GoalPose]) -> None:
        self.candidate, self.node = candidate, node
        self.goals = deque(goals)
        self.looks = ReObservation(node.centroid)
        self.doubted: tuple[Look, ...] = ()  # what doubtful looks saw at the place
        self.unlooked = 0  # looks that perception could make nothing of
        self.unseen_because = ""  # no pose can see it; only a person's yes sends the robot there
        self.approach: Approach | None = None
        self.tried = 0
        self.no_path_because = ""

    @property
    def label(self) -> str:
        return self.node.label or f"object {self.node.id}"

    def next_approach(self, ports: Ports, journal: Journal) -> Approach | None:
        """The next-best goal pose with a path; None when two were tried or none is left, `no_path_because` says why."""
        self.approach = None
        while self.goals and self.tried < POSES_MAX:
            goal = self.goals.popleft()
            self.tried += 1
            plan = ports.navigator.plan(goal.pose)
            journal.write(goal_record(self.node.id, goal, plan))
            if plan.length_m is not None:
                self.approach = Approach(goal, plan.length_m, plan.path_prefix)
                return self.approach
            self.no_path_because = plan.reason or NO_PATH
        return None
