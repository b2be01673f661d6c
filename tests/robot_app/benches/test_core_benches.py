"""The benches of the core: small runs, whose plain yardsticks find the same; how long they take is nobody's test."""

from __future__ import annotations

import json
import re

import pytest

from robot_app.cli import main


def result(capsys: pytest.CaptureFixture[str], *words: str) -> dict:
    assert main(["bench", *words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_association_finds_what_a_plain_sweep_finds(capsys: pytest.CaptureFixture[str]) -> None:
    rows = result(capsys, "association", "--observations", "90", "50", "--plain-up-to", "60")["sites"]
    assert [(row["observations"], row["equal"]) for row in rows] == [(50, True), (90, None)]
    assert all(row["cpu_s"] > 0 and row["peak_mb"] > 0 and row["objects"] >= 2 for row in rows)
    assert rows[0]["ratio"] > 0 and rows[1]["ratio"] is None


def test_acquisition_keeps_what_plain_dbscan_keeps(capsys: pytest.CaptureFixture[str]) -> None:
    row = result(capsys, "acquire", "--masks", "7", "--frames", "1", "--jobs", "2")
    assert row["observations"] == 7 and row["equal"] is True and row["ratio"] > 0
    assert row["jobs"] == 2 and row["wall_frames_per_s"] > 0 and row["jobs_frames_per_s"] > 0


def test_goal_poses_are_as_far_as_a_plain_search_says(capsys: pytest.CaptureFixture[str]) -> None:
    rows = result(capsys, "goal", "--site", "32", "--rooms-away", "1")["candidates"]
    alone = result(capsys, "goal", "--site", "32", "--rooms-away", "1", "--no-plain")["candidates"]
    assert rows[0]["poses"] > 0 and rows[0]["equal"] is True and alone[0]["equal"] is None
    assert [row["wall"] for row in rows] == ["", "no door", "door at its end"]
    assert rows[1]["poses"] == 0 and rows[1]["equal"] is True and "no way" in rows[1]["because"]
    assert rows[2]["poses"] > 0 and rows[2]["equal"] is True and rows[2]["way_m"] > rows[0]["way_m"]


def test_a_file_opens_with_all_that_was_written_and_answers_before_it_is_all_read(
    capsys: pytest.CaptureFixture[str],
) -> None:
    [row] = result(capsys, "open", "--objects", "30", "--views", "3", "--points", "20")["files"]
    assert (row["objects"], row["observations"], row["points"], row["equal"]) == (30, 90, 60, True)
    assert row["open_cpu_s"] > 0 and row["first_answer_cpu_s"] > 0 and row["process_mb"] > 0


def test_a_ranking_from_matrices_is_the_one_of_float64_object_by_object(capsys: pytest.CaptureFixture[str]) -> None:
    rows = result(capsys, "retrieval", "--objects", "300")["rankings"]
    assert [(row["readout"], row["equal"]) for row in rows] == [
        ("consensus", True),
        ("early", True),
        ("belief", True),
        ("grounded", True),
        ("grounded", None),
        ("grounded", None),
    ]
    assert all(row["reads"] > 0 and row["ratio"] > 0 for row in rows[:4])
    assert all(row["first_cpu_s"] > 0 for row in rows[3:]) and "next to" in rows[4]["sentence"]
    assert "nearest" in rows[5]["sentence"]


@pytest.mark.parametrize(
    "words",
    [
        ["open", "--objects", "none"],
        ["retrieval", "--objects", "0"],
        ["association", "--observations", "0"],
        ["association", "--observations", "many"],
        ["acquire", "--masks", "-1"],
        ["goal", "--site", "2"],
        ["goal", "--site", "nan"],
    ],
)
def test_wrong_usage_is_status_two_and_one_line(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["bench", *words])
    assert ended.value.code == 2 and re.search(r": a (whole )?number .*from \d+ to \d+, not '", capsys.readouterr().err)


def test_a_room_beyond_the_site_is_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "goal", "--site", "24", "--rooms-away", "3"]) == 1
    assert "has no room so far away" in capsys.readouterr().err
