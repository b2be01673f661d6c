"""What a file holds is checked when it is read, maybe long after it was opened: every verb says so in one line."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path

import pytest

from robot_app.cli import main

COLUMN = "SELECT data FROM columns WHERE name = '{}' AND part = 0"
PARTS = {
    "an observation": "SELECT points FROM observations ORDER BY id LIMIT 1",
    "the depth of a view": "SELECT depth FROM view_images ORDER BY stamp_ns LIMIT 1",
    "a map": "SELECT cells FROM maps LIMIT 1",
    **{
        name: COLUMN.format(name) for name in ("consensus", "concept_start", "heaviest", "aabb", "saying", "row_sha256")
    },
}
VERBS = {
    "query": ["query", "bad.belief", "armchair"],
    "query, the paper's": ["query", "bad.belief", "armchair", "--readout", "belief"],
    "query --views": ["query", "bad.belief", "armchair", "--views"],
    "query --picture": ["query", "bad.belief", "armchair", "--picture", "new.png"],
    "why": ["why", "bad.belief", "0"],
    "why --html": ["why", "bad.belief", "0", "--html", "new.html"],
    "inspect": ["inspect", "bad.belief"],
    "inspect --json": ["inspect", "bad.belief", "--json"],
    "inspect --plan": ["inspect", "bad.belief", "--plan", "new.png"],
    "inspect --html": ["inspect", "bad.belief", "--html", "new.html"],
    "inspect --view": ["inspect", "bad.belief", "--view", "0", "--out", "new.jpg"],
    "rebuild": ["rebuild", "bad.belief", "-o", "new.belief"],
    "eval retrieval": ["eval", "retrieval", "bad.belief", "walk.truth.json"],
    "eval rooms": ["eval", "rooms", "bad.belief", "walk.truth.json"],
}


@pytest.fixture(scope="module")
def folder(demo_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(shutil.copytree(demo_folder, tmp_path_factory.mktemp("damaged") / "site"))


def damage(folder: Path, part: str) -> None:
    """bad.belief: the site's memory with one bit of that part changed, where the file keeps it."""
    whole = bytearray((folder / "site.belief").read_bytes())
    with sqlite3.connect(folder / "site.belief") as db:
        value = db.execute(PARTS[part]).fetchone()[0]
    db.close()
    whole[whole.index(value[:24]) + 5] ^= 0x40
    (folder / "bad.belief").write_bytes(whole)


@pytest.mark.parametrize("part", PARTS)
def test_damage_that_is_met_late_is_one_line_of_every_verb(part, folder, monkeypatch, capsys):
    monkeypatch.chdir(folder)
    damage(folder, part)
    met = 0
    for name, arguments in VERBS.items():
        status, said = main(arguments), capsys.readouterr()
        assert status in (0, 1) and "Traceback" not in said.err, name
        if status:
            met += 1
            assert said.err.count("\n") == 1 and "bad.belief is damaged" in said.err, (name, said.err)
            assert not list(folder.glob("new.*")), "nothing half written is left"
        for path in folder.glob("new.*"):
            path.unlink()
    assert met, "no verb read it"
