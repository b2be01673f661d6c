"""A path that is wrong in any way, for every verb and every option that takes one, and a port that somebody else has:
one line."""

from __future__ import annotations

import os
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

import pytest

from robot_app.cli import main

# verb and what it needs; HERE stands for the wrong path. Everything else is there, in a demo's folder.
READ = {
    "record --config": ["record", "-o", "new.mcap", "--config", "HERE"],
    "record --sheet": ["record", "-o", "new.mcap", "--config", "robot.toml", "--sheet", "HERE"],
    "map recordings": ["map", "HERE", "-o", "new.belief", "--perception", "scripted:small.json"],
    "map --perception recorded": ["map", "walk.mcap", "-o", "new.belief", "--perception", "recorded:HERE"],
    "map --perception scripted": ["map", "walk.mcap", "-o", "new.belief", "--perception", "scripted:HERE"],
    "map --perception detector": ["map", "walk.mcap", "-o", "new.belief", "--perception", "detector:HERE"],
    "map --perception paper": ["map", "walk.mcap", "-o", "new.belief", "--perception", "paper:HERE"],
    "map --rooms": ["map", "walk.mcap", "-o", "new.belief", "--perception", "scripted:small.json", "--rooms", "HERE"],
    "map --parameters": ["map", "walk.mcap", "-o", "n", "--perception", "scripted:small.json", "--parameters", "HERE"],
    "query memory": ["query", "HERE", "chair"],
    "why memory": ["why", "HERE", "0"],
    "inspect memory": ["inspect", "HERE"],
    "rebuild memory": ["rebuild", "HERE", "-o", "new.belief"],
    "rebuild --parameters": ["rebuild", "site.belief", "-o", "new.belief", "--parameters", "HERE"],
    "rebuild --rooms": ["rebuild", "site.belief", "-o", "new.belief", "--rooms", "HERE"],
    "run --config": ["run", "--config", "HERE"],
    "ask --config": ["ask", "the chair", "--config", "HERE"],
    "ask --audio": ["ask", "--audio", "HERE", "--config", "robot.toml"],
    "mcp --config": ["mcp", "--config", "HERE"],
    "onboard --config": ["onboard", "--config", "HERE"],
    "onboard --reset": ["onboard", "--reset", "--config", "HERE"],
    "accounts --config": ["accounts", "list", "--config", "HERE"],
    "doctor --config": ["doctor", "--config", "HERE"],
    "replay trial": ["replay", "HERE"],
    "replay --memory": ["replay", "trial.mcap", "--memory", "HERE"],
    "replay --perception": ["replay", "trial.mcap", "--perception", "recorded:HERE"],
    "trials folder": ["trials", "HERE"],
    "recover file": ["recover", "HERE"],
    "eval retrieval memory": ["eval", "retrieval", "HERE", "walk.truth.json"],
    "eval retrieval truth": ["eval", "retrieval", "site.belief", "HERE"],
    "eval retrieval --rooms": ["eval", "retrieval", "site.belief", "walk.truth.json", "--rooms", "HERE"],
    "eval rooms memory": ["eval", "rooms", "HERE", "walk.truth.json"],
    "eval rooms truth": ["eval", "rooms", "site.belief", "HERE"],
    "models check": ["models", "check", "HERE"],
    "demo --scene": ["demo", "--scene", "HERE", "--out", "new"],
}
WRITE = {
    "record -o": ["record", "-o", "HERE", "--config", "robot.toml", "--minutes", "0.01"],
    "map -o": ["map", "walk.mcap", "-o", "HERE", "--perception", "scripted:small.json"],
    "query --picture": ["query", "site.belief", "armchair", "--picture", "HERE"],
    "why --html": ["why", "site.belief", "0", "--html", "HERE"],
    "inspect --plan": ["inspect", "site.belief", "--plan", "HERE"],
    "inspect --html": ["inspect", "site.belief", "--html", "HERE"],
    "rebuild -o": ["rebuild", "site.belief", "-o", "HERE"],
    "recover -o": ["recover", "walk.mcap", "-o", "HERE"],
    "ask --trial": ["ask", "the armchair", "--config", "robot.toml", "--trial", "HERE"],
    "demo --out": ["demo", "--scene", "small.json", "--out", "HERE"],
    "certs -o": ["certs", "-o", "HERE", "--robot", "192.168.1.4"],
}
PICTURE = {"inspect --out": ["inspect", "site.belief", "--view", "0", "--out", "HERE"]}


