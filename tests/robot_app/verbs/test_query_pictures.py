from __future__ import annotations

import cv2
import pytest

from robot_app.cli import main
from support.verbs import answer


@pytest.fixture(scope="module")
def memory(demo_folder):
    return demo_folder / "site.belief"


def test_where_it_was_seen_is_listed_newest_first_with_its_pictures(memory, tmp_path, capsys):
    asked = answer(capsys, "query", memory, "bucket", "--views", "--views-dir", tmp_path / "seen")
    views = asked["views"]
    assert views and all(view["object_id"] == asked["candidates"][0]["object_id"] for view in views)
    stamps = [view["stamp_ns"] for view in views]
    assert stamps == sorted(stamps, reverse=True)
    for view in views:
        assert cv2.imread(view["picture"]) is not None


def test_candidates_are_drawn_on_the_plan(memory, tmp_path, capsys):
    picture = tmp_path / "asked.svg"
    asked = answer(capsys, "query", memory, "bucket", "--picture", picture, "--limit", 2)
    drawn = picture.read_text()
    for rank, candidate in enumerate(asked["candidates"], start=1):
        assert f"{rank}. {candidate['label']} ({candidate['object_id']})" in drawn


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--picture", "plan.gif"], "should end in .png or .svg"),
        (["--picture", "nowhere/plan.png"], "does not exist"),
        (["--views-dir", "seen"], "give --views too"),
        (["--views", "--views-dir", "a-file"], "is a file"),
    ],
)
def test_what_cannot_be_written_is_one_line(memory, tmp_path, monkeypatch, capsys, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a-file").write_text("mine")
    assert main(["query", str(memory), "bucket", *arguments]) == 1
    error = capsys.readouterr().err
    assert said in error and error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["a-file"]
