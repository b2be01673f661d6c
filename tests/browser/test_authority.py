"""What has no effect, and says so: commands of another moment, of who does not command, of another site's page."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from tests.browser.conftest import FOREIGN_HOST, until
from tests.browser.steps import ROUTE, robot_at, until_idle

SEEN_MAX_AGE_MS = 2000


def answer(tab, believed) -> None:
    """Yes, by a page that is made to believe something else."""
    send = "(it) => Object.assign(openbelief.question, it, {sent: false}).answer('yes')"
    tab.page.evaluate(send, believed)


def test_a_takeover_is_seen_by_both_and_the_question_is_put_to_the_new_operator(tab, open_tab):
    tab.ask(ROUTE)
    tab.until_asked()
    asked, epoch = tab.state()["operator"]["question"], tab.state()["you"]["epoch"]
    other = open_tab()
    assert "Take over" in other.words("take")
    other.take()
    until(lambda: tab.state()["you"]["epoch"] is None, "the old page knows")
    until(lambda: tab.page.locator("#answer-yes").is_disabled(), "the question that is put anew is not the old page's")
    assert "Take over" in tab.words("take")
    other.until_asked()
    again = other.state()["operator"]["question"]
    assert again["id"] > asked["id"]
    for question in (asked, again):  # by a page that is made to send it all the same
        answer(tab, {"epoch": epoch, "asked": question})
        assert "commands the robot now" in tab.refused()
    other.page.locator("#answer-no").click()
    until_idle(other)
    assert [each["reply"] for each in other.state()["mission"]["replies"]] == ["no"]
    tab.take()


def test_a_viewers_commands_are_refused_and_the_page_says_so(open_tab):
    viewer = open_tab("viewer")
    viewer.page.evaluate("document.getElementById('ask-words').value = 'find the armchair'")
    for command in ("openbelief.ask.ask()", "openbelief.ask.take()"):
        viewer.page.evaluate(command)
        assert "You are a viewer" in viewer.refused()
    operator = viewer.state()["operator"]
    assert operator["waiting"] == [] and operator["mission"] is None


def test_an_answer_to_a_question_that_has_expired_or_was_answered_moves_nothing(tab):
    tab.ask(ROUTE)
    tab.until_asked()
    start, asked = robot_at(tab), tab.state()["operator"]["question"]
    until(lambda: tab.state()["operator"]["question"] is None, "the question expires")
    until_idle(tab)
    answer(tab, {"asked": asked})
    assert "Nothing is being asked" in tab.refused()
    assert math.dist(start, robot_at(tab)) < 0.01 and tab.state()["operator"]["mission"] is None


def test_a_command_given_offline_is_refused_and_never_carried_out(tab):
    tab.may_complain = "ERR_INTERNET_DISCONNECTED"
    tab.ask(ROUTE)
    tab.until_asked()
    start, asked = robot_at(tab), tab.state()["operator"]["question"]
    answer = {"type": "answer", "id": 99, "question": asked["id"], "memory_hash": asked["memory_hash"], "word": "yes"}
    now = {"seen": tab.state()["n"], "epoch": tab.state()["you"]["epoch"]}
    tab.page.context.set_offline(True)
    # What a page must never do: bytes that wait in the browser's socket for the link to come back.
    tab.page.evaluate("(command) => openbelief.link.socket.send(JSON.stringify(command))", answer | now)
    ask = {"type": "ask", "id": 100, "text": "find the bucket"}
    tab.page.evaluate("(command) => openbelief.link.socket.send(JSON.stringify(command))", ask | now)
    until(lambda: not tab.page.evaluate("window.openbelief.link.open"), "the link is down")
    assert tab.page.locator("#ask-send").is_disabled()
    sent = tab.page.evaluate("window.openbelief.link.command({type: 'ask', epoch: 1, text: 'find the lamp'})")
    assert not sent["ok"] and "Not sent" in sent["text"]
    assert "No link to the console" in tab.words("state")
    tab.page.wait_for_timeout(SEEN_MAX_AGE_MS)
    tab.page.context.set_offline(False)
    until(lambda: tab.page.evaluate("window.openbelief.link.open"), "the link is up")
    until(lambda: tab.page.locator("#ask-send").is_enabled(), "the same page still commands")
    until_idle(tab)
    assert [each["reply"] for each in tab.state()["mission"]["replies"]] == ["expired"]
    assert tab.state()["operator"]["waiting"] == [] and math.dist(start, robot_at(tab)) < 0.01


# What another site's page tries in the browser of somebody who is logged in here.
ATTACKS = """async (console) => {
  const post = {method: "POST", mode: "no-cors", credentials: "include"};
  const stop = await fetch(`${console}/api/stop`, post).then(() => "sent", String);
  const mine = await fetch(`${console}/api/me`, {credentials: "include"}).catch(() => null);
  const me = mine ? await mine.text() : "unread";
  const socket = await new Promise((done) => {
    const made = new WebSocket(`${console.replace("http", "ws")}/ws?page=a`);
    made.onopen = () => done("open");
    made.onclose = () => done("refused");
  });
  const frame = document.createElement("iframe");
  frame.src = console;
  await new Promise((done) => { frame.onload = done; document.body.append(frame); });
  let framed = "out of reach";
  try { framed = frame.contentWindow.openbelief ? "framed" : "empty"; } catch {}
  return {stop, me, socket, framed};
}"""


@pytest.fixture
def other_site() -> Iterator[str]:
    """A page of another origin on this machine: to browsers the same site, so that cookies come along."""

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><body>another site</body>")

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Page)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


def test_another_sites_page_in_the_same_browser_neither_stops_nor_reads_nor_frames(tab, other_site):
    tab.ask("find the bucket")
    tab.until_asked()
    page = tab.page.context.new_page()
    page.goto(other_site)
    tried = page.evaluate(ATTACKS, tab.site.program.url)
    assert (tried["me"], tried["socket"], tried["framed"]) == ("unread", "refused", "out of reach")
    assert tab.state()["operator"]["stop"] is None and tab.state()["operator"]["question"] is not None
    page.close()


def test_the_console_under_a_foreign_name_is_refused_in_words(open_tab):
    tab = open_tab()
    page = tab.page.context.new_page()
    port = tab.site.program.url.rsplit(":", 1)[1]
    answer = page.goto(f"http://{FOREIGN_HOST}:{port}/")
    assert answer.status == 403 and "does not answer to that host name" in page.locator("body").inner_text()
    page.close()


def test_the_policy_keeps_the_page_from_running_or_asking_for_anything_that_is_not_ours(open_tab):
    tab = open_tab()
    tab.may_complain = "Content Security Policy|404"
    tried = tab.page.evaluate(
        """async () => {
          document.body.insertAdjacentHTML("beforeend", "<img src=x onerror='window.ran = 1'>");
          const script = document.createElement("script");
          script.textContent = "window.ran = 1";
          document.body.append(script);
          const asked = await fetch("https://example.org/").then(() => "answered", () => "refused");
          return [window.ran || 0, asked];
        }"""
    )
    assert tried == [0, "refused"] and any("Content Security Policy" in each for each in tab.complaints)
    tab.requests.clear()
