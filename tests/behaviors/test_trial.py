"""Trials on file: written, read back, replayed, tampered with, cut off, listed."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import logs.trial.header
import logs.trial.writer
from behaviors.events import End
from drivers.ports import CameraFrame, NavigationResult, NavigationStatus
from logs.mcap_io.reader import LogError, LogReader
from logs.record.recorder import McapRecorder
from logs.trial import records
from logs.trial.header import TrialError
from logs.trial.journal import Entry
from logs.trial.reader import TrialReader
from logs.trial.writer import TrialWriter
from openbelief.rooms import Room
from openbelief.traversability import OccupancyGrid
from robot_app.cli import main
from robot_app.mission.recorded import Asking, MissionSettings, run_recorded
from robot_app.mission.replay import replay_trial

SENTENCE = "take me to the fire extinguisher"


def record(stage, make, folder, name="trial.mcap", *, seen="fire extinguisher", **script):
    """A mission recorded to a file: the stage, with .trial and .memory_path; `script` sets the stage's attributes."""
    s = stage([make.box(2.5, 5.0, "fire extinguisher", "blue vase"), make.box(5.0, 2.0, "fire extinguisher", seen)])
    for key, value in script.items():
        setattr(s, key, value)
    s.memory_path, s.trial = folder / "site.belief", folder / name
    s.memory.save(s.memory_path)
    s.outcome, failure = run_recorded(
        s.trial,
        Asking(sentence=SENTENCE),
        ports=s.ports,
        memory=s.memory,
        memory_path=s.memory_path,
        settings=MissionSettings(parameters=s.parameters, policy=s.policy),
        trial_id="trial-1",
        query_id="query-1",
        configuration="[mission]\n",
    )
    assert failure is None
    return s


@pytest.fixture(scope="module")
def reject_then_confirm(stage, make, tmp_path_factory):
    """The standard trial; read only."""
    return record(stage, make, tmp_path_factory.mktemp("trial"))


@pytest.fixture
def tampered(reject_then_confirm, tmp_path):
    """A function: the standard trial again, every entry passed through `change` (None leaves it out)."""

    def write(change):
        s, path = reject_then_confirm, tmp_path / "tampered.mcap"
        whole = TrialReader(s.trial)
        with TrialWriter(path, s.clock, about=whole.about, memory_path=s.memory_path) as writer:
            for entry in filter(None, map(change, whole.entries)):
                writer.write(entry.record, entry.attached)
        return path

    return write


def test_a_trial_replays_to_identical_decisions_twice_to_the_byte(reject_then_confirm):
    s = reject_then_confirm
    assert s.outcome.end is End.CONFIRMED and s.outcome.visits == 2
    first, second = replay_trial(s.trial), replay_trial(s.trial)
    assert first.difference is None
    assert [d.model_dump_json() for d in first.decisions] == [d.model_dump_json() for d in second.decisions]


def test_a_trial_holds_its_memory_configuration_versions_and_identity(reject_then_confirm):
    trial = TrialReader(reject_then_confirm.trial)
    attached = {a.name: a.data for a in LogReader(trial.path).attachments()}
    assert set(attached) == {"memory.belief", "mission.json", "robot.toml"}
    assert json.loads(attached["mission.json"])["parameters"]["k_max"] == 2
    assert (trial.about.trial_id, trial.about.query_id) == ("trial-1", "query-1")
    assert {"python", "numpy", "openbelief"} <= set(trial.versions) and trial.commit


def test_what_a_decision_saw_is_lossless(reject_then_confirm):
    s = reject_then_confirm
    trial = TrialReader(s.trial)
    frames = [e.attached for e in trial.entries if isinstance(e.attached, CameraFrame)]
    assert len(frames) == 3  # the mount, and two arrivals
    from_robot = s.ports.camera.latest(1.0)  # it stands where it confirmed
    assert np.array_equal(frames[-1].depth_m, from_robot.depth_m) and frames[-1].depth_m.dtype == np.float32
    assert np.array_equal(frames[-1].color, from_robot.color)
    assert frames[-1].intrinsics == from_robot.intrinsics
    grid = next(e.attached for e in trial.entries if isinstance(e.attached, OccupancyGrid))
    assert np.array_equal(grid.cells, s.ports.map.latest().cells) and grid.resolution_m == 0.05


def test_a_memory_with_other_rooms_is_another_memory_for_a_trial_that_names_its_rooms(reject_then_confirm, tmp_path):
    s = reject_then_confirm
    moved = s.memory.with_rooms([Room("hall", [[-9, -9], [9, -9], [9, 9], [-9, 9]])])
    moved.save(tmp_path / "moved.belief")
    assert moved.content_hash == s.memory.content_hash
    with pytest.raises(TrialError, match=r"^[^\n]*with other rooms[^\n]*--memory$"):
        replay_trial(s.trial, tmp_path / "moved.belief")


