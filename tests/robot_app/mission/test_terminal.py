"""A person at a terminal: what counts as a yes, and that STOP always counts."""

from __future__ import annotations

import pytest

from robot_app.mission.terminal import TerminalOperator

LONG_S = 30.0  # longer than any of these tests takes


@pytest.fixture
def operator(keyboard, screen):
    with TerminalOperator(source=keyboard, screen=screen) as made:
        yield made


@pytest.mark.parametrize(
    ("typed", "reply"), [("yes", "yes"), ("Y", "yes"), ("no", "no"), ("N", "no"), ("stop", "stop"), ("HALT!", "stop")]
)
def test_an_answer_after_the_question_counts(operator, keyboard, screen, typed, reply):
    screen.reactions["May I?"] = lambda: keyboard.type(typed)
    assert operator.confirm("May I?", LONG_S) == reply


def test_an_answer_typed_before_the_question_does_not_count(operator, keyboard, screen):
    keyboard.type("yes", "y")
    keyboard.wait_until_read()
    screen.reactions["May I?"] = lambda: keyboard.type("no")
    assert operator.confirm("May I?", LONG_S) == "no"


def test_silence_is_no_yes(operator):
    assert operator.confirm("May I?", 0.02) == "expired"


def test_what_is_neither_yes_nor_no_is_asked_again(operator, keyboard, screen):
    screen.reactions["May I?"] = lambda: keyboard.type("perhaps", "yes")
    assert operator.confirm("May I?", LONG_S) == "yes"
    assert any("'perhaps' is neither yes nor no" in line for line in screen.lines)


@pytest.mark.parametrize("when", ["before the question", "while it is asked"])
def test_where_the_input_has_ended_nobody_is_waited_for_and_the_prompt_ends_too(operator, keyboard, screen, when):
    if when == "before the question":
        keyboard.end()
        keyboard.wait_until_read()
    else:
        screen.reactions["May I?"] = keyboard.end
    assert operator.confirm("May I?", LONG_S) == "expired"
    assert screen.lines[-1] == "Nobody can answer: the input has ended."
    assert operator.next_line() is None


def test_a_stop_is_heard_at_any_time_and_keeps_its_first_reason(operator, keyboard):
    assert operator.stop_requested() is None
    keyboard.type("Stop!")
    keyboard.wait_until_read()
    operator.request_stop(because="the operator pressed Ctrl-C")
    assert operator.stop_requested() == "the operator said stop"
    assert operator.confirm("May I?", LONG_S) == "stop"


def test_a_stop_ends_with_the_next_sentence_and_not_before(operator, keyboard):
    keyboard.type("stop", "find the bucket")
    keyboard.wait_until_read()
    assert operator.stop_requested() == "the operator said stop"
    assert operator.next_line() == "find the bucket"
    operator.begin()
    assert operator.stop_requested() is None


def test_a_stop_typed_right_after_the_sentence_is_of_that_mission(operator, keyboard):
    keyboard.type("find the bucket", "stop")
    keyboard.wait_until_read()
    assert operator.next_line() == "find the bucket"
    operator.begin()
    assert operator.stop_requested() == "the operator said stop"


def test_ctrl_c_during_a_mission_counts_for_what_was_typed_ahead_and_not_for_what_comes_later(operator, keyboard):
    keyboard.type("find the bucket", "find the lamp")
    keyboard.wait_until_read()
    operator.next_line()
    operator.begin()
    operator.request_stop(because="the operator pressed Ctrl-C")
    assert operator.next_line() == "find the lamp"
    operator.begin()
    assert operator.stop_requested() == "the operator pressed Ctrl-C"
    keyboard.type("find the sofa")
    assert operator.next_line() == "find the sofa"
    operator.begin()
    assert operator.stop_requested() is None


def test_a_late_yes_is_no_new_mission(operator, keyboard, screen):
    keyboard.type("yes", "find the bucket")
    assert operator.next_line() == "find the bucket"
    assert "Nothing is being asked now" in screen.lines[0]


def test_where_motion_is_allowed_nobody_is_asked_and_the_screen_says_why(keyboard, screen):
    operator = TerminalOperator(motion="allow", source=keyboard, screen=screen)
    assert operator.confirm("May I?", LONG_S) == "yes"
    assert screen.lines == ["May I? yes (the configuration allows motion)"]


def test_control_characters_are_made_visible_and_long_sentences_stay_whole(operator, screen):
    operator.tell("Looking at the \x1b[2Jlamp\nCONFIRMED \u202e" + "x" * 200 + " use the remote")
    [line] = screen.lines
    assert "\\x1b[2Jlamp\\x0aCONFIRMED \\u202e" in line and line.endswith("use the remote")


def test_an_input_that_cannot_be_read_ends_like_one_that_ended_and_is_named(screen):
    class Broken:
        def __iter__(self):
            raise OSError("the terminal is gone")

    with TerminalOperator(source=Broken(), screen=screen) as operator:
        assert operator.next_line() is None
    assert any("the terminal is gone" in line for line in screen.lines)
