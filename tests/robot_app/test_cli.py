"""Manners of every verb: quick help, an example that works as pasted, --json, one line for what is wrong."""

from __future__ import annotations

import importlib
import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from robot_app.cli import VERBS, build_parser, main

SMALL = Path(__file__).parent / "small_scene.json"
# What takes long to import, and has no place in a help text (open3d alone takes 3 s).
HEAVY = (
    "open3d",
    "zenoh",
    "scipy",
    "cv2",
    "matplotlib",
    "openai",
    "onnxruntime",
    "torch",
    "pyrealsense2",
    "rosbags",
    "mcap",
    "numpy",
)
# Asks for every help in turn, and says which of them imported what is heavy.
HELPS = """
import contextlib, io, json, sys
from robot_app.cli import main
heavy, asked = map(json.loads, sys.argv[1:])
guilty = {}
for arguments in asked:
    before = {name for name in heavy if name in sys.modules}
    with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):
        main(arguments)
    guilty[" ".join(arguments)] = sorted({name for name in heavy if name in sys.modules} - before)
print(json.dumps(guilty))
"""

# The least that each verb needs on its line; with files that are not there, every one must say so in one line.
MISSING = {
    "record": ["-o", "out.mcap", "--config", "no-robot.toml"],
    "map": ["no-walk.mcap", "-o", "out.belief", "--perception", "recorded:no.jsonl"],
    "query": ["no.belief", "red chair"],
    "why": ["no.belief", "0"],
    "rebuild": ["no.belief", "-o", "new.belief"],
    "run": ["--config", "no-robot.toml"],
    "ask": ["the red chair", "--config", "no-robot.toml"],
    "onboard": ["--config", "no-robot.toml"],
    "replay": ["no-trial.mcap"],
    "trials": ["no-folder"],
    "recover": ["no-walk.mcap"],
    "eval": ["retrieval", "no.belief", "no.truth.json"],
    "demo": ["--scene", "no-scene.json", "--out", "out"],
}


# Ctrl-C while a module is imported, as open3d's extension passes it on, and as a class body does.
STOPPED = """
import sys
from robot_app.cli import main

module, kind, *arguments = sys.argv[1:]

class Stopped:
    def find_spec(self, name, path=None, target=None):
        if name == module:
            raise {"ImportError": ImportError, "RuntimeError": RuntimeError}[kind]("failed") from KeyboardInterrupt()

sys.meta_path.insert(0, Stopped())
sys.exit(main(arguments))
"""


def example(verb: str) -> list[str]:
    """The verb's example as a shell would split it, without the command's name."""
    name, *arguments = shlex.split(importlib.import_module(f"robot_app.verbs.{verb}").EXAMPLE)
    assert name == "openbelief"
    return arguments