def _missing(_folder: Path) -> Path:
    return Path("not-there")


def _a_folder(folder: Path) -> Path:
    (folder / "a-folder").mkdir()
    return Path("a-folder")


def _empty(folder: Path) -> Path:
    (folder / "empty").touch()
    return Path("empty")


def _noise(folder: Path) -> Path:
    (folder / "noise").write_bytes(bytes(range(256)) * 40)
    return Path("noise")


def _deep(folder: Path) -> Path:
    (folder / "deep").write_text("[" * 100_000)
    return Path("deep")


def _below_a_file(folder: Path) -> Path:
    return _empty(folder) / "x"


def _too_long(_folder: Path) -> Path:
    return Path("x" * 300)


def _missing_folder(_folder: Path) -> Path:
    return Path("no-folder/new")


Wrong = Callable[[Path], Path]
WRONG_TO_READ: tuple[Wrong, ...] = (_missing, _a_folder, _empty, _noise, _deep, _below_a_file, _too_long)
WRONG_TO_WRITE: tuple[Wrong, ...] = (_a_folder, _below_a_file, _too_long, _missing_folder)
FINE = {  # where such a path is what the verb wants, or an empty one says nothing wrong
    ("_a_folder", "trials folder"),
    ("_a_folder", "recover file"),
    *(("_a_folder", name) for name in ("demo --out", "certs -o")),
    *(("_missing_folder", name) for name in ("demo --out", "certs -o")),
    *(("_empty", f"{verb} --parameters") for verb in ("map", "rebuild")),
    *(("_empty", f"{verb} --config") for verb in ("doctor", "accounts", "record", "onboard")),
    *((kind, "record --sheet") for kind in ("_empty", "_noise", "_deep")),  # whatever it is, it is attached
    ("_missing_folder", "ask --trial"),  # the folder of trials is made
}


