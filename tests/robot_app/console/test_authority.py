"""Who gets in, who may command, and what has no effect."""

from __future__ import annotations

import gc
import json
import queue
import threading
import time
from dataclasses import replace
from http.client import HTTPConnection

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from drivers.ports import Approval, Option, Question
from robot_app.cli import Failure
from robot_app.config_sections import ConsoleSection
from robot_app.console.accounts import Accounts, hashed, verified
from robot_app.console.commands import SEEN_MAX_AGE_S
from robot_app.console.listening import Listening, checked, listening_of
from robot_app.console.sessions import PAIRING_S, SESSION_S, Sessions, TokenBucket
from robot_app.mission.notices import Change
from robot_app.mission.open_question import OpenQuestion
from tests.robot_app.console.conftest import SOON_S
from tests.robot_app.console.test_certificate import certified

PASSWORD = "correct horse"
OPTIONS = (Option(1, 1, "lamp", 0.5), Option(2, 7, "sofa", 0.4))
QUESTION = Question("May I?", memory_hash="abc", object_id=1, options=OPTIONS)


def test_nothing_but_the_page_itself_is_given_to_who_is_not_logged_in(console):
    nobody = console.visitor(None)
    assert nobody.get("/")[0] == 200
    for path in (
        "/api/me",
        "/api/site",
        "/api/grid.png",
        "/api/trials",
        "/api/objects/0",
        "/api/trials/small_room.mcap",
    ):
        assert nobody.get(path)[0] == 401, path
    assert nobody.post("/api/stop", {})[0] == 401
    with nobody.socket() as socket, pytest.raises(ConnectionClosed) as ended:
        socket.recv(20)
    assert ended.value.rcvd.code == 4401


def test_a_name_and_its_password_log_in_and_out(console):
    ada = console.visitor(None)
    assert ada.post("/api/login", {"name": "ada", "password": PASSWORD}) == (200, {"name": "ada", "role": "operator"})
    assert ada.json("/api/me")["role"] == "operator"
    ada.post("/api/logout", {})
    assert ada.get("/api/me")[0] == 401


def test_the_cookie_cannot_be_read_by_a_script_or_sent_by_another_sites_page(console):
    visitor = console.visitor(None)
    assert visitor.post("/api/login", {"name": "ada", "password": PASSWORD})[0] == 200
    assert {"HttpOnly", "SameSite=strict"} <= {part.strip() for part in visitor.set_cookie.split(";")}


@pytest.mark.parametrize("given", [{"name": "ada", "password": "wrong horse"}, {"name": "eve", "password": PASSWORD}])
def test_a_wrong_password_and_a_name_that_is_not_there_are_refused_alike(console, given):
    status, answer = console.visitor(None).post("/api/login", given)
    assert (status, answer["error"]) == (401, "That name and password do not belong together.")


def test_guessing_is_slowed_down(console):
    guesses = [console.visitor(None).post("/api/login", {"name": "eve", "password": "guess"})[0] for _ in range(7)]
    assert guesses[:5] == [401] * 5 and guesses[-1] == 429


def test_a_pairing_link_logs_in_once(console):
    token = console.server.pairing_url("ada", "operator").split("#pair=")[1]
    assert console.visitor(None).post("/api/pair", {"token": token})[0] == 200
    status, answer = console.visitor(None).post("/api/pair", {"token": token})
    assert status == 401 and "used already" in answer["error"]


def test_a_pairing_link_and_a_session_expire():
    now = [100.0]
    sessions = Sessions(lambda: now[0])
    token = sessions.pairing("ada", "operator")
    session = sessions.open("ada", "operator")
    now[0] += PAIRING_S + 1
    assert sessions.pair(token) is None and sessions.find(session.token) is not None
    now[0] += SESSION_S
    assert sessions.find(session.token) is None


@pytest.mark.parametrize(
    ("headers", "why"),
    [({"host": "evil.example"}, "host name"), ({"origin": "http://evil.example"}, "another site")],
)
def test_another_host_name_and_another_sites_page_have_no_effect(console, headers, why):
    visitor = console.visitor()
    visitor.headers = headers
    status, body, _ = visitor.get("/api/me")
    assert status == 403 and why in body.decode()
    request_status, answer = visitor.post("/api/stop", {})
    assert request_status == 403 and why in answer.decode()
    assert console.operator.stop_requested() is None


@pytest.mark.parametrize("origin", ["http://evil.example", None, "null"])
def test_a_socket_from_another_sites_page_is_refused(console, origin):
    with pytest.raises(InvalidStatus) as refused, console.visitor().socket(origin=origin):
        pass
    assert refused.value.response.status_code == 403


