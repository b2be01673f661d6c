"""A person at a terminal: what counts as a yes, and that STOP always counts."""

from __future__ import annotations

import os
import pty
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from types import SimpleNamespace

import pytest

from drivers.ports import Approval, Option, Question
from robot_app.mission.lease import Refused
from robot_app.mission.operator import SharedOperator
from robot_app.mission.terminal import Terminal

LONG_S = 30.0  # longer than any of these tests takes
MAY_I = Question(
    "May I?",
    memory_hash="abc",
    object_id=4,
    because="Seen 9 times.",
    options=(Option(1, 4, "lamp", 0.7), Option(2, 9, "torch", 0.6)),
)


@pytest.fixture
def operator(keyboard, screen) -> Iterator[SharedOperator]:
    made = SharedOperator()
    with Terminal(made, who="Ada", source=keyboard, screen=screen) as client:
        screen.settled = client.screen.settled
        yield made


@pytest.mark.parametrize(
    ("typed", "reply"),
    [
        ("yes", ("yes", None)),
        ("Y", ("yes", None)),
        ("no", ("no", None)),
        ("N", ("no", None)),
        ("stop", ("stop", None)),
        ("HALT!", ("stop", None)),
        ("Not  this one.", ("not this one", 4)),
        ("not 2", ("not this one", 9)),
        ("take 2", ("take", 9)),
    ],
)
def test_an_answer_after_the_question_counts(operator, keyboard, screen, typed, reply):
    screen.reactions["May I?"] = lambda: keyboard.type(typed)
    given = operator.confirm(MAY_I, LONG_S)
    assert (given.word, given.object_id) == reply
    assert (given.who, given.how) == ("Ada", "terminal")


def test_an_answer_typed_before_the_question_does_not_count(operator, keyboard, screen):
    keyboard.type("yes", "y")
    keyboard.wait_until_read()
    screen.reactions["May I?"] = lambda: keyboard.type("no")
    assert operator.confirm(MAY_I, LONG_S).word is Approval.NO


def test_silence_is_no_yes(operator, screen):
    assert operator.confirm(MAY_I, 0.02).word is Approval.EXPIRED
    assert screen.lines[-1] == "Nobody answered in time."


def test_what_is_neither_yes_nor_no_is_asked_again(operator, keyboard, screen):
    screen.reactions["May I?"] = lambda: keyboard.type("perhaps", "take 7", "yes")
    assert operator.confirm(MAY_I, LONG_S).word is Approval.YES
    assert any("'perhaps' is neither yes nor no" in line for line in screen.lines)
    assert any("no candidate number 7" in line for line in screen.lines)


def test_why_shows_the_evidence_and_the_other_candidates_and_the_question_stays_open(operator, keyboard, screen):
    screen.reactions["May I?"] = lambda: keyboard.type("why", "yes")
    assert operator.confirm(MAY_I, LONG_S).word is Approval.YES
    assert screen.lines[1:4] == ["Seen 9 times.", "  1. lamp  0.70", "  2. torch  0.60"]


@pytest.mark.parametrize("when", ["before the question", "while it is asked"])
def test_where_the_input_has_ended_nobody_is_waited_for_and_the_prompt_ends_too(operator, keyboard, screen, when):
    if when == "before the question":
        keyboard.end()
        while "terminal" in operator.present:
            pass
    else:
        screen.reactions["May I?"] = keyboard.end
    assert operator.confirm(MAY_I, LONG_S).word is Approval.EXPIRED
    assert screen.lines[-1] == "Nobody can answer: the input has ended."
    assert operator.next_sentence() is None


def test_a_stop_is_heard_at_any_time_and_keeps_its_first_reason(operator, keyboard):
    assert operator.stop_requested() is None
    keyboard.type("Stop!")
    keyboard.wait_until_read()
    operator.stop(because="the operator pressed Ctrl-C")
    assert operator.stop_requested().because == "the operator said stop"
    assert operator.confirm(MAY_I, LONG_S).word is Approval.STOP


@pytest.mark.parametrize(
    "line", ["stop it", "Stop now!", "freeze", "emergency stop", "stop the robot", "cancel", "abort"]
)
def test_a_stop_in_any_words_stops_while_idle_too_and_is_no_sentence(operator, keyboard, line):
    keyboard.type(line)
    keyboard.wait_until_read()
    assert operator.stop_requested() is not None and operator.waiting == ()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("help", "Say what to find"),
        ("go home", "not supported"),
        ("come back", "not supported"),
        ("again", "once more"),
    ],
)
def test_a_command_that_is_no_stop_is_answered_and_starts_no_drive(operator, keyboard, screen, line, said):
    keyboard.type(line)
    keyboard.wait_until_read()
    assert said in screen.lines[-1] and operator.waiting == () and operator.stop_requested() is None


def test_a_stop_that_a_page_or_a_program_asks_for_as_a_sentence_is_a_stop(operator):
    with pytest.raises(Refused, match="told to stop"):
        operator.ask(None, "stop the robot")
    assert operator.stop_requested() is not None and operator.waiting == ()


def test_a_stop_drops_what_was_typed_ahead_and_says_so(operator, keyboard, screen):
    keyboard.type("find the bucket", "stop", "find the lamp")
    keyboard.wait_until_read()
    assert "Not asked any more: 'find the bucket'" in screen.lines[0]
    sentence = operator.next_sentence()
    assert sentence.text == "find the lamp"
    operator.begin(sentence)
    assert operator.stop_requested() is None