@pytest.fixture
def folder(small_site: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    shutil.copy(Path(__file__).parent / "small_scene.json", small_site / "small.json")
    monkeypatch.chdir(small_site)
    return small_site


def refused(arguments: list[str], path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The last line of what is said to it."""
    try:
        status = main([part.replace("HERE", str(path)) for part in arguments])
    except SystemExit as ended:
        status = int(ended.code or 0)
    said = capsys.readouterr()
    assert status in (1, 2), (status, said.out[-500:], said.err[-500:])
    assert "Traceback" not in said.err + said.out
    return said.err.strip().splitlines()[-1] if said.err.strip() else said.out


def cases(names: dict[str, list[str]], wrongs: tuple[Wrong, ...]) -> list[tuple[str, Wrong]]:
    return [(name, wrong) for name in names for wrong in wrongs if (wrong.__name__, name) not in FINE]


@pytest.mark.parametrize(("name", "wrong"), cases(READ, WRONG_TO_READ))
def test_what_cannot_be_read_is_named_in_one_line(name: str, wrong: Wrong, folder, capsys) -> None:
    said = refused(READ[name], wrong(folder), capsys)
    assert said.startswith(("openbelief", "Try 'openbelief")) or name == "doctor --config"
    assert len(said) < 1000


@pytest.mark.parametrize(("name", "wrong"), cases(WRITE, WRONG_TO_WRITE))
def test_what_cannot_be_written_is_named_in_one_line(name: str, wrong: Wrong, folder, capsys) -> None:
    said = refused(WRITE[name], wrong(folder), capsys)
    assert said.startswith(("openbelief", "Try 'openbelief")) and len(said) < 1000


@pytest.mark.parametrize("kept", ["site.belief", "walk.mcap"])
@pytest.mark.parametrize("name", [*WRITE, *PICTURE])
def test_nothing_is_written_over_a_memory_or_a_recording(name: str, kept: str, folder: Path, capsys) -> None:
    here = Path("kept.png")  # of a kind that every option takes
    shutil.copy(kept, here)
    said = refused((WRITE | PICTURE)[name], here, capsys)
    assert here.read_bytes() == Path(kept).read_bytes() and "kept.png" in said and len(said) < 1000


@pytest.mark.parametrize(
    ("name", "here"),
    [
        ("query --picture", "full.png"),
        ("inspect --plan", "full.png"),
        ("inspect --plan", "full.svg"),
        ("inspect --html", "full.html"),
        ("inspect --out", "full.jpg"),
        ("why --html", "full.html"),
    ],
)
def test_a_disk_that_is_full_is_one_line_that_names_the_file(name: str, here: str, folder: Path, capsys) -> None:
    Path(here).symlink_to("/dev/full")
    said = refused((WRITE | PICTURE)[name], Path(here), capsys)
    assert said.endswith(f"{here} cannot be written: No space left on device.")


def test_an_answer_that_finds_no_room_on_the_disk_is_one_line(folder: Path, monkeypatch, capsys) -> None:
    with Path("/dev/full").open("w", buffering=1) as full:
        monkeypatch.setattr("sys.stdout", full)
        assert main(["inspect", "site.belief", "--json"]) == 1
        monkeypatch.undo()
        said = capsys.readouterr().err
        assert said == "openbelief inspect: what it was to write is not written: No space left on device.\n"


OVER = {  # what --force does not replace: a verb and its options, and what lies at -o
    "a recording": (WRITE["rebuild -o"], "walk.mcap", "a recording"),
    "the recording that is mapped": (WRITE["map -o"], "walk.mcap", "what this command reads"),
    "who looks at the frames": (WRITE["map -o"], "small.json", "what this command reads"),
    "the rooms": ([*WRITE["rebuild -o"], "--rooms", "walk.truth.json"], "walk.truth.json", "what this command reads"),
    "its parameters": ([*WRITE["rebuild -o"], "--parameters", "p.toml"], "p.toml", "what this command reads"),
    "a database of others": (WRITE["rebuild -o"], "other.db3", "another database"),
    "a pipe": (WRITE["map -o"], "pipe", "a pipe or a device"),
    "a device": (WRITE["rebuild -o"], "device", "a pipe or a device"),
}


@pytest.mark.parametrize("name", OVER)
def test_force_replaces_nothing_that_cannot_be_made_again(name: str, folder: Path, capsys) -> None:
    arguments, kept, what = OVER[name]
    Path("p.toml").touch()
    Path("other.db3").write_bytes(b"SQLite format 3\0" + bytes(84))
    os.mkfifo("pipe")
    Path("device").symlink_to("/dev/null")
    before = {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert f"{kept} is " in (said := refused([*arguments, "--force"], Path(kept), capsys)) and what in said
    assert before == {path: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    assert Path("pipe").is_fifo() and Path("device").is_char_device()


def test_force_replaces_a_memory_whatever_became_of_it(folder: Path) -> None:
    for old in (Path("site.belief").read_bytes()[:5000], b""):
        Path("old.belief").write_bytes(old)
        assert main(["rebuild", "site.belief", "-o", "old.belief", "--force"]) == 0
        assert len(Path("old.belief").read_bytes()) > 5000


OCCUPIED = {
    "run --console": ["run", "--config", "robot.toml", "--console", "PORT"],
    "run [remote]": ["run", "--config", "remote.toml"],
    "demo --console": ["demo", "--scene", "small.json", "--out", "new", "--console", "PORT"],
}


@pytest.mark.parametrize("name", OCCUPIED)
def test_a_port_that_another_program_has_is_named_in_one_line(name: str, folder: Path, capsys) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        text = (folder / "robot.toml").read_text()
        here = f'[remote]\nserve = "here"\nendpoint = "tcp/127.0.0.1:{port}"\n'
        (folder / "remote.toml").write_text(text.split("[remote]")[0] + here)
        assert main([part.replace("PORT", port) for part in OCCUPIED[name]]) == 1
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].startswith(f"openbelief {name.split()[0]}: ") and f":{port}" in said[-1] and "port" in said[-1]
    assert not (folder / "new").exists(), "said before long work"