def test_the_answer_forbids_the_browser_everything_that_is_not_ours(console):
    _, _, headers = console.visitor(None).get("/")
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy and "http" not in policy
    assert headers["x-content-type-options"] == "nosniff"


def test_while_it_serves_no_full_collection_of_garbage_stops_every_thread(console):
    assert gc.get_threshold()[2] > 10**6 and gc.get_freeze_count() > 0


def test_what_is_too_large_is_refused(console):
    assert console.visitor().post("/api/login", b"x" * 20_000)[0] == 403


def test_a_body_that_does_not_say_how_long_it_is_is_not_read(console):
    """It would be kept whole, of anybody who reaches the port."""
    link = HTTPConnection(console.server.url.removeprefix("http://"), timeout=SOON_S)
    headers = {"origin": console.server.url, "transfer-encoding": "chunked"}
    link.request("POST", "/api/pair", iter([b"x" * 1000] * 3), headers, encode_chunked=True)
    answer = link.getresponse()
    assert answer.status == 403 and b"told beforehand" in answer.read()
    link.close()


@pytest.mark.parametrize("half", ["password", "name"])
def test_half_a_character_is_no_name_and_no_password(console, half):
    given = {"name": "ada", "password": PASSWORD} | {half: "\ud800"}
    assert console.visitor(None).post("/api/login", given)[0] == 400


def test_a_viewer_may_look_and_stop_and_nothing_else(console, pages):
    with console.visitor("viewer", "vic").socket() as socket:
        page = pages(socket)
        assert page.next_state()["you"] == {"name": "vic", "role": "viewer", "epoch": None}
        for command in ({"type": "take"}, {"type": "ask", "epoch": 1, "text": "find the lamp"}, {"type": "release"}):
            refused = page.command(**command)
            assert not refused["ok"] and "viewer" in refused["text"]
        assert console.operator.lease is None and console.operator.waiting == ()
        assert page.say(type="stop") == {"type": "ack", "id": 9, "ok": True, "text": "STOP was heard."}
    stop = console.operator.stop_requested()
    assert (stop.who, stop.how, stop.because) == ("vic", "console", "vic pressed STOP")


def test_an_operator_takes_the_command_and_asks(console, page):
    assert page.command(type="take")["ok"]
    epoch = page.next_state()["you"]["epoch"]
    assert page.command(type="ask", epoch=epoch, text="  find  the lamp ")["text"] == "Asked: find the lamp"
    [waiting] = console.operator.waiting
    assert (waiting.text, waiting.who, waiting.how) == ("find the lamp", "ada", "console")


def test_a_sentence_that_names_nothing_is_refused_before_it_waits(console, page):
    page.command(type="take")
    refused = page.command(type="ask", epoch=page.next_state()["you"]["epoch"], text="take me to the")
    assert not refused["ok"] and "names nothing" in refused["text"]


def test_a_takeover_is_seen_by_both_and_the_old_page_commands_nothing(console, page, pages):
    page.command(type="take")
    epoch = page.next_state()["you"]["epoch"]
    with console.visitor(name="bob").socket() as socket:
        other = pages(socket)
        refused = other.command(type="take")
        assert not refused["ok"] and "ada (console) commands" in refused["text"]
        assert other.command(type="take", over=True)["ok"]
        while other.next_state()["operator"]["lease"]["who"] != "bob":
            pass
    while page.next_state()["operator"]["lease"]["who"] != "bob":
        pass
    assert page.state["you"]["epoch"] is None
    refused = page.command(type="ask", epoch=epoch, text="find the lamp")
    assert not refused["ok"] and "bob (console) commands" in refused["text"]
    assert console.operator.waiting == ()


def asking(console, timeout_s: float = 60.0) -> tuple[threading.Thread, list, OpenQuestion]:
    """A mission that asks QUESTION, its answer, and the question as it was opened: a short one may be over by now."""
    replies: list = []
    opened: queue.Queue[OpenQuestion] = queue.Queue()
    console.operator.listen(lambda notice: notice.change is Change.ASKED and opened.put(console.operator.question))
    thread = threading.Thread(target=lambda: replies.append(console.operator.confirm(QUESTION, timeout_s)))
    thread.start()
    return thread, replies, opened.get(timeout=SOON_S)


@pytest.mark.parametrize("doubt", ["", "what fits best was called gray, never red"])
def test_a_question_says_what_is_in_doubt(console, page, doubt):
    question = replace(QUESTION, doubt=doubt)
    thread = threading.Thread(target=console.operator.confirm, args=(question, 60.0))
    thread.start()
    while (asked := page.next_state()["operator"]["question"]) is None:
        pass
    page.command(type="take")
    answer = {"type": "answer", "epoch": page.next_state()["you"]["epoch"], "question": asked["id"]}
    assert asked["doubt"] == doubt
    assert page.command(**answer, memory_hash="abc", word="no")["ok"]
    thread.join(20)