def test_a_trial_from_before_rooms_were_named_replays_with_any_rooms(reject_then_confirm, tmp_path):
    s, whole = reject_then_confirm, TrialReader(reject_then_confirm.trial)
    older = dataclasses.replace(whole.about, state_hash=None)
    with TrialWriter(tmp_path / "older.mcap", s.clock, about=older, memory_path=s.memory_path) as writer:
        for entry in whole.entries:
            writer.write(entry.record, entry.attached)
    s.memory.with_rooms([Room("hall", [[90, 90], [91, 90], [91, 91]])]).save(tmp_path / "moved.belief")
    assert replay_trial(tmp_path / "older.mcap", tmp_path / "moved.belief").difference is None


def test_a_map_that_did_not_change_is_in_the_file_once(reject_then_confirm):
    messages = [m.topic for m in LogReader(reject_then_confirm.trial)]
    assert messages.count("/trial/map") == 2 and messages.count("/trial/map/grid") == 1


def test_heights_of_a_grid_come_back_with_it(stage, make, tmp_path):
    s = stage([make.box(5.0, 2.0, "fire extinguisher", "fire extinguisher")])
    s.memory.save(tmp_path / "site.belief")
    plain = s.ports.map.latest()
    heights = np.where(plain.cells > 0, 0.4, np.nan).astype(np.float32)
    grid = OccupancyGrid(plain.cells, plain.resolution_m, plain.origin_xy, 7, heights)
    about = logs.trial.header.TrialHeader(
        trial_id="t", query_id="q", memory_hash=s.memory.content_hash, text_encoder_id="e", settings={}
    )
    with TrialWriter(tmp_path / "t.mcap", s.clock, about=about, memory_path=tmp_path / "site.belief") as writer:
        writer.write(records.MapUsed.of(grid), grid)
    [entry] = TrialReader(tmp_path / "t.mcap").entries
    assert np.array_equal(entry.attached.heights_m, heights, equal_nan=True)


def test_a_changed_score_is_named_with_how_far_it_is_apart(tampered):
    def change(entry):
        if not isinstance(entry.record, records.Ranking):
            return entry
        best = entry.record.candidates[0]
        candidates = (best.model_copy(update={"score": best.score + 0.01}), *entry.record.candidates[1:])
        return Entry(entry.record.model_copy(update={"candidates": candidates}))

    difference = replay_trial(tampered(change)).difference
    assert (difference.topic, difference.field) == ("/trial/ranking", "candidates[0].score")
    assert difference.by == pytest.approx(0.01) and difference.step == 1


def test_a_score_within_tolerance_is_identical(tampered):
    def change(entry):
        if not isinstance(entry.record, records.Chosen):
            return entry
        return Entry(entry.record.model_copy(update={"score": entry.record.score + 1e-7}))

    assert replay_trial(tampered(change)).difference is None


def test_changed_perception_changes_the_verdict_and_the_replay_says_so(tampered):
    def change(entry):
        if not isinstance(entry.record, records.Segments):
            return entry
        return Entry(entry.record.model_copy(update={"masks": ()}))

    difference = replay_trial(tampered(change)).difference
    assert difference.topic == "/trial/checks" and difference.field == "semantic.value"
    assert difference.recorded is not None and difference.replayed is None


def test_a_missing_input_is_named_by_what_was_asked_for(tampered):
    def change(entry):
        return None if isinstance(entry.record, records.OperatorReply) else entry

    difference = replay_trial(tampered(change)).difference
    assert "operator.confirm" in str(difference) and "/trial/navigator" in str(difference)


def test_another_goal_than_the_recorded_one_is_named(tampered):
    def change(entry):
        if not isinstance(entry.record, records.GoalAnswer):
            return entry
        goal = entry.record.goal.model_copy(update={"x": entry.record.goal.x + 1.0})
        return Entry(entry.record.model_copy(update={"goal": goal}))

    difference = replay_trial(tampered(change)).difference
    assert "the mission asked to send" in str(difference)


def test_a_fault_replays_as_it_happened(stage, make, tmp_path):
    still_moving = NavigationResult(NavigationStatus.STILL_MOVING, "no answer")
    s = record(stage, make, tmp_path, drives=[make.drive(end=None, cancel=still_moving)])
    assert s.outcome.end is End.FAULT and "use the remote" in s.outcome.reason
    assert replay_trial(s.trial).difference is None


