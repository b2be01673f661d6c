"""A mission from ask to confirmed over Zenoh, with its trial; and the same from the command line."""

from __future__ import annotations

import json
import shlex
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

from drivers.ros.zenoh_link import ZenohLink
from logs.trial.reader import TrialReader
from robot_app.config import load_config
from robot_app.remote.asking import RemoteAsking
from robot_app.remote.client import RemoteClient, RemoteOperator
from robot_app.remote.service import link_config

ARMCHAIR = "go to the armchair"
PAGE = Path(__file__).parents[3] / "docs" / "api.md"
SERVING = "Commands over Zenoh are taken"


def beside(screen, keyboard, act: Callable[[], object]) -> list[object]:
    """What `act` returns or raises, on a thread of its own once commands are taken; then the run is told to end."""
    got: list[object] = []

    def run() -> None:
        try:
            got.append(act())
        except Exception as error:  # noqa: BLE001 - the test looks at it
            got.append(error)
        finally:
            keyboard.type("take over")
            for _ in range(120):  # an empty line ends the run, but not while a question is open
                keyboard.type("")
                threading.Event().wait(0.5)

    screen.reactions[SERVING] = lambda: threading.Thread(target=run, daemon=True).start()
    return got


def test_a_client_takes_over_asks_says_yes_and_the_trial_names_it(terminal, remote_toml, keyboard, screen, capsys):
    config = remote_toml

    def act() -> dict:
        with (
            ZenohLink(link_config(load_config(config))) as link,
            RemoteOperator(link, "ada", over=True) as operator,
        ):
            return RemoteAsking(operator, "ada", approve=True, source=[], screen=screen).run(ARMCHAIR)

    got = beside(screen, keyboard, act)
    assert terminal(["run", "--config", str(config), "--json"]) == 0
    [outcome] = got
    assert outcome["end"] == "CONFIRMED", outcome
    [line] = capsys.readouterr().out.splitlines()
    trial = TrialReader(Path(json.loads(line)["trial"]))
    assert (trial.query.who, trial.query.how, trial.query.sentence) == ("ada", "zenoh", ARMCHAIR)
    replies = [record for record in trial.records if record.topic == "/trial/operator_reply"]
    assert [(reply.reply, reply.who, reply.how) for reply in replies] == [("yes", "ada", "zenoh")]


def command_of_the_page(verb: str, config: Path) -> list[str]:
    """The line of docs/api.md that runs that verb, for this Python and that robot.toml."""
    [line] = [each for each in PAGE.read_text().splitlines() if each.startswith(f"    .venv/bin/openbelief {verb} ")]
    words = shlex.split(line, comments=True)
    return [
        sys.executable,
        "-m",
        "robot_app.cli",
        *(str(config) if w == "demo-out/robot.toml" else w for w in words[1:]),
    ]


def test_the_command_of_the_page_asks_and_takes_the_yes_that_is_typed_in_its_process(
    terminal, remote_toml, keyboard, screen
):
    config, pipe = remote_toml, subprocess.PIPE

    def act() -> tuple[int, str, str]:
        with subprocess.Popen(
            command_of_the_page("ask", config), stdin=pipe, stdout=pipe, stderr=pipe, text=True
        ) as asking:
            said = []
            for line in asking.stderr:
                said.append(line)
                if "[yes/no" in line:
                    asking.stdin.write("yes\n")
                    asking.stdin.flush()
            return asking.wait(), asking.stdout.read(), "".join(said)

    got = beside(screen, keyboard, act)
    assert terminal(["run", "--config", str(config)]) == 0
    [(status, printed, said)] = got
    assert status == 0, said
    assert printed.startswith("CONFIRMED: ") and "May I walk to the armchair" in said


def test_a_stop_over_zenoh_ends_the_mission_with_who_said_it(terminal, remote_toml, keyboard, screen):
    config = remote_toml

    def act() -> dict:
        with ZenohLink(link_config(load_config(config))) as link:
            client = RemoteClient(link)
            with RemoteOperator(link, "ada", over=True) as operator:
                order = operator.ask(ARMCHAIR)
                while client.status()["question"] is None:
                    threading.Event().wait(0.05)
                client.stop("bob")
                while (status := client.status())["outcome"] is None:
                    threading.Event().wait(0.05)
                return {"order": order, **status["outcome"]}

    got = beside(screen, keyboard, act)
    assert terminal(["run", "--config", str(config)]) == 0
    [outcome] = got
    assert (outcome["end"], outcome["reason"]) == ("CANCELLED", "bob said stop over the network"), outcome


def test_the_example_of_the_page_runs_as_it_stands_there(terminal, remote_toml, keyboard, screen):
    config = remote_toml
    example = PAGE.read_text().split("```python\n")[1].split("```")[0]
    endpoint = load_config(config).remote.endpoint

    def act() -> subprocess.CompletedProcess[str]:
        code = example.replace("tcp/127.0.0.1:7450", endpoint)
        return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)

    got = beside(screen, keyboard, act)
    assert terminal(["run", "--config", str(config)]) == 0
    [done] = got
    assert done.returncode == 0, done.stderr
    label, asked, stopped = done.stdout.splitlines()
    assert label == "armchair" and "'ok': True" in asked and stopped == "{'ok': True}"


def test_where_no_run_takes_commands_one_line_says_so(terminal, remote_toml, screen):
    config = remote_toml

    assert terminal(["ask", ARMCHAIR, "--remote", "--config", str(config)]) == 1
    assert "Nothing answers at tcp/127.0.0.1" in screen.lines[-1]
