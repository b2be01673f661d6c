"""One fold of a journal: what a live page shows, and what the scrubber of a recorded trial shows."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivers.clock import SimClock
from logs.trial import records
from logs.trial.reader import TrialReader
from logs.trial.writer import TrialWriter
from robot_app.console.open_trial import OpenTrial
from robot_app.console.snapshots import LiveMission
from robot_app.mission.view import HANDLERS, MissionView

TRIAL = Path(__file__).parents[2] / "replay" / "small_room.mcap"  # older than the console: one rejected, one confirmed


@pytest.fixture(scope="module")
def trial() -> TrialReader:
    return TrialReader(TRIAL)


@pytest.fixture(scope="module")
def opened() -> OpenTrial:
    return OpenTrial(TRIAL)


def test_the_view_of_a_whole_trial_says_how_it_ended_and_what_became_of_each_candidate(trial, opened):
    view = MissionView.of(trial.entries, opened.memory).as_json()
    assert view["sentence"] == "take me to the fire extinguisher"
    assert view["outcome"]["end"] == "CONFIRMED" and view["state"] == "confirmed"
    status = {each["object_id"]: each["status"] for each in view["candidates"]}
    assert status[view["outcome"]["object_id"]] == "confirmed"
    assert [status[each] for each in view["outcome"]["rejected"]] == ["rejected"]
    assert [look["verdict"] for look in view["looks"]] == ["no matching mask", "confirmed"]
    assert view["question"] is None and len(view["track"]) > 10


def test_each_look_has_the_judged_mask_and_the_remembered_place_as_lines_inside_the_picture(trial, opened):
    view = MissionView.of(trial.entries, opened.memory)
    confirmed = view.looks[-1]
    [judged] = [mask for mask in confirmed.masks if mask["judged"]]
    for lines in (judged["outline"], confirmed.place):
        assert lines and all(0 <= x <= 1 and 0 <= y <= 1 for line in lines for x, y in line)


def test_a_live_mission_and_its_recorded_trial_show_the_same(trial, opened):
    live = LiveMission(opened.memory)
    for entry in trial.entries:
        live.write(entry.record, entry.attached)
    last = len(opened.as_json()["steps"]) - 1
    assert json.loads(json.dumps(live.as_json())) == json.loads(opened.view_json(last))


def test_the_view_moves_through_the_states_in_the_order_of_the_trial(trial):
    view, states = MissionView(), []
    for entry in trial.entries:
        view.see(entry.record, entry.attached)
        states += [view.state] if view.state != (states or [""])[-1] else []
    assert states[:5] == ["query", "retrieve", "await_approval", "navigate", "verify"] and states[-1] == "confirmed"


def test_while_a_question_is_open_the_view_shows_it_and_afterwards_who_answered():
    view = MissionView()
    view.see(records.Query(sentence="find the lamp", who="Ada", how="console"))
    asked = records.Asked(
        sentence="May I?", because="", object_id=3, goal=None, path_length_m=2.0, memory_hash="abc", expires_s=10.0
    )
    view.see(asked)
    assert view.as_json()["question"]["sentence"] == "May I?"
    view.see(records.OperatorReply(question="May I?", reply="yes", who="Ada", how="console", at_ns=5))
    shown = view.as_json()
    assert shown["question"] is None and shown["replies"][0]["who"] == "Ada"


def test_every_step_of_a_trial_has_a_time_a_picture_and_words_from_the_file_alone(opened):
    steps = opened.as_json()["steps"]
    times = [step["at_ms"] for step in steps]
    assert times == sorted(times) and times[0] >= 0
    assert steps[-1]["frame"] is not None and opened.frame_jpeg(int(steps[-1]["frame"])).startswith(b"\xff\xd8")
    assert {"asked", "ranked", "chosen", "checked", "ended"} <= {step["kind"] for step in steps}
    assert opened.grid_png().startswith(b"\x89PNG") and opened.as_json()["site"]["objects"]


ZONE = "[[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]]"
CONFIGURED = {
    "a keep-out area": (f"[safety]\nkeep_out = {ZONE}", [[[1.0, 1.0], [2.0, 1.0], [2.0, 2.0]]]),
    "no table of safety": ("", []),
    "one of another form": ("safety = 1", []),
    "no area": ("[safety]\nkeep_out = [[[1.0, 1.0]]]", []),
}


@pytest.mark.parametrize(("configuration", "keep_out"), CONFIGURED.values(), ids=CONFIGURED)
def test_the_plan_of_a_trial_shows_the_keep_out_areas_of_its_own_configuration(
    trial, tmp_path, configuration, keep_out
):
    memory, path = tmp_path / "site.belief", tmp_path / "trial.mcap"
    memory.write_bytes(trial.memory_bytes)
    with TrialWriter(path, SimClock(0), about=trial.about, memory_path=memory, configuration=configuration) as writer:
        for entry in trial.entries:
            writer.write(entry.record, entry.attached)
    assert OpenTrial(path).as_json()["site"]["keep_out"] == keep_out


def test_every_record_that_the_view_folds_is_one_that_trials_hold():
    assert set(HANDLERS) <= set(records.RECORDS.values())
