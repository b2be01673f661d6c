"""What the pages are given: site, evidence, trials, notes, export."""

from __future__ import annotations

import io
import json
import shutil
import zipfile

import pytest

from logs.trial.reader import TrialReader
from logs.trial.records import Checks
from robot_app.mission.trial_shelf import INDEX, TrialShelf
from robot_app.mission.trials import stories_of
from tests.robot_app.console.conftest import SMALL_ROOM

NAME = "small_room.mcap"


def test_the_site_lists_objects_that_are_no_background_and_the_map_is_a_picture(console, small_room):
    visitor = console.visitor()
    site = visitor.json("/api/site")
    assert site["memory_hash"] == small_room.memory.content_hash
    assert {each["id"] for each in site["objects"]} == {n.id for n in small_room.memory.objects if not n.background}
    assert visitor.get("/api/grid.png")[1].startswith(b"\x89PNG")
    assert visitor.json("/api/grid")["width"] == small_room.grid.cells.shape[1]


def test_an_objects_evidence_names_its_phrases_with_support_and_how_often_it_was_seen(console, small_room):
    visitor, node = console.visitor(), next(n for n in small_room.memory.objects if n.label == "fire extinguisher")
    card = visitor.json(f"/api/objects/{node.id}")
    assert (card["seen"], card["frames"]) == (len(node.observations), node.frames)
    support = [each["support"] for each in card["phrases"]]
    assert support == sorted(support, reverse=True)
    assert visitor.get("/api/objects/99999")[0] == 404
    if card["crop"]:
        assert visitor.get(f"/api/objects/{node.id}/crop.jpg")[1].startswith(b"\xff\xd8")


def test_a_trial_is_listed_scrubbed_noted_and_exported(console):
    visitor = console.visitor()
    [row] = visitor.json("/api/trials")["trials"]
    while row.get("reading"):
        [row] = visitor.json("/api/trials")["trials"]
    assert (row["name"], row["outcome"], row["visits"]) == (NAME, "CONFIRMED", 2)
    trial = visitor.json(f"/api/trials/{NAME}")
    view = visitor.json(f"/api/trials/{NAME}/view/{len(trial['steps']) - 1}")
    assert view["outcome"]["end"] == "CONFIRMED"
    assert visitor.get(f"/api/trials/{NAME}/view/99999")[0] == 404
    status, noted = visitor.post(f"/api/trials/{NAME}/notes", {"text": "The <b>umbrella stand</b> again."})
    assert status == 200 and noted["notes"][0]["who"] == "ada"
    _, body, headers = visitor.get(f"/api/trials/{NAME}/export")
    assert "small_room.zip" in headers["content-disposition"]
    with zipfile.ZipFile(io.BytesIO(body)) as archive:
        assert set(archive.namelist()) == {NAME, "small_room.notes.jsonl"}
        assert archive.read(NAME) == (console.folder / NAME).read_bytes()


def test_a_viewer_reads_notes_and_writes_none(console):
    status, answer = console.visitor("viewer").post(f"/api/trials/{NAME}/notes", {"text": "hello"})
    assert status == 403 and "viewer" in answer["error"]


@pytest.mark.parametrize("name", ["..%2F..%2Fetc%2Fpasswd", "nothing.mcap", ".hidden.mcap", "small_room.txt"])
def test_a_name_that_is_no_trial_of_the_folder_is_not_found(console, name):
    assert console.visitor().get(f"/api/trials/{name}")[0] == 404


def test_a_trial_that_cannot_be_read_says_so(console):
    (console.folder / "cut.mcap").write_bytes((console.folder / NAME).read_bytes()[:50_000])
    status, body, _ = console.visitor().get("/api/trials/cut.mcap")
    assert status == 422 and "openbelief recover" in json.loads(body)["error"]


@pytest.fixture
def trials(tmp_path):
    """A folder with one trial, which no console reads meanwhile."""
    folder = tmp_path / "trials"
    folder.mkdir()
    shutil.copy(SMALL_ROOM, folder / NAME)
    return folder


def test_the_list_reads_each_trial_once_and_again_only_where_it_changed(trials):
    shelf = TrialShelf(trials)
    shelf.read_new()
    assert shelf.rows()[0]["outcome"] == "CONFIRMED" and (trials / INDEX).exists()
    again = TrialShelf(trials)
    assert again.rows()[0]["outcome"] == "CONFIRMED", "without reading a trial"
    (trials / NAME).write_bytes(b"something else")
    assert again.rows()[0].get("reading")
    again.read_new()
    assert "not an MCAP" in again.rows()[0]["broken"]


def test_a_trial_that_is_moved_away_while_the_list_is_read_stops_no_reading(trials, monkeypatch):
    shelf = TrialShelf(trials)
    files = list(shelf._files())
    (trials / NAME).rename(trials / "elsewhere")
    monkeypatch.setattr(shelf, "_files", lambda: files)  # as they were a moment ago
    assert shelf.read_new() == 0 and "is not there" in shelf.rows()[0]["broken"]


def test_a_trial_that_lost_its_beginning_is_listed_by_what_is_left():
    checks = next(record for record in TrialReader(SMALL_ROOM).decisions if isinstance(record, Checks))
    assert stories_of([checks]) == {checks.object_id: (f"object {checks.object_id}", checks.verdict)}


def test_two_thousand_trials_are_listed_at_once(trials):
    row = TrialShelf(trials)
    row.read_new()
    known = json.loads((trials / INDEX).read_text())["trials"][NAME]["row"]
    entries = {}
    for number in range(2000):
        path = trials / f"t{number:04d}.mcap"
        path.write_bytes(b"")
        found = path.stat()
        entries[path.name] = {"stamp": [found.st_mtime_ns, 0], "row": known | {"started_ms": number}}
    (trials / INDEX).write_text(json.dumps({"format": 1, "trials": entries}))
    rows = TrialShelf(trials).rows()
    assert len(rows) == 2001 and sum(1 for each in rows if each.get("reading")) == 1


def test_the_index_of_another_version_is_read_anew(trials):
    (trials / INDEX).write_text('{"format": 0, "trials": {"small_room.mcap": 1}}')
    assert TrialShelf(trials).rows()[0]["reading"]


def test_what_is_listed_is_what_the_trial_says(trials):
    shelf = TrialShelf(trials)
    shelf.read_new()
    [row], trial = shelf.rows(), TrialReader(trials / NAME)
    assert (row["sentence"], row["reason"]) == (trial.query.sentence, trial.outcome.reason)
    assert [story[1] for story in row["candidates"]] == ["no matching mask", "confirmed"]