def test_no_help_imports_what_takes_long():
    asked = [["--help"], ["--version"], *([verb, "--help"] for verb in VERBS)]
    done = subprocess.run(
        [sys.executable, "-c", HELPS, json.dumps(HEAVY), json.dumps(asked)],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {" ".join(arguments): [] for arguments in asked}


@pytest.mark.parametrize("verb", VERBS)
def test_help_says_what_the_verb_does_and_carries_its_example(verb, capsys):
    with pytest.raises(SystemExit) as ended:
        main([verb, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    assert "--json" in shown and f"example:\n  openbelief {verb}" in shown
    assert shown.splitlines()[0].startswith(f"usage: openbelief {verb}")


@pytest.mark.parametrize("verb", VERBS)
def test_every_example_is_of_its_verb_and_parses(verb):
    named, *arguments = example(verb)
    assert named == verb
    assert build_parser(verb).parse_args([*arguments, "--json"]).json is True


@pytest.mark.parametrize("verb", MISSING)
def test_a_file_that_is_missing_is_named_in_one_line_and_exits_1(verb, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([verb, *MISSING[verb], "--json"]) == 1
    printed = capsys.readouterr()
    [line] = printed.err.strip().splitlines()
    assert line.startswith(f"openbelief {verb}: ") and "no" in line and "Traceback" not in line
    assert printed.out == ""


@pytest.mark.parametrize("arguments", [["no-such-verb"], ["query"], ["trials", "a", "--no-such-option"], ["eval", "x"]])
def test_wrong_usage_exits_2_and_says_where_help_is(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    said, remedy = capsys.readouterr().err.strip().splitlines()
    assert said.startswith("openbelief: ") and remedy.startswith("Try 'openbelief") and "--help'" in remedy


@pytest.mark.parametrize("verb", ["query", "ask"])
def test_a_sentence_without_its_quotes_gets_the_hint(verb, capsys):
    memory = ["site.belief"] if verb == "query" else []
    with pytest.raises(SystemExit):
        main([verb, *memory, "take", "me", "to", "the", "chair"])
    assert "goes in quotes" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main([verb, *memory, "chair", "--no-such-option"])
    assert "goes in quotes" not in capsys.readouterr().err


def test_a_loose_word_where_no_sentence_belongs_gets_no_hint_on_sentences(capsys):
    with pytest.raises(SystemExit):
        main(["models", "check", "models"])
    assert "goes in quotes" not in capsys.readouterr().err


@pytest.mark.parametrize("verb", VERBS)
def test_help_fits_a_terminal_of_80_columns(verb, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    shown = capsys.readouterr().out
    body = shown.split("example:")[0].splitlines()
    assert [line for line in body if len(line) > 80] == []


@pytest.mark.parametrize(
    ("module", "kind"), [("open3d", "ImportError"), ("mcap", "RuntimeError"), ("open3d", "RuntimeError")]
)
def test_ctrl_c_during_an_import_ends_in_one_line_and_130_as_at_any_other_time(module, kind, tmp_path):
    demo = ["demo", "--scene", str(SMALL), "--out", str(tmp_path / "demo-out")]
    command = [sys.executable, "-c", STOPPED, module, kind, *demo]
    done = subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
    assert (done.returncode, done.stderr) == (130, "openbelief demo: stopped by the user\n")


def test_a_defect_is_not_mistaken_for_a_failure():
    done = subprocess.run(
        [sys.executable, "-c", STOPPED.replace(" from KeyboardInterrupt()", ""), "mcap", "RuntimeError", "demo"],
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 1 and "Traceback" in done.stderr and "RuntimeError: failed" in done.stderr


def test_without_a_verb_the_verbs_are_shown(capsys):
    assert main([]) == 0
    shown = capsys.readouterr().out
    assert all(f"  {verb}" in shown for verb in VERBS)


@pytest.mark.parametrize("verb", ["query", "why", "rebuild", "eval", "replay", "trials", "recover", "ask"])
def test_an_example_over_a_demos_folder_works_as_pasted(verb, small_site, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "demo-out").symlink_to(small_site)
    assert main([*example(verb), "--json"]) == 0, capsys.readouterr().err
    assert isinstance(json.loads(capsys.readouterr().out), dict)


@pytest.mark.parametrize(("given", "used"), [(None, "1"), ("3", "3")])
def test_one_thread_multiplies_matrices_unless_the_environment_says_otherwise(given: str | None, used: str) -> None:
    """Waiting threads of the BLAS library took 30 % of a mapping's CPU time."""
    script = (
        "import os, sys; from robot_app.cli import main; assert 'numpy' not in sys.modules; main(['--version']); "
        "import numpy; a = numpy.ones((900, 900)); a @ a; print(os.environ['OPENBLAS_NUM_THREADS'], "
        "len(os.listdir('/proc/self/task')))"
    )
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    environment |= {"OPENBLAS_NUM_THREADS": given} if given else {}
    command = [sys.executable, "-c", script]
    said = subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.split()
    assert said[-2] == used and (given or said[-1] == "1")


FORGED = "x\n\x1b[2KCONFIRMED: the robot is there\u202e"


@pytest.mark.parametrize("where", ["a file's name", "a key of robot.toml", "a wrong option"])
def test_an_error_that_quotes_somebody_elses_text_forges_no_line_and_moves_no_cursor(where, tmp_path, capsys):
    config = tmp_path / "robot.toml"
    config.write_text('"x\\n\\u001b[2KCONFIRMED: the robot is there\\u202e" = 1\n')
    arguments = {
        "a file's name": ["query", str(tmp_path / FORGED), "lamp"],
        "a key of robot.toml": ["ask", "lamp", "--config", str(config)],
        "a wrong option": ["query", "site.belief", "lamp", f"--{FORGED}"],
    }[where]
    try:
        status = main(arguments)
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr().err
    assert status in (1, 2) and "CONFIRMED" in said
    assert not any(line.startswith("CONFIRMED") for line in said.splitlines())
    assert "\x1b" not in said and "\u202e" not in said
