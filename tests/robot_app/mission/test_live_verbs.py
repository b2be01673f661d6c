"""`ask` and `run` with a person at the terminal, over the simulated small room."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from logs.trial import records
from logs.trial.reader import TrialReader
from robot_app.mission.replay import replay_trial
from robot_app.signals import BECAUSE

ARMCHAIR = "go to the armchair"
QUESTION = "May I walk"


def ask(terminal, capsys, config: Path, *arguments: str) -> tuple[int, dict]:
    status = terminal(["ask", ARMCHAIR, "--config", str(config), "--json", *arguments])
    return status, json.loads(capsys.readouterr().out)


def test_a_yes_drives_and_what_was_asked_for_is_confirmed(terminal, config, keyboard, screen, capsys):
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    status, report = ask(terminal, capsys, config)
    assert (status, report["outcome"], report["visits"]) == (0, "CONFIRMED", 1), report["reason"]
    assert report["trial_failure"] is None and TrialReader(Path(report["trial"])).outcome.end == "CONFIRMED"
    assert any(line.startswith("CONFIRMED: ") for line in screen.lines)


@pytest.mark.parametrize(("answer", "reason"), [("no", "said no"), ("stop", "said stop"), (None, "nobody answered")])
def test_without_a_yes_the_robot_stays_and_the_exit_status_is_1(
    terminal, config, keyboard, screen, capsys, answer, reason
):
    screen.reactions[QUESTION] = lambda: keyboard.type(answer) if answer else keyboard.end()
    status, report = ask(terminal, capsys, config, "--trial", str(config.parent / "refused.mcap"))
    assert (status, report["outcome"]) == (1, "CANCELLED") and reason in report["reason"]
    trial = TrialReader(config.parent / "refused.mcap")
    assert not any(isinstance(record, records.GoalAnswer) for record in trial.records)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_that_would_end_the_program_stops_the_robot_and_the_trial_is_whole(
    terminal, config, screen, capsys, number
):
    screen.reactions[QUESTION] = lambda: signal.raise_signal(number)
    before = signal.getsignal(number)
    status, report = ask(terminal, capsys, config)
    assert (status, report["outcome"], report["reason"]) == (1, "CANCELLED", BECAUSE[number])
    assert TrialReader(Path(report["trial"])).outcome.reason == BECAUSE[number]
    assert signal.getsignal(number) == before


def test_stop_typed_during_the_drive_cancels_the_goal(terminal, config, keyboard, screen, capsys, monkeypatch):
    import robot_app.wiring as wiring

    built = wiring.simulation

    def watched(*arguments, **options):
        """Types stop as soon as the robot moves."""
        simulation = built(*arguments, **options)
        typed = threading.Event()

        def look() -> None:
            if simulation.robot.moving and not typed.is_set():
                typed.set()
                keyboard.type("stop")
                keyboard.wait_until_read()

        simulation.clock.every(0.1, look)
        return simulation

    monkeypatch.setattr(wiring, "simulation", watched)
    screen.reactions[QUESTION] = lambda: keyboard.type("yes")
    status, report = ask(terminal, capsys, config)
    assert (status, report["outcome"], report["reason"]) == (1, "CANCELLED", "the operator said stop")
    kinds = [type(record) for record in TrialReader(Path(report["trial"])).records]
    assert kinds.index(records.GoalAnswer) < kinds.index(records.Stop) < kinds.index(records.HaltAnswer)
    assert records.NavigationEnd not in kinds


def test_run_takes_one_sentence_after_the_other_until_an_empty_line(terminal, config, keyboard, screen, capsys):
    screen.reactions["Ready over"] = lambda: keyboard.type("   . ", "???", ARMCHAIR)
    screen.reactions[QUESTION] = lambda: keyboard.type("no")
    screen.reactions["CANCELLED: "] = lambda: screen.reactions.update({"trial: ": lambda: keyboard.type("")})
    assert terminal(["run", "--config", str(config), "--json"]) == 0
    [line] = capsys.readouterr().out.splitlines()
    assert json.loads(line)["outcome"] == "CANCELLED" and json.loads(line)["query"] == ARMCHAIR


def test_run_ends_where_the_input_ends_even_in_the_middle_of_a_question(terminal, config, keyboard, screen, capsys):
    screen.reactions["Ready over"] = lambda: keyboard.type(ARMCHAIR)
    screen.reactions[QUESTION] = keyboard.end
    assert terminal(["run", "--config", str(config)]) == 0
    assert "CANCELLED: nobody answered in time" in screen.lines


def test_a_sentence_that_names_nothing_is_refused_in_one_line(terminal, config, screen):
    assert terminal(["ask", "  ", "--config", str(config)]) == 1
    assert "names nothing" in screen.lines[-1]


# What is imported newly by the first question and its goal pose, after a mission's program said that it is ready.
FIRST_QUESTION = """
import sys
from pathlib import Path
import numpy as np
import behaviors.mission
from openbelief.g1 import COLOR_INTRINSICS, T_BASE_CAMERA
from openbelief.goal_pose import goal_poses
from openbelief.parameters import Parameters
from openbelief.perception.sentence import SentenceEncoder
from openbelief.pose import Pose2
from openbelief.traversability import OCCUPIED, OccupancyGrid
from robot_app.mission.missions import _ready_memory

memory = _ready_memory(Path(sys.argv[1]), SentenceEncoder(), "grounded")
before = set(sys.modules)
memory.rank("take me to the armchair next to the bucket", "grounded")
cells = np.zeros((200, 200), np.int8)
cells[100:104, 100:104] = OCCUPIED
points = np.array([[5.1, 5.1, 0.02 * k] for k in range(20)])
grid = OccupancyGrid(cells, 0.05, (0.0, 0.0))
assert goal_poses(points, grid, Pose2(1.0, 1.0, 0.0), T_BASE_CAMERA, COLOR_INTRINSICS, Parameters()).poses
print(*sorted(set(sys.modules) - before))
"""


def test_a_first_question_and_its_goal_pose_import_nothing_while_pictures_and_an_operator_wait(config):
    memory = config.parent / "site.belief"
    done = subprocess.run([sys.executable, "-c", FIRST_QUESTION, memory], capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_a_trial_attaches_the_memory_that_was_opened_not_what_lies_at_its_path_now(
    terminal, config, keyboard, screen, capsys
):
    """Another file took its place between the start of the program and the mission."""

    def replaced() -> None:
        other = config.parent / "other.belief"
        other.write_bytes(b"another memory")
        other.replace(config.parent / "site.belief")
        keyboard.type(ARMCHAIR)

    screen.reactions["Ready over"] = replaced
    screen.reactions[QUESTION] = lambda: keyboard.type("no")
    screen.reactions["CANCELLED: "] = lambda: screen.reactions.update({"trial: ": lambda: keyboard.type("")})
    assert terminal(["run", "--config", str(config), "--json"]) == 0
    [line] = capsys.readouterr().out.splitlines()
    assert replay_trial(Path(json.loads(line)["trial"])).difference is None