STALE = {
    "of another question": {"question": 99},
    "about another memory": {"memory_hash": "xyz"},
    "of an old lease": {"epoch": 99},
    "on a snapshot of long ago": {"seen": 0},
}


@pytest.mark.parametrize("wrong", STALE.values(), ids=STALE)
def test_an_answer_that_is_stale_in_any_way_has_no_effect(console, page, wrong):
    page.command(type="take")
    epoch = page.next_state()["you"]["epoch"]
    thread, replies, asked = asking(console)
    answer = {"type": "answer", "epoch": epoch, "question": asked.id, "memory_hash": "abc", "word": "yes"}
    assert not page.command(**answer | wrong)["ok"]
    assert console.operator.question is asked and asked.reply is None
    assert page.command(**answer)["ok"]
    assert not page.command(**answer)["ok"], "an answer counts once"
    thread.join(20)
    assert (replies[0].word, replies[0].who, replies[0].how) == (Approval.YES, "ada", "console")


def test_an_answer_that_comes_when_the_question_has_expired_has_no_effect(console, page):
    page.command(type="take")
    epoch = page.next_state()["you"]["epoch"]
    thread, replies, asked = asking(console, timeout_s=0.2)
    thread.join(20)
    late = page.command(type="answer", epoch=epoch, question=asked.id, memory_hash="abc", word="yes")
    assert not late["ok"] and "Nothing is being asked" in late["text"]
    assert replies[0].word is Approval.EXPIRED and asked.reply is None


def test_a_command_that_waited_somewhere_is_not_carried_out(console, page):
    page.command(type="take")
    state = page.next_state()
    time.sleep(SEEN_MAX_AGE_S + 0.1)  # the age is the server's own, of a snapshot that it made
    late = page.say(type="ask", seen=state["n"], epoch=state["you"]["epoch"], text="find the lamp")
    assert not late["ok"] and "too long ago" in late["text"]
    assert console.operator.waiting == ()


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"type": "dance"}', '{"type": "ask"}', '{"type": "take", "seen": "1"}']
)
def test_what_is_no_command_is_refused_and_the_page_goes_on(page, text):
    page.socket.send(text)
    while (heard := json.loads(page.socket.recv(20)))["type"] != "ack":
        pass
    assert not heard["ok"]
    assert page.say(type="stop")["ok"]


def test_bytes_are_no_command_and_the_page_goes_on(page):
    page.socket.send(b"\x00\x01")
    while (heard := json.loads(page.socket.recv(SOON_S)))["type"] != "ack":
        pass
    assert not heard["ok"] and "no command" in heard["text"]
    assert page.say(type="stop")["ok"]


COMMANDS = {"help": "Say what to find", "come back": "not supported", "where are you?": "plan shows"}


@pytest.mark.parametrize(("text", "said"), COMMANDS.items(), ids=COMMANDS)
def test_a_command_that_starts_no_drive_is_answered_on_the_page_that_gave_it(console, page, text, said):
    page.command(type="take")
    refused = page.command(type="ask", epoch=page.next_state()["you"]["epoch"], text=text)
    assert not refused["ok"] and said in refused["text"] and console.operator.waiting == ()


@pytest.mark.parametrize(("role", "name"), [("operator", "bob"), ("viewer", "vic")])
def test_a_stop_in_words_is_one_from_whoever_is_logged_in(console, pages, role, name):
    console.operator.take("ada", "console")
    with console.visitor(role, name).socket() as socket:
        said = pages(socket).say(type="ask", seen=-1, epoch=0, text="stop the robot")
    assert said["ok"] and said["text"] == "STOP was heard."
    assert console.operator.stop_requested().who == name


def test_a_sign_of_life_is_as_old_as_the_snapshot_that_was_painted(console, page):
    page.command(type="take")
    state = dict(page.next_state())
    while page.next_state()["n"] < state["n"] + 12:  # more than a second, and nothing is painted
        pass
    assert "The page of ada (console)" in console.operator.silence()
    page.socket.send(json.dumps({"type": "beat", "seen": state["n"]}))
    page.next_state()
    assert console.operator.silence() is not None, "an old snapshot is no sign of life"
    page.socket.send(json.dumps({"type": "beat", "seen": page.next_state()["n"]}))
    page.command(type="release")
    assert console.operator.silence() is None


