"""What may be done over Zenoh, by whom: every refusal is said and changes nothing."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from drivers.ports import Approval, Option, Question, Reply
from openbelief.memory import ObjectMemory
from robot_app.cli import Failure
from robot_app.config import Config
from robot_app.mission.operator import SharedOperator
from robot_app.remote import messages as m
from robot_app.remote.asking import RemoteAsking
from robot_app.remote.hearing import heard
from robot_app.remote.server import RemoteServer
from robot_app.text_encoders import text_encoder_by_id
from tests.support.waiting import until


@pytest.fixture(scope="module")
def memory(demo_folder: Path) -> ObjectMemory:
    path = demo_folder / "site.belief"
    return ObjectMemory.open(path, text_encoder=text_encoder_by_id(ObjectMemory.open(path).text_encoder_id))


@pytest.fixture
def operator() -> SharedOperator:
    made = SharedOperator()
    made.join("terminal")
    return made


@pytest.fixture
def server(operator: SharedOperator, memory: ObjectMemory) -> RemoteServer:
    return RemoteServer(operator, memory)


def sent(server: RemoteServer, kind: type[m.RemoteMessage], **values: object) -> dict:
    return server.reply(kind, json.dumps(values).encode())


def leased(server: RemoteServer, who: str = "ada", **more: object) -> dict:
    reply = sent(server, m.LeaseRequest, who=who, **more)
    assert reply.pop("ok"), reply
    return reply


def test_a_lease_asks_and_its_sentence_waits(server, operator):
    lease = leased(server)
    reply = sent(server, m.AskRequest, sentence="go to the sofa", **lease)
    assert reply["ok"] and [each.text for each in operator.waiting] == ["go to the sofa"]
    assert operator.waiting[0].who == "ada" and operator.waiting[0].how == "zenoh"
    assert sent(server, m.StatusRequest)["waiting"][0]["order"] == reply["order"]


@pytest.mark.parametrize(
    ("change", "because"),
    [
        ({"token": "guessed"}, "commands the robot"),
        ({"epoch": 99}, "commands the robot"),
        ({"token": "x" * 65}, "token"),
    ],
)
def test_a_command_without_the_right_lease_is_refused_and_nothing_waits(server, operator, change, because):
    lease = leased(server) | change
    reply = sent(server, m.AskRequest, sentence="go to the sofa", **lease)
    assert not reply["ok"] and because in reply["refused"] and operator.waiting == ()


def test_before_anybody_commands_nothing_is_taken(server, operator):
    reply = sent(server, m.AskRequest, sentence="go to the sofa", token="", epoch=0)
    assert not reply["ok"] and "Nobody commands" in reply["refused"] and operator.waiting == ()


def test_a_stale_token_of_before_a_takeover_is_refused(server, operator):
    old = leased(server)
    assert "take over first" in sent(server, m.LeaseRequest, who="bob")["refused"]
    leased(server, "bob", over=True)
    assert not sent(server, m.AskRequest, sentence="go to the sofa", **old)["ok"]
    assert not sent(server, m.BeatRequest, **old)["ok"] and not sent(server, m.ReleaseRequest, **old)["ok"]
    assert operator.waiting == () and operator.lease.who == "bob"


@pytest.mark.parametrize(
    ("payload", "because"),
    [
        (b"", "who"),
        (b"[]", "no lease request"),
        (b'{"who": "ada", "role": "admin"}', "role"),
        (b"\xff\xfe", "no lease request"),
        (b'{"who": "' + b"a" * 20_000 + b'"}', "too large"),
        (b'{"who": ""}', "who"),
    ],
)
def test_what_is_no_request_is_refused_in_one_line(server, operator, payload, because):
    reply = server.reply(m.LeaseRequest, payload)
    assert not reply["ok"] and because in reply["refused"] and "\n" not in reply["refused"]
    assert operator.lease is None


@pytest.mark.parametrize("sentence", ["x" * 301, "", "...", "please"])
def test_a_sentence_that_is_too_long_or_names_nothing_is_refused(server, operator, sentence):
    assert not sent(server, m.AskRequest, sentence=sentence, **leased(server))["ok"]
    assert operator.waiting == ()


def test_anybody_may_stop_and_what_waits_is_dropped(server, operator):
    sent(server, m.AskRequest, sentence="go to the sofa", **leased(server))
    assert sent(server, m.RemoteStopRequest, who="a passer-by")["ok"]
    assert operator.stop_requested().because == "a passer-by said stop over the network" and operator.waiting == ()


def test_words_from_outside_reach_the_screen_without_control_characters(server, operator):
    sent(server, m.RemoteStopRequest, who="eve\x1b[2J\n\rfake: yes")
    assert operator.stop_requested().because.isprintable()


QUESTION = Question(
    "May I walk to the sofa?", "hash-1", 3, options=(Option(1, 3, "sofa", 0.9), Option(2, 5, "bed", 0.5))
)


def question_after(server: RemoteServer, before: int = 0) -> dict:
    """The open question of status, as soon as there is one that was asked after that one."""
    seen: list[dict] = []

    def look() -> bool:
        question = sent(server, m.StatusRequest)["question"]
        if question and question["id"] > before:
            seen.append(question)
        return bool(seen)

    until(look, "a question")
    return seen[0]


def asked(operator: SharedOperator, server: RemoteServer, act: Callable[[dict], None]) -> Reply:
    """The answer to QUESTION about the next sentence, while `act` (given the open question) happens beside it."""
    operator.begin(operator.next_sentence())
    with ThreadPoolExecutor(1) as beside:
        answer = beside.submit(operator.confirm, QUESTION, 30.0)
        try:
            act(question_after(server))
        except BaseException:
            operator.stop(because="the test failed")
            raise
        return answer.result()


def test_the_open_question_is_answered_with_the_lease(server, operator):
    lease = leased(server)
    sent(server, m.AskRequest, sentence="go to the sofa", **lease)

    def act(question: dict) -> None:
        wrong = {"question": question["id"], "memory_hash": "another", "word": "yes"}
        assert "another memory" in sent(server, m.ConfirmRequest, **wrong, **lease)["refused"]
        right = wrong | {"memory_hash": question["memory_hash"]}
        assert not sent(server, m.ConfirmRequest, **(right | {"question": 99}), **lease)["ok"]
        assert not sent(server, m.ConfirmRequest, **right, token="guessed", epoch=1)["ok"]
        taken = {**right, "word": "take", "number": 2}
        assert sent(server, m.ConfirmRequest, **taken, **lease)["object_id"] == 5

    assert asked(operator, server, act).word is Approval.TAKE


def test_an_agent_proposes_is_named_and_is_not_answered_from_afar(server, operator):
    operator.take("ada", "terminal")
    reply = sent(server, m.ProposeRequest, agent="helper", sentence="go to the sofa")
    assert reply["ok"] and (operator.waiting[0].who, operator.waiting[0].how) == ("helper", "agent")

    def act(question: dict) -> None:
        assert question["sentence"].startswith("The agent helper asks, not a person.")
        lease = leased(server, "eve", over=True)  # whoever has taken over by network cannot say the agent's yes
        anew = question_after(server, question["id"])
        yes = {"question": anew["id"], "memory_hash": "hash-1", "word": "yes"}
        assert "console or the terminal" in sent(server, m.ConfirmRequest, **yes, **lease)["refused"]
        mine = operator.take("ada", "terminal", over=True)
        last = question_after(server, anew["id"])
        operator.answer(mine, last["id"], Approval.NO, memory_hash="hash-1")

    assert asked(operator, server, act).word is Approval.NO


def test_an_agents_question_is_asked_although_everything_else_is_approved(memory):
    operator = SharedOperator(approve_all="approved with --yes")
    operator.take("ada", "terminal")
    operator.begin(operator.propose("go to the sofa", agent="helper"))
    assert operator.confirm(QUESTION, 30.0).word is Approval.EXPIRED  # nobody is there to answer


def test_without_a_person_who_commands_an_agent_proposes_in_vain(server, operator):
    reply = sent(server, m.ProposeRequest, agent="helper", sentence="go to the sofa")
    assert "a person must be there" in reply["refused"] and operator.waiting == ()


def test_candidates_and_why_are_those_of_query_and_why(server, memory):
    reply = sent(server, m.CandidatesRequest, query="fire extinguisher", limit=2)
    ranked = memory.rank("fire extinguisher", limit=2)
    assert [each["object_id"] for each in reply["candidates"]] == [each.object_id for each in ranked]
    evidence = sent(server, m.WhyRequest, object_id=ranked[0].object_id)["why"]
    assert evidence["observations"] and evidence["object_id"] == ranked[0].object_id
    assert "There is no object 999" in sent(server, m.WhyRequest, object_id=999)["refused"]


def test_status_says_who_commands_but_never_the_token(server, operator):
    lease = leased(server)
    reply = sent(server, m.StatusRequest)
    assert reply["commands"] == {"who": "ada", "how": "zenoh", "epoch": lease["epoch"]}
    assert lease["token"] not in json.dumps(reply)


class Commands:
    """The operator over there, until the first answer: what `ask --remote` sends is kept."""

    doubt = ""

    def __init__(self) -> None:
        self.answers: list[str] = []
        self.asked: list[str] = []

    def status(self, after: int = 0) -> dict:
        outcome = {"order": 1, "end": "CANCELLED"} if self.answers else None
        question = None if self.answers else {"id": 1, "doubt": self.doubt, "left_s": 9.0}
        return {"said": [], "outcome": outcome, "mission": None, "question": question, "waiting": [{"order": 1}]}

    def ask(self, sentence: str) -> int:
        self.asked.append(sentence)
        return 1

    def answer(self, question: dict, word: str, number: int | None) -> None:
        self.answers.append(word)


@pytest.mark.parametrize(("doubt", "answer"), [("", "yes"), ("it may be a bed", "no")])
def test_yes_from_afar_is_no_yes_to_a_doubt(doubt: str, answer: str) -> None:
    commands = Commands()
    commands.doubt = doubt
    RemoteAsking(commands, "ada", approve=True, source=io.StringIO(), sleep=lambda _: None).run("go to the sofa")
    assert commands.answers == [answer]


@pytest.mark.parametrize(("sentence", "said"), [("", "names nothing"), ("please", "names nothing"), ("x" * 301, "300")])
def test_a_sentence_that_asks_for_nothing_or_too_much_is_refused_in_one_line_before_it_is_sent(sentence, said):
    commands = Commands()
    with pytest.raises(ValueError, match=said) as refused:
        RemoteAsking(commands, "ada", approve=True, source=io.StringIO(), sleep=lambda _: None).run(sentence)
    assert "\n" not in str(refused.value) and commands.asked == []


@pytest.mark.parametrize("sentence", ["stop", "STOP!", "please stop"])
def test_a_stop_is_sent_however_it_is_said(sentence):
    commands = Commands()
    RemoteAsking(commands, "ada", approve=True, source=io.StringIO(), sleep=lambda _: None).run(sentence)
    assert commands.asked == [sentence]


class Asked:
    """The operator over there: what it is told."""

    def __init__(self) -> None:
        self.did: list[str] = []

    def stop(self, who: str) -> None:
        self.did.append(f"stop by {who}")


@pytest.mark.parametrize(
    ("file", "typed", "asked", "did"),
    [
        ("go_to_the_armchair", "\n", "Go to the armchair.", []),
        ("go_to_the_armchair", "find the sofa\n", "find the sofa", []),
        ("go_to_the_armchair", "stop!\n", "'stop' was typed: that is a stop", ["stop by ada"]),
        ("go_to_the_armchair", "", "the input has ended", []),
        ("stop", "\n", "that is a stop, and nothing was asked", ["stop by ada"]),
    ],
)
def test_what_a_recording_says_may_be_corrected_before_it_is_asked_from_afar(monkeypatch, file, typed, asked, did):
    monkeypatch.setattr("sys.stdin", io.StringIO(typed))
    there, speech = Asked(), Path(__file__).parents[1] / "voice" / "speech"
    try:
        said = heard(speech / f"{file}.wav", Config(), there, "ada", may_correct=True)
    except Failure as refused:
        said = str(refused)
    assert asked in said and there.did == did