@pytest.mark.parametrize("polls", [1, 2, 5, 9, 12])
def test_a_stop_replays_at_the_poll_at_which_it_was_heard(stage, make, tmp_path, polls):
    left = iter(range(polls))
    s = record(stage, make, tmp_path, stop_when=lambda: next(left, None) is None)
    assert s.outcome.end is End.CANCELLED
    assert replay_trial(s.trial).difference is None


def test_a_trial_cut_off_before_its_end_is_refused(tampered):
    cut = tampered(lambda entry: None if isinstance(entry.record, records.Ended) else entry)
    with pytest.raises(TrialError, match="cut off before the mission's end"):
        replay_trial(cut)


def test_a_truncated_file_is_refused_with_its_remedy(reject_then_confirm, tmp_path, capsys):
    data = reject_then_confirm.trial.read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: len(data) * 2 // 3])
    with pytest.raises(LogError, match="openbelief recover"):
        replay_trial(cut)
    assert main(["replay", str(cut)]) == 1
    assert "openbelief recover" in capsys.readouterr().err


def test_a_recording_that_is_no_trial_is_refused(tmp_path, stage):
    with McapRecorder(tmp_path / "walk.mcap", stage([]).clock):
        pass
    with pytest.raises(TrialError, match="is no trial"):
        replay_trial(tmp_path / "walk.mcap")


def test_a_memory_too_large_to_attach_is_asked_for_and_must_be_the_same(monkeypatch, stage, make, tmp_path):
    monkeypatch.setattr(logs.trial.writer, "MEMORY_MAX_BYTES", 10)
    s = record(stage, make, tmp_path)
    with pytest.raises(TrialError, match="--memory"):
        replay_trial(s.trial)
    assert replay_trial(s.trial, s.memory_path).difference is None
    stage([make.box(1.0, 1.0, "lamp", "lamp")]).memory.save(tmp_path / "other.belief")
    with pytest.raises(TrialError, match="the trial used"):
        replay_trial(s.trial, tmp_path / "other.belief")


def test_the_verb_exits_0_when_identical_and_1_with_the_difference(reject_then_confirm, tampered, capsys):
    assert main(["replay", str(reject_then_confirm.trial), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["replay"] == "identical"

    def change(entry):
        if not isinstance(entry.record, records.Ended):
            return entry
        return Entry(entry.record.model_copy(update={"visits": 7}))

    path = tampered(change)
    assert main(["replay", str(path), "--json"]) == 1
    report = json.loads(capsys.readouterr().out)
    assert (report["replay"], report["difference"]["field"], report["difference"]["by"]) == ("different", "visits", 5)


def test_trials_are_listed_with_broken_files_named(stage, make, capsys, tmp_path):
    record(stage, make, tmp_path, "a.mcap")
    record(stage, make, tmp_path, "b.mcap", seen="office chair")
    (tmp_path / "c.mcap").write_bytes(b"nonsense")
    assert main(["trials", str(tmp_path), "--json"]) == 0
    a, b, c = json.loads(capsys.readouterr().out)["trials"]
    assert (a["outcome"], a["visits"]) == ("CONFIRMED", 2)
    assert [x["verdict"] for x in a["candidates"]] == ["no matching mask", "confirmed"]
    assert (b["outcome"], b["reason"]) == ("FAILED", "attempt budget reached")
    assert "not an MCAP" in c["broken"]
    assert main(["trials", str(tmp_path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    heads = [line for line in lines if not line.startswith(" ")]
    assert len(heads) == 3 and "CONFIRMED" in lines[1] and "cannot be read" in heads[2]
    assert all(len(line) <= 80 for line in lines)


def test_a_walk_in_the_same_folder_is_no_broken_trial(stage, make, capsys, tmp_path):
    record(stage, make, tmp_path, "trial.mcap")
    with McapRecorder(tmp_path / "walk.mcap", stage([]).clock):
        pass
    assert main(["trials", str(tmp_path), "--json"]) == 0
    assert [Path(t["trial"]).name for t in json.loads(capsys.readouterr().out)["trials"]] == ["trial.mcap"]


def test_a_trial_of_another_format_names_both_and_the_commit_that_replays_it(monkeypatch, stage, make, tmp_path):
    monkeypatch.setattr(logs.trial.header, "FORMAT", "openbelief.trial/0")
    s = record(stage, make, tmp_path)
    monkeypatch.undo()
    with pytest.raises(TrialError, match=r"openbelief\.trial/0.* replays openbelief\.trial/1.*commit"):
        replay_trial(s.trial)


def test_decisions_carry_no_wall_clock(reject_then_confirm):
    """The same mission a year later decides in the same bytes, stamps of frames aside."""
    decisions = TrialReader(reject_then_confirm.trial).decisions
    for record in decisions:
        names = {name for name in type(record).model_fields if name.endswith("_ns")}
        assert names <= {"frame_stamp_ns"}
