"""Ways to say stop, and ways to lose them, with real processes: a robot that drives, and the operator's own program."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from drivers.ros.zenoh_link import LinkConfig, ZenohLink
from drivers.watchdog.heartbeat import WatchdogView
from drivers.watchdog.latch import WatchdogState
from robot_app.benches.programs import THING, Program, until, write_configuration

ALONE = '[safety]\nwatchdog = "off"\n'


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


@pytest.fixture
def robot(opened) -> Program:
    made = Program(opened, "sim_fakes.wire.nav2_process", "--whole")
    made.endpoint = made.expect("endpoint")["endpoint"]
    return made


@pytest.fixture
def ask(opened, robot, tmp_path) -> Callable[..., Program]:
    """`openbelief ask --yes`, once the robot drives."""

    def make(**streams: bool) -> Program:
        config = write_configuration(tmp_path, robot.endpoint, ALONE)
        made = Program(opened, "robot_app.cli", "ask", THING, "--yes", "--config", str(config), "--json", **streams)
        until("a robot that moves", lambda: moves(robot) or made.ended, timeout_s=60.0)
        assert not made.ended, made.last
        return made

    return make


def moves(robot: Program) -> bool:
    robot.type("where")
    return robot.expect("moving")["moving"]


def test_a_terminal_that_is_closed_without_a_signal_stops_the_robot(robot, ask):
    program = ask(terminal=True)
    gone_ns = program.hang_up()
    assert robot.expect("cancel_ns")["cancel_ns"] > gone_ns
    assert program.expect("outcome")["reason"] == "the operator's terminal went away"
    assert not moves(robot)


def test_a_stop_in_other_words_under_way_stops_the_robot(robot, ask):
    program = ask(terminal=True)
    said_ns = time.monotonic_ns()
    program.type("freeze!")
    cancelled_ns = robot.expect("cancel_ns")["cancel_ns"]
    print(f"the cancel is at Nav2 {(cancelled_ns - said_ns) / 1e9:.3f} s after the word")
    assert program.expect("outcome")["outcome"] == "CANCELLED"
    assert not moves(robot)


def test_a_stop_after_a_success_that_was_none_cancels_every_goal(robot, ask):
    """Nav2 says that it arrived, by status and by result, and the robot drives on."""
    program = ask(terminal=True)
    robot.forget()
    robot.type("claim succeeded")
    robot.expect("claimed_ns")
    program.type("stop")
    assert robot.expect("cancel_ns")["all"]
    outcome = program.expect("outcome")
    assert (outcome["outcome"], outcome["reason"]) == ("CANCELLED", "the operator said stop")
    assert not moves(robot)


def test_an_input_that_never_was_a_terminal_stops_nothing_by_ending_and_a_signal_does(robot, ask):
    program = ask(dark=True)
    assert program.said("STOP only by signal")
    time.sleep(0.5)
    assert moves(robot)
    program.signal(signal.SIGTERM)
    assert program.expect("outcome")["outcome"] == "CANCELLED"
    assert not moves(robot)


def test_leaving_run_at_its_idle_prompt_latches_nothing(opened, robot, tmp_path):
    config = str(write_configuration(tmp_path, robot.endpoint))
    Program(opened, "robot_app.cli", "onboard", "--config", config)
    view = WatchdogView(opened.enter_context(ZenohLink(LinkConfig((robot.endpoint,)))))
    view.start()
    until("a watchdog", lambda: view.status is not None)
    idle = {
        number: Program(opened, "robot_app.cli", "run", "--config", config, terminal=True)
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    }
    hung = Program(opened, "robot_app.cli", "run", "--config", config, terminal=True)
    for program in (*idle.values(), hung):
        program.said("Ready over", timeout_s=60.0)
    assert view.status.state is WatchdogState.ARMED
    for number, program in idle.items():
        program.signal(number)
        assert program.wait() == 0
    hung.hang_up()
    assert hung.wait() == 0
    until("nobody watched", lambda: view.status.state is not WatchdogState.ARMED)
    assert view.status.state is WatchdogState.WAITING, view.status.reason
