"""`openbelief eval sites`: what a reader reproduces is a number with its interval."""

from __future__ import annotations

import json

from robot_app.cli import main


def site_rooms(folder):
    return json.loads((folder / "site3.rooms.json").read_text())


def test_a_site_is_scored_and_kept(tmp_path, capsys):
    assert main(["eval", "sites", "--seeds", "1", "--first", "3", "-o", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    [site], rates = result["sites"], result["all"]
    assert site["seed"] == 3 and site["consensus"]["of"] == site["grounded"]["of"] > 40
    assert rates["grounded"]["rate"] > rates["consensus"]["rate"]
    assert rates["relations"]["rate"] > rates["relations_consensus"]["rate"]
    assert rates["in_right_room"]["rate"] > 0.9 and rates["rooms_named"]["of"] == len(site_rooms(tmp_path))
    low, high = rates["grounded"]["interval"]
    assert low < rates["grounded"]["rate"] < high
    memory, truth = str(tmp_path / "site3.belief"), str(tmp_path / "site3.truth.json")
    rooms = str(tmp_path / "site3.rooms.json")
    assert main(["eval", "retrieval", memory, truth, "--readout", "grounded", "--rooms", rooms, "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert round(again["sr_at_1m"] * again["queries"]) == site["grounded_rooms"]["right"]