def test_loopback_needs_no_certificate_and_anything_wider_needs_one_and_somebody_who_can_log_in(accounts, tmp_path):
    here, lan = listening_of("8800"), listening_of("192.168.1.5:8800")
    checked(here, ConsoleSection(), Accounts(None))
    with pytest.raises(Failure, match="without TLS"):
        checked(lan, ConsoleSection(), Accounts(accounts))
    tls = certified(tmp_path, "192.168.1.5")
    with pytest.raises(Failure, match="nobody can log in"):
        checked(lan, tls, Accounts(tmp_path / "none.json"))
    checked(lan, tls, Accounts(accounts))


@pytest.mark.parametrize("text", ["0.0.0.0:8800", "[::]:8800"])
def test_every_network_at_once_is_refused_by_its_name(text):
    with pytest.raises(ValueError, match="would be every network"):
        listening_of(text)


@pytest.mark.parametrize("text", ["0.0.0.0:8800", "[::]:8800", "8800x", "host.name:8800", "127.0.0.1:99999"])
def test_an_address_that_means_everybody_or_nobody_is_refused(text):
    with pytest.raises(ValueError, match="needed"):
        listening_of(text)


def test_an_address_and_a_port_are_read():
    assert listening_of("8800") == Listening("127.0.0.1", 8800)
    assert listening_of("[::1]:8800") == Listening("::1", 8800)


def test_a_password_is_kept_as_argon2id_in_a_file_for_its_owner_only(tmp_path):
    accounts = Accounts(tmp_path / "accounts.json")
    accounts.put("ada", "operator", PASSWORD)
    assert accounts.path.stat().st_mode & 0o077 == 0
    assert PASSWORD not in accounts.path.read_text() and "$argon2id$" in accounts.path.read_text()
    assert accounts.verify("ada", PASSWORD).role == "operator" and accounts.verify("ada", "other") is None
    accounts.remove("ada")
    assert accounts.names() == {}


@pytest.mark.parametrize(("name", "password"), [("", PASSWORD), ("a b", PASSWORD), ("<x>", PASSWORD), ("ada", "short")])
def test_an_account_that_makes_no_sense_is_refused(tmp_path, name, password):
    with pytest.raises(Failure):
        Accounts(tmp_path / "accounts.json").put(name, "viewer", password)


NO_ACCOUNTS = {
    "nothing": "",
    "a list": "[]",
    "no table": "{}",
    "an unknown role": '{"accounts": {"ada": {"role": "king", "password": "x"}}}',
    "a password that is no hash": '{"accounts": {"ada": {"role": "viewer", "password": "correct horse"}}}',
    "a password that is no text": '{"accounts": {"ada": {"role": "viewer", "password": 1}}}',
}


@pytest.mark.parametrize("text", NO_ACCOUNTS.values(), ids=NO_ACCOUNTS)
def test_a_file_that_holds_no_accounts_is_named_at_the_start_at_this_machine_too(tmp_path, text):
    path = tmp_path / "accounts.json"
    path.write_text(text)
    path.chmod(0o600)
    with pytest.raises(Failure, match=r"accounts\.json cannot be read as accounts"):
        checked(listening_of("8800"), ConsoleSection(accounts=path), Accounts(path))


@pytest.mark.parametrize("mode", [0o640, 0o604, 0o622])
def test_a_file_of_accounts_that_others_read_or_write_is_refused_with_what_to_do(tmp_path, mode):
    accounts = Accounts(tmp_path / "accounts.json")
    accounts.put("ada", "operator", PASSWORD)
    accounts.path.chmod(mode)
    with pytest.raises(Failure, match="chmod 600"):
        len(accounts)


def test_accounts_that_can_no_longer_be_read_are_a_refusal_at_the_login_and_links_still_log_in(console, accounts):
    whole = accounts.read_text()
    try:
        accounts.write_text("garbage")
        status, answer = console.visitor(None).post("/api/login", {"name": "ada", "password": PASSWORD})
    finally:
        accounts.write_text(whole)
    assert status == 503 and "cannot be read" in answer["error"] and "accounts.json" not in answer["error"]
    assert console.visitor().json("/api/me")["role"] == "operator"


def test_two_hashes_of_a_password_differ_and_both_verify():
    one, two = hashed(PASSWORD), hashed(PASSWORD)
    assert one != two and verified(PASSWORD, one) and verified(PASSWORD, two) and not verified("other", one)


def test_a_rate_lets_a_burst_through_and_then_its_average():
    now = [0.0]
    rate = TokenBucket(2.0, 3, lambda: now[0])
    assert [rate.allows("a") for _ in range(4)] == [True, True, True, False]
    now[0] = 0.5
    assert rate.allows("a") and not rate.allows("a") and rate.allows("b")
