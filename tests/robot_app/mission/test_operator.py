"""One operator and several clients: who may command, what an answer is bound to, and that STOP always counts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace

import pytest

from drivers.ports import Approval, Option, Question, Reply
from robot_app.console.snapshots import operator_json
from robot_app.mission.lease import SILENT_S, Refused
from robot_app.mission.notices import Change, Notice
from robot_app.mission.operator import SharedOperator
from robot_app.mission.sentences import QUEUE_MAX, SENTENCE_MAX

LONG_S = 30.0  # longer than any of these tests takes
QUESTION = Question(
    "May I walk to the lamp?",
    memory_hash="abc",
    object_id=4,
    options=(Option(1, 4, "lamp", 0.7), Option(2, 9, "torch", 0.6)),
)


class Watch:
    """A clock that a test moves."""

    def __init__(self) -> None:
        self.s = 100.0

    def __call__(self) -> float:
        return self.s


@pytest.fixture
def watch() -> Watch:
    return Watch()


@pytest.fixture
def operator(watch) -> SharedOperator:
    made = SharedOperator(now_s=watch, epoch_ns=lambda: 77)
    made.join("test")
    return made


@pytest.fixture
def when_asked(operator) -> Callable[[Callable[[], object]], list[Exception]]:
    """Does something as soon as a question is open, each time; what it raised is kept."""
    refused: list[Exception] = []

    def do(act: Callable[[], object]) -> list[Exception]:
        def hear(notice: Notice) -> None:
            if notice.change is Change.ASKED:
                try:
                    act()
                except Refused as error:
                    refused.append(error)

        operator.listen(hear)
        return refused

    return do


def answer(operator: SharedOperator, lease, word: Approval = Approval.YES, **more) -> Reply:
    asked = operator.question
    more = {"memory_hash": "abc"} | more
    return operator.answer(lease, more.pop("id", asked.id), word, **more)


def test_an_answer_carries_who_gave_it_by_which_client_and_when(operator, when_asked):
    lease = operator.take("Ada", "console")
    when_asked(lambda: answer(operator, lease))
    assert operator.confirm(QUESTION, LONG_S) == Reply(Approval.YES, None, "Ada", "console", 77)
    assert operator.question is None


@pytest.mark.parametrize(
    ("word", "number", "object_id"),
    [(Approval.TAKE, 2, 9), (Approval.NOT_THIS_ONE, None, 4), (Approval.NOT_THIS_ONE, 2, 9), (Approval.NO, None, None)],
)
def test_more_can_be_answered_than_yes_and_no(operator, when_asked, word, number, object_id):
    lease = operator.take("Ada", "console")
    when_asked(lambda: answer(operator, lease, word, number=number))
    reply = operator.confirm(QUESTION, LONG_S)
    assert (reply.word, reply.object_id) == (word, object_id)


WRONG = {
    "another question": ({"id": 99}, "no longer asked"),
    "another memory": ({"memory_hash": "xyz"}, "another memory"),
    "no such candidate": ({"word": Approval.TAKE, "number": 3}, "no candidate number 3"),
    "no candidate named": ({"word": Approval.TAKE}, "no candidate number None"),
    "what nobody can say": ({"word": Approval.EXPIRED}, "no answer to this question"),
}


@pytest.mark.parametrize(("given", "why"), WRONG.values(), ids=WRONG)
def test_an_answer_that_is_not_to_this_very_question_has_no_effect(operator, when_asked, watch, given, why):
    lease = operator.take("Ada", "console")

    def try_it() -> None:
        try:
            answer(operator, lease, **given)
        finally:
            watch.s += LONG_S  # then nobody answers

    refused = when_asked(try_it)
    assert operator.confirm(QUESTION, LONG_S).word is Approval.EXPIRED
    assert why in str(refused[0])


def test_an_answer_counts_once_and_for_one_question(operator, when_asked):
    lease, used = operator.take("Ada", "console"), []

    def twice() -> None:
        used.append(operator.question.id)
        answer(operator, lease, id=used[0])
        answer(operator, lease, id=used[0])

    refused = when_asked(twice)
    assert operator.confirm(QUESTION, LONG_S).word is Approval.YES
    assert "answered already" in str(refused[0])
    with pytest.raises(Refused, match="Nothing is being asked"):
        operator.answer(lease, used[0], Approval.YES, memory_hash="abc")


def test_an_answer_that_comes_too_late_has_no_effect(operator, when_asked, watch):
    lease = operator.take("Ada", "console")

    def late() -> None:
        watch.s += LONG_S
        answer(operator, lease)

    refused = when_asked(late)
    assert operator.confirm(QUESTION, LONG_S).word is Approval.EXPIRED
    assert "too late" in str(refused[0])


def test_only_one_client_commands_and_the_other_is_told_who_does(operator):
    operator.take("Ada", "console")
    with pytest.raises(Refused, match=r"Ada \(console\) commands"):
        operator.take("Bob", "terminal")
    with pytest.raises(Refused, match=r"Ada \(console\) commands"):
        operator.ask(None, "find the lamp")


def test_a_takeover_is_told_to_all_and_the_old_lease_is_worth_nothing(operator):
    heard: list[str] = []
    operator.listen(lambda notice: heard.append(notice.sentence))
    old = operator.take("Ada", "console")
    operator.ask(old, "find the lamp")
    new = operator.take("Bob", "terminal", over=True)
    assert new.epoch == old.epoch + 1 and heard[-1] == (
        "Bob (terminal) commands the robot now. It was Ada (console). Not asked any more: 'find the lamp'."
    )
    assert operator.waiting == ()
    for refused in (lambda: operator.ask(old, "x"), lambda: operator.beat(old), lambda: operator.release(old)):
        with pytest.raises(Refused, match="take over first"):
            refused()


def test_a_takeover_voids_the_open_question_and_it_is_put_anew_to_the_new_operator(operator, when_asked):
    old, ids = operator.take("Ada", "console"), []

    def act() -> None:
        ids.append(operator.question.id)
        if len(ids) == 1:
            operator.take("Bob", "terminal", over=True)
            answer(operator, old)
        else:
            answer(operator, operator.lease, Approval.NO)

    refused = when_asked(act)
    reply = operator.confirm(QUESTION, LONG_S)
    assert (reply.word, reply.who) == (Approval.NO, "Bob") and ids == [1, 2]
    assert "Bob (terminal) commands" in str(refused[0])


class TakenOver(SharedOperator):
    """Somebody takes over just when its question is looked at."""

    takeover: threading.Thread | None = None

    @property
    def question(self):
        if self.takeover is None:
            self.takeover = threading.Thread(target=self.take, args=("Bob", "terminal"), kwargs={"over": True})
            self.takeover.start()
            self.takeover.join(0.2)  # as long as it takes, where it can
        return super().question


def test_what_a_page_is_told_of_the_operator_is_of_one_moment():
    operator = TakenOver()
    operator.ask(operator.take("Ada", "console"), "find the lamp")
    told = operator_json(operator)
    assert (told["lease"]["who"], [each["who"] for each in told["waiting"]]) == ("Ada", ["Ada"])
    operator.takeover.join(LONG_S)
    told = operator_json(operator)
    assert (told["lease"]["who"], told["waiting"]) == ("Bob", [])


def test_a_stop_needs_no_lease_keeps_its_first_reason_and_drops_what_waits(operator):
    operator.ask(operator.take("Ada", "console"), "find the lamp")
    operator.stop(because="a viewer pressed STOP", who="Vic", how="console")
    operator.stop(because="somebody else did too")
    stop = operator.stop_requested()
    assert (stop.because, stop.who, stop.at_ns) == ("a viewer pressed STOP", "Vic", 77)
    assert operator.waiting == ()
    assert operator.confirm(QUESTION, LONG_S).word is Approval.STOP


def test_a_stop_ends_the_question_that_is_open(operator, when_asked):
    when_asked(lambda: operator.stop(because="STOP", who="Vic"))
    assert operator.confirm(QUESTION, LONG_S) == Reply(Approval.STOP, None, "Vic", "", 77)


def test_a_stop_counts_until_a_sentence_that_was_said_after_it(operator):
    lease = operator.take("Ada", "console")
    before = operator.ask(lease, "find the lamp")
    assert operator.next_sentence() is before  # taken, not begun
    operator.stop(because="STOP")
    operator.begin(before)
    assert operator.stop_requested() is not None
    operator.ended()
    after = operator.ask(lease, "find the sofa")
    operator.begin(after)
    assert operator.stop_requested() is None and operator.mission is after


def test_a_lease_is_not_given_back_while_a_mission_runs(operator):
    lease = operator.take("Ada", "console")
    operator.begin(operator.ask(lease, "find the lamp"))
    with pytest.raises(Refused, match="under way"):
        operator.release(lease)
    operator.ended()
    operator.release(lease)
    assert operator.lease is None


def test_a_client_that_promised_signs_of_life_and_falls_silent_is_named(operator, watch):
    operator.take("Ada", "terminal")
    watch.s += 100.0
    assert operator.silence() is None  # a terminal promises none
    lease = operator.take("Bob", "console", over=True, beats=True)
    watch.s += SILENT_S
    assert operator.silence() is None
    watch.s += 0.1
    assert operator.silence() == "The page of Bob (console) has not been on a screen for 0.8 s."
    operator.beat(lease)
    assert operator.silence() is None


def test_a_flood_is_refused(operator):
    lease = operator.take("Ada", "console")
    with pytest.raises(Refused, match="Too much"):
        operator.ask(lease, "x" * (SENTENCE_MAX + 1))
    for _ in range(QUEUE_MAX):
        operator.ask(lease, "find the lamp")
    with pytest.raises(Refused, match="Too much"):
        operator.ask(lease, "find the lamp")


def test_whoever_waits_for_a_sentence_is_let_go_when_the_last_client_leaves(operator):
    got: list[object] = []
    waiting = threading.Thread(target=lambda: got.append(operator.next_sentence()))
    waiting.start()
    operator.leave("test")
    waiting.join(LONG_S)
    assert got == [None]


def test_where_motion_was_approved_beforehand_nobody_is_asked_and_the_screen_says_why():
    told: list[str] = []
    operator = SharedOperator(approve_all="approved with --yes")
    operator.listen(lambda notice: told.append(notice.sentence))
    assert operator.confirm(QUESTION, LONG_S).word is Approval.YES
    assert told == ["May I walk to the lamp? yes (approved with --yes)"]


def test_yes_to_all_is_no_yes_to_a_doubt_which_a_person_settles():
    operator = SharedOperator(approve_all="approved with --yes")
    assert operator.confirm(replace(QUESTION, doubt="it may be a bed"), 0.01).word is not Approval.YES
