"""Algorithm 1 of the paper: one query, from the sentence to a confirmed object or a named end.

    R <- {}                                            query
    for k = 1 .. K_max:                                exclude: attempt budget reached
        i <- retrieve(q, R); NONE: return FAIL         retrieve
        navigate to the candidate goal g_i             await_approval, navigate
        acquire an arrival observation and evaluate    verify
        insufficient visibility: re-observe once       re_observe, verify
        confirmed: return CONFIRM                      verify
        R <- R + {i}                                   exclude
    return FAIL

`behaviors.machine` says which event leads where. Each state acts in one method below, which asks the ports and returns
the event with its reason. A candidate that could not be reached or seen is set aside in U: that is no evidence against
it and costs no attempt.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Literal

from behaviors.approval import approval_question, destination
from behaviors.arrival import arrival_frame, camera_mount, robot_pose
from behaviors.asking import Retrieved, retrieve, viewer_of
from behaviors.attempt import Attempt
from behaviors.checking import checks_of
from behaviors.drive import RobotMayMove, drive, halted, refusal
from behaviors.events import (
    BUDGET_REACHED,
    ENDING,
    NO_CANDIDATE_LEFT,
    NO_PATH,
    NOT_FOUND,
    REPLIES,
    TOLD,
    End,
    Event,
    Outcome,
    Step,
)
from behaviors.machine import MissionMachine
from behaviors.path_prefix import PathPrefix, is_crowded
from behaviors.policy import MissionPolicy
from behaviors.query import QueryProgress
from behaviors.to_records import (
    checks_record,
    chosen_record,
    ended_record,
    look_record,
    no_goal_record,
    ranking_record,
)
from drivers.ports import Interrupted, PortError, Ports
from logs.trial import records
from logs.trial.journal import Journal
from logs.trial.recording_ports import recorded
from openbelief.arrays import Array
from openbelief.goal_pose import GoalSearch, goal_poses
from openbelief.grounded.options import GroundedOptions
from openbelief.memory import ObjectMemory
from openbelief.parameters import Parameters
from openbelief.perception.ports import FrameUnseen, PerceptionFailed
from openbelief.request import parse
from openbelief.verification import Verdict

RANKED = 10  # candidates whose scores are written down
SET_ASIDE_MAX = 3
FROM_HERE = "look once more from here"

# What the checks say -> the event; any other verdict rejects.
VERDICTS = {
    Verdict.CONFIRMED: Event.MATCHED,
    Verdict.INSUFFICIENT_VISIBILITY: Event.LOW_VISIBILITY,
    Verdict.DOUBTFUL: Event.DOUBTFUL,
}


class Mission:
    """Runs one query at a time over a frozen memory. `journal` receives every consumed input and every decision."""

    def __init__(
        self,
        ports: Ports,
        memory: ObjectMemory,
        parameters: Parameters,
        policy: MissionPolicy,
        journal: Journal,
        grounded: GroundedOptions | None = None,
    ) -> None:
        self._ports, self._journal = recorded(ports, journal), journal
        self._memory, self._parameters, self._policy = memory, parameters, policy
        self._grounded = grounded or GroundedOptions()
        self._acts: dict[str, Callable[[QueryProgress, Step], Step]] = {
            "query": self._query,
            "retrieve": self._retrieve,
            "await_approval": self._await_approval,
            "navigate": self._navigate,
            "verify": self._verify,
            "re_observe": self._re_observe,
            "exclude": self._exclude,
        }

    def run(self, sentence: str, *, who: str = "", how: str = "", after: str = "") -> Outcome:
        """One query to its end. Raises ValueError where the sentence names nothing; other trouble ends in FAULT.

        who, how: who asks, and by which client. after: the sentence that "it" and "the other one" refer to.
        """
        query = QueryProgress(self._memory.asked(parse(sentence, parse(after) if after else None)))
        self._journal.write(records.Query(sentence=sentence, who=who, how=how, after=after))
        machine, step, frozen = MissionMachine(), Step(Event.ASKED, ""), self._memory.fingerprint()
        while not machine.is_terminated:
            source = str(machine.current_state_value)
            step = self._next(source, query, step)
            if step.event in ENDING and self._memory.fingerprint() != frozen:
                step = Step(Event.FAULT, "the memory changed during the mission: open it again from its file")
            machine.send(step.event)
            target = str(machine.current_state_value)
            self._journal.write(
                records.Transition(source=source, event=step.event, target=target, because=step.because)
            )
        return self._ended(End(target.upper()), query, step)

    # ---- the states, in the order of Algorithm 1

    def _query(self, query: QueryProgress, _: Step) -> Step:
        """Before anybody is asked anything: can and may the robot drive, does its camera see, and from where?"""
        if why := self._ports.navigator.unavailable() or refusal(self._ports):
            return Step(Event.FAULT, why)
        query.mount = camera_mount(self._ports, self._policy)
        query.viewer = viewer_of(query.asked.request, self._policy, self._ports)
        return Step(Event.ASKED, f"looking for {query.target!r}")

    def _retrieve(self, query: QueryProgress, _: Step) -> Step:
        """i <- retrieve(q, R_q), over what is not set aside either; and its goal poses g_i."""
        excluded = frozenset(query.rejected + query.set_aside)
        found_now = retrieve(query.asked, self._memory, self._policy, self._grounded, excluded, RANKED, query.viewer)
        ranking = query.ranking = found_now.candidates
        self._journal.write(
            ranking_record(found_now, self._memory, query.target, self._policy.readout, query.rejected, query.set_aside)
        )
        if not ranking:
            return query.nothing_left(self._memory.nothing_because(query.asked, excluded))
        if doubted := self._doubted(query, found_now):
            return doubted
        wanted = query.wanted
        node = self._memory.objects[wanted.object_id]
        found = self._goal_search(node.points, query)
        attempt = query.attempt = Attempt(wanted, node, list(found.poses))
        self._journal.write(chosen_record(query.visits + 1, attempt.label, wanted))
        if not found.poses:
            self._journal.write(no_goal_record(node.id, found.reason))
            if not found.blind or self._policy.motion == "allow" or self._policy.unseen == "set aside":
                return Step(Event.UNSEEN, found.reason)
            attempt.goals, attempt.unseen_because = deque(found.blind), found.reason
        approach = attempt.next_approach(self._ports, self._journal)
        if approach is None:
            return Step(Event.UNREACHED, attempt.no_path_because)
        return Step(Event.CANDIDATE_FOUND, f"the {attempt.label} scores {wanted.score:.2f}")

    def _doubted(self, query: QueryProgress, found: Retrieved) -> Step | None:
        """Not found drives nowhere, unsure asks a person; None where it goes on. A person's own choice is no doubt."""
        query.doubt_because, doubt, why = "", found.doubt, found.told(self._memory)
        if doubt == "found" or query.picked is not None:
            if why:
                self._ports.operator.tell(f"Note: {why}.")
            return None
        if self._policy.doubt == "insist":
            self._ports.operator.tell(f"{doubt.capitalize()}, and you insist: {why}.")
            return None
        if doubt == "unsure" and self._policy.doubt == "ask" and self._policy.motion == "ask":
            query.doubt_because = why
            return None
        self._ports.operator.tell(f"{doubt.capitalize()}: {why}.")
        if query.visits:
            return Step(Event.EXHAUSTED, NO_CANDIDATE_LEFT)
        return Step(Event.NOT_FOUND, NOT_FOUND if doubt == "not found" else f"unsure: {why}")

    def _await_approval(self, query: QueryProgress, _: Step) -> Step:
        """A person's yes for this candidate: the drive, its other goal pose, and the looks around it."""
        if self._policy.motion == "allow":
            self._ports.operator.tell(f"I walk to {destination(query.current, query.target)}.")
            return Step(Event.APPROVED, "the configuration allows motion without asking")
        attempt = query.current
        asked = approval_question(attempt, query.ranking, self._memory, query.target, query.doubt_because)
        reply = self._ports.operator.confirm(asked, self._policy.confirm_timeout_s)
        event, because = REPLIES[reply.word]
        stopped = None
        if event is Event.STOP:  # with the reason, where there is one
            stopped = self._stopped() or halted(because, self._ports, self._policy)
        if event is Event.DECLINED and attempt.unseen_because:
            return Step(Event.UNSEEN, attempt.unseen_because)  # as if nobody could have been asked
        query.picked = reply.object_id if event is Event.TAKEN else query.picked
        query.skipped = attempt.node.id if reply.object_id is None else reply.object_id
        return stopped or Step(event, because)

    def _navigate(self, query: QueryProgress, _: Step) -> Step:
        """Navigate to g_i; where that fails or something new stands there, from the next-best pose before U."""
        attempt = query.current
        if attempt.approach is None:
            raise RuntimeError("No goal pose was chosen.")
        if why := self._ports.navigator.unavailable():
            return Step(Event.FAULT, why)
        step = drive(attempt.approach.goal.pose, self._ports, self._policy, attempt.approach.path_prefix)
        crowd = is_crowded(self._ports, self._policy) if step.event is Event.ARRIVED else None
        because = crowd or step.because
        if (crowd or step.event is Event.UNREACHED) and attempt.next_approach(self._ports, self._journal):
            return Step(Event.NEXT_POSE, because)
        return replace(step, because=because)  # crowded and no other pose: it looks from here

    def _verify(self, query: QueryProgress, last: Step) -> Step:
        """Acquire an arrival observation and evaluate candidate i with the three ordered checks."""
        query.arrivals += 1
        frame = arrival_frame(query.arrivals, last.stood_ns, self._ports, self._policy)
        after = frame.stamp_ns + 1  # another look, even from here, is another frame
        try:
            masks = self._ports.perception.perceive(frame)
        except (FrameUnseen, Interrupted) as nothing:  # a STOP itself is asked for after every state
            if isinstance(nothing, FrameUnseen) and self._policy.unlooked == "fault":
                raise
            query.current.unlooked += 1
            return Step(Event.UNLOOKED, str(nothing), stood_ns=after)
        node = query.current.node
        checks, relative = checks_of(
            frame,
            masks,
            query,
            self._memory,
            self._policy,
            self._parameters,
            self._grounded,
            feature_text_aligned=self._ports.perception.feature_text_aligned,
        )
        self._journal.write(checks_record(node.id, frame.stamp_ns, checks, relative))
        if checks.verdict is Verdict.CONFIRMED:
            query.confirmed = node.id
        return Step(VERDICTS.get(checks.verdict, Event.REJECTED), checks.reason, stood_ns=after)

    def _re_observe(self, query: QueryProgress, last: Step) -> Step:
        """One bounded re-observation; with no look left, what could not be seen is not confirmed.

        What was in doubt is looked at once more all the same, from where the robot stands. So is a place of which one
        frame gave perception nothing, before the robot moves for it; where no frame does it is set aside: that is no
        evidence against it.
        """
        attempt = query.current
        if last.event is Event.UNLOOKED and attempt.unlooked == 1:
            return replace(last, event=Event.LOOKED_AGAIN, because=FROM_HERE)
        look = attempt.looks.next_look(robot_pose(self._ports, self._policy), attempt.goals)
        if look is None and last.event is Event.DOUBTFUL:
            return replace(last, event=Event.LOOKED_AGAIN, because=FROM_HERE)
        if look is None:
            return Step(Event.UNREACHED if last.event is Event.UNLOOKED else Event.REJECTED, last.because)
        self._journal.write(look_record(attempt.node.id, look))
        path_prefix: PathPrefix = ()
        if look.is_move:
            plan = self._ports.navigator.plan(look.pose)
            if plan.length_m is None:
                return Step(Event.UNREACHED, plan.reason or NO_PATH)
            path_prefix = plan.path_prefix
        step = drive(look.pose, self._ports, self._policy, path_prefix)
        arrived = step.event is Event.ARRIVED
        return replace(step, event=Event.LOOKED_AGAIN, because=look.reason) if arrived else step

    def _exclude(self, query: QueryProgress, last: Step) -> Step:
        """R_q <- R_q + {i} where verification rejected it, else U; then the bounds on both."""
        rejected, declined = last.event is Event.REJECTED, last.event is Event.SKIPPED
        object_id = query.skipped if declined and query.skipped is not None else query.current.node.id
        (query.rejected if rejected else query.set_aside).append(object_id)
        query.declined += [object_id] if declined else []
        where: Literal["rejected", "set aside"] = "rejected" if rejected else "set aside"
        self._journal.write(
            records.Exclusion(object_id=object_id, where=where, because=last.because, declined=declined)
        )
        if len(query.rejected) >= self._parameters.k_max:
            return Step(Event.BUDGET_REACHED, BUDGET_REACHED)
        if len(query.set_aside) - len(query.declined) >= SET_ASIDE_MAX:
            return query.nothing_left(f"{SET_ASIDE_MAX} could not be looked at")
        return Step(Event.EXCLUDED, last.because)

    # ---- around them

    def _next(self, state: str, query: QueryProgress, last: Step) -> Step:
        """The state's step; a STOP before or during it comes first, and whatever is raised is a FAULT."""
        try:
            step = self._stopped() or self._acts[state](query, last)
            if step.event not in (Event.STOP, Event.FAULT):
                step = self._stopped() or step
            if step.event in TOLD:
                self._ports.operator.tell(TOLD[step.event].format(label=query.current.label, because=step.because))
        except Exception as error:  # noqa: BLE001 - a mission ends with a name, whatever breaks; drive() has cancelled
            return Step(Event.FAULT, _fault_sentence(error))
        return step

    def _stopped(self) -> Step | None:
        stop = self._ports.operator.stop_requested()
        return halted(stop.because, self._ports, self._policy) if stop else None

    def _goal_search(self, points: Array, query: QueryProgress) -> GoalSearch:
        if query.mount is None:
            raise RuntimeError("The camera mount was not measured.")
        return goal_poses(
            points,
            self._ports.map.latest(),
            robot_pose(self._ports, self._policy),
            query.mount.T_base_camera,
            query.mount.intrinsics,
            self._parameters,
        )

    def _ended(self, end: End, query: QueryProgress, step: Step) -> Outcome:
        outcome = query.outcome(end, step.because)
        self._journal.write(ended_record(outcome))
        self._ports.operator.tell(f"{end.replace('_', ' ')}: {outcome.reason}")
        return outcome


def _fault_sentence(error: Exception) -> str:
    """A port's sentence as it is; anything else with its kind, for it is a defect."""
    known = isinstance(error, PortError | PerceptionFailed | RobotMayMove)
    return str(error) if known else f"unexpected {type(error).__name__}: {error}"
