"""The mission's states and events: Algorithm 1 of the paper with an operator, and nothing that acts.

`StateMachine` (not StateChart) is the strict kind: an event that a state does not accept raises TransitionNotAllowed,
and nothing is caught. The machine is built here and never loaded from a file.
"""

from __future__ import annotations

from statemachine import State, StateMachine


class MissionMachine(StateMachine):
    """One query. Every state that is not an end accepts `stop` and `fault`."""

    query = State("query", initial=True)
    retrieve = State("retrieve")
    await_approval = State("await approval", value="await_approval")
    navigate = State("navigate")
    verify = State("verify")
    re_observe = State("re-observe")
    exclude = State("exclude")
    confirmed = State("CONFIRMED", final=True)
    failed = State("FAILED", final=True)
    navigation_failed = State("NAVIGATION FAILED", final=True)
    cancelled = State("CANCELLED", final=True)
    fault_end = State("FAULT", value="fault", final=True)

    asked = query.to(retrieve)
    candidate_found = retrieve.to(await_approval)
    unseen = retrieve.to(exclude) | await_approval.to(exclude)
    approved = await_approval.to(navigate)
    declined = await_approval.to(cancelled) | retrieve.to(cancelled)
    skipped = await_approval.to(exclude)
    taken = await_approval.to(retrieve)
    arrived = navigate.to(verify)
    next_pose = navigate.to.itself()
    unreached = retrieve.to(exclude) | navigate.to(exclude) | re_observe.to(exclude)
    matched = verify.to(confirmed)
    low_visibility = verify.to(re_observe)
    doubtful = verify.to(re_observe)
    unlooked = verify.to(re_observe)
    looked_again = re_observe.to(verify)
    rejected = verify.to(exclude) | re_observe.to(exclude)
    excluded = exclude.to(retrieve)
    budget_reached = exclude.to(failed)
    not_found = retrieve.to(failed)
    exhausted = retrieve.to(failed) | exclude.to(failed)
    none_verified = retrieve.to(navigation_failed) | exclude.to(navigation_failed)
    stop = cancelled.from_(query, retrieve, await_approval, navigate, verify, re_observe, exclude)
    fault = fault_end.from_(query, retrieve, await_approval, navigate, verify, re_observe, exclude)