def test_an_empty_line_ends_after_what_was_asked_before_it(operator, keyboard):
    keyboard.type("find the bucket", "")
    keyboard.wait_until_read()
    assert operator.next_sentence().text == "find the bucket"
    assert operator.next_sentence() is None


def test_a_late_yes_is_no_new_mission(operator, keyboard, screen):
    keyboard.type("yes", "find the bucket")
    assert operator.next_sentence().text == "find the bucket"
    assert "Nothing is being asked now" in screen.lines[0]


def test_who_lost_the_command_is_told_and_gets_it_back_by_taking_over(operator, keyboard, screen):
    operator.take("Bob", "console", over=True)
    keyboard.type("find the bucket", "take over", "find the lamp")
    keyboard.wait_until_read()
    assert screen.lines[:2] == [
        "Bob (console) commands the robot now. It was Ada (terminal).",
        "Bob (console) commands the robot now: take over first. (here: type 'take over')",
    ]
    assert [sentence.text for sentence in operator.waiting] == ["find the lamp"]


def test_control_characters_are_made_visible_and_long_sentences_stay_whole(operator, screen):
    operator.tell("Looking at the \x1b[2Jlamp\nCONFIRMED \u202e" + "x" * 200 + " use the remote")
    [line] = screen.lines
    assert "\\x1b[2Jlamp\\x0aCONFIRMED \\u202e" in line and line.endswith("use the remote")


def test_an_input_that_cannot_be_read_ends_like_one_that_ended_and_is_named(screen):
    class Broken:
        def isatty(self):
            return False

        def __iter__(self):
            raise OSError("the terminal is gone")

    operator = SharedOperator()
    with Terminal(operator, source=Broken(), screen=screen):
        assert operator.next_sentence() is None
    assert any("the terminal is gone" in line for line in screen.lines)


# A way to say stop that goes away


@pytest.fixture
def tty() -> Iterator[Callable[..., SimpleNamespace]]:
    """A terminal with an operator at it: `hang_up()` closes the other end, as a dying ssh does, and sends no SIGHUP."""
    opened, clients = [], ExitStack()

    def make(**more) -> SimpleNamespace:
        master, slave = pty.openpty()
        source, screen = os.fdopen(slave, "r"), os.fdopen(os.dup(slave), "w")
        opened.extend((source, screen))
        operator = SharedOperator()
        client = clients.enter_context(Terminal(operator, who="Ada", source=source, screen=screen, **more))
        return SimpleNamespace(operator=operator, client=client, hang_up=lambda: os.close(master), screen=screen)

    with clients:
        yield make
    for stream in opened:
        try:
            stream.close()
        except OSError:
            pass  # what was still to be shown there


def test_a_terminal_that_goes_away_under_way_is_a_stop(tty, eventually):
    at = tty(under_way=lambda: True)
    at.hang_up()
    eventually(lambda: at.operator.stop_requested())
    assert at.operator.stop_requested().because == "the operator's terminal went away"
    eventually(lambda: not at.operator.present)


def test_a_terminal_that_goes_away_between_missions_ends_the_program_and_stops_nothing(tty):
    at = tty()
    at.hang_up()
    assert at.operator.next_sentence() is None
    assert at.operator.stop_requested() is None


def test_a_mission_under_way_at_the_prompt_is_stopped_too(tty, eventually):
    at = tty()
    lease = at.operator.lease
    at.operator.ask(lease, "find the lamp")
    at.operator.begin(at.operator.next_sentence())
    at.hang_up()
    eventually(lambda: at.operator.stop_requested())


def test_what_cannot_be_shown_any_more_raises_nothing_and_is_a_stop_as_well(tty, eventually):
    at = tty(under_way=lambda: True)
    at.hang_up()
    at.client.tell("The robot was stopped.")
    at.client.tell("Once more.")
    eventually(lambda: at.operator.stop_requested())


def test_a_screen_that_takes_nothing_holds_up_neither_the_mission_nor_a_stop(tty, eventually):
    """Its output is paused (Ctrl-S) or its ssh is frozen: nobody reads the other end, and it is full."""
    at = tty(under_way=lambda: True)
    told = threading.Thread(target=lambda: [at.operator.tell(f"{k} " + "x" * 1000) for k in range(400)], daemon=True)
    told.start()
    eventually(lambda: not told.is_alive())
    assert not at.client.screen.settled(0.0), "it is full"
    at.operator.stop(because="ada pressed STOP", how="console")
    assert at.operator.stop_requested().because == "ada pressed STOP"
    at.hang_up()
    eventually(lambda: at.client.screen.settled(0.0))


def test_an_input_that_never_was_a_terminal_stops_nothing_by_ending(keyboard, screen, eventually):
    made = SharedOperator()
    with Terminal(made, source=keyboard, screen=screen, under_way=lambda: True) as client:
        screen.settled = client.screen.settled
        keyboard.end()
        eventually(lambda: not made.present)
        assert made.stop_requested() is None
    assert [line for line in screen.lines if "STOP only by signal" in line] == screen.lines


def test_ctrl_c_ends_a_program_that_waits_for_a_sentence_and_stops_one_that_does_not(operator, keyboard, eventually):
    operator.interrupt(because="the operator pressed Ctrl-C")
    assert operator.stop_requested().because == "the operator pressed Ctrl-C"
    waiting = SharedOperator()
    waiting.join("terminal")
    ended = []
    thread = threading.Thread(target=lambda: ended.append(waiting.next_sentence()))
    thread.start()
    eventually(lambda: waiting._idle)
    waiting.interrupt(because="the operator pressed Ctrl-C")
    thread.join()
    assert ended == [None] and waiting.stop_requested() is None
