"""The whole table: every state x every event, and the words that go with them."""

from __future__ import annotations

import pytest
from statemachine.exceptions import TransitionNotAllowed

from behaviors.events import ENDING, ENDS, NAVIGATION_EVENTS, REPLIES, TOLD, End, Event
from behaviors.machine import MissionMachine
from drivers.ports import NavigationStatus

WORKING = ["query", "retrieve", "await_approval", "navigate", "verify", "re_observe", "exclude"]
FINAL = ["confirmed", "failed", "navigation_failed", "cancelled", "fault"]
TABLE = {
    ("query", "asked"): "retrieve",
    ("retrieve", "candidate_found"): "await_approval",
    ("retrieve", "unseen"): "exclude",
    ("retrieve", "unreached"): "exclude",
    ("retrieve", "not_found"): "failed",
    ("retrieve", "exhausted"): "failed",
    ("retrieve", "none_verified"): "navigation_failed",
    ("await_approval", "approved"): "navigate",
    ("await_approval", "declined"): "cancelled",
    ("await_approval", "unseen"): "exclude",
    ("await_approval", "skipped"): "exclude",
    ("await_approval", "taken"): "retrieve",
    ("retrieve", "declined"): "cancelled",
    ("navigate", "arrived"): "verify",
    ("navigate", "next_pose"): "navigate",
    ("navigate", "unreached"): "exclude",
    ("verify", "matched"): "confirmed",
    ("verify", "low_visibility"): "re_observe",
    ("verify", "doubtful"): "re_observe",
    ("verify", "unlooked"): "re_observe",
    ("verify", "rejected"): "exclude",
    ("re_observe", "looked_again"): "verify",
    ("re_observe", "rejected"): "exclude",
    ("re_observe", "unreached"): "exclude",
    ("exclude", "excluded"): "retrieve",
    ("exclude", "budget_reached"): "failed",
    ("exclude", "exhausted"): "failed",
    ("exclude", "none_verified"): "navigation_failed",
} | {(state, event): end for state in WORKING for event, end in (("stop", "cancelled"), ("fault", "fault"))}


def at(state: str) -> MissionMachine:
    return MissionMachine(start_value=state)


@pytest.mark.parametrize("event", [*Event, "an_unknown_event"])
@pytest.mark.parametrize("state", [*WORKING, *FINAL])
def test_every_state_takes_exactly_the_events_of_the_table(state, event):
    machine = at(state)
    if target := TABLE.get((state, str(event))):
        machine.send(event)
        assert machine.current_state_value == target
    else:
        with pytest.raises(TransitionNotAllowed):
            machine.send(event)
        assert machine.current_state_value == state


def test_the_machine_has_no_states_or_events_outside_the_table():
    assert {state.value for state in MissionMachine.states} == {*WORKING, *FINAL}
    assert {event.id for event in MissionMachine.events} == {event.value for event in Event}
    assert MissionMachine.initial_state.value == "query"


def test_every_final_state_is_an_end_with_its_words():
    assert {state.value.upper() for state in MissionMachine.final_states} == set(End)
    assert set(ENDS) == set(End)


def test_every_end_but_fault_is_reached_by_events_before_which_the_memory_is_compared():
    ending = {event for (_, event), target in TABLE.items() if target in FINAL and target != "fault"}
    assert ending == {event.value for event in ENDING}


def test_every_navigation_status_means_one_event_that_a_drive_may_report():
    assert set(NAVIGATION_EVENTS) == set(NavigationStatus)
    assert all(("navigate", event.value) in TABLE for event in NAVIGATION_EVENTS.values())


def test_every_reply_of_the_operator_is_an_event_of_await_approval():
    assert all(("await_approval", event.value) in TABLE for event, _ in REPLIES.values())


def test_an_exception_in_a_callback_surfaces():
    class Listener:
        def on_enter_retrieve(self) -> None:
            raise RuntimeError("surfaced")

    with pytest.raises(RuntimeError, match="surfaced"):
        MissionMachine(listeners=[Listener()]).send("asked")


def test_what_the_operator_is_told_names_the_candidate_and_the_reason():
    for words in TOLD.values():
        assert "{label}" in words and "{because}" in words
