"""What a page says that is cut off, shut out or let in: only what it can know, and never that all is well."""

from __future__ import annotations

from tests.browser.conftest import PATIENCE_S, PHONE, finish, until
from tests.browser.steps import ASK, until_idle, until_under_way, walk

OFFLINE = "ERR_INTERNET_DISCONNECTED"
NO_LINK = "No link to the console"


def cut_off(tab) -> None:
    tab.may_complain = OFFLINE
    tab.page.context.set_offline(True)
    until(lambda: tab.words("state") == NO_LINK, "the link is down")


def test_only_the_page_that_commands_promises_that_its_silence_holds_the_robot(tab, open_tab):
    viewer = open_tab("viewer")
    walk(tab)
    cut_off(viewer)
    assert "walks on" in viewer.words("reason") and "held" not in viewer.words("reason")
    cut_off(tab)
    assert "A walking robot is held" in tab.words("reason")
    viewer.page.context.set_offline(False)
    until(lambda: viewer.words("state") != NO_LINK, "the viewer's link")
    viewer.stopped(lambda page: page.page.keyboard.press("Escape"))
    tab.page.context.set_offline(False)
    until(lambda: tab.words("state") != NO_LINK, "the operator's link")
    until_idle(tab)


def test_a_picture_that_came_before_the_link_went_down_is_not_called_live(open_tab):
    tab = open_tab("viewer")
    until(lambda: live_words(tab) == "Live.", "a picture")
    cut_off(tab)
    until(lambda: live_words(tab).startswith("No new picture for "), "its age")
    tab.page.context.set_offline(False)
    until(lambda: live_words(tab) == "Live.", "the next picture")


def live_words(tab) -> str:
    """Under the live picture, whatever was judged before and is shown when it comes."""
    tab.page.locator("#show-live").click()
    return tab.words("camera-words")


SWALLOWS = "() => { openbelief.link.send = () => new Promise((answer) => { window.answerStop = answer; }); }"


BEFORE_A_LINK = """() => {
  const failing = () => Promise.reject(new TypeError("Failed to fetch")), whole = window.fetch;
  window.fetch = (...asked) => (window.cut ? failing() : whole(...asked));
  window.cut = true;
  openbelief.lookStamp = openbelief.look = null;
  openbelief.plan.setSite({objects: [], rooms: [], keep_out: [], allowed: []}, null, null);
  return openbelief.loadSite();
}"""


def test_plan_and_judged_picture_come_when_the_link_comes_back_that_went_down_as_they_were_asked_for(tab):
    tab.ask(ASK)
    tab.until_asked()
    tab.page.locator("#answer-yes").click()
    until_under_way(tab, lambda: tab.state()["mission"]["looks"], "a look")
    finish(tab)  # there will be no other one
    until(lambda: tab.page.evaluate("openbelief.look?.look.frame_stamp_ns === openbelief.lookStamp"), "its picture")
    tab.page.evaluate(BEFORE_A_LINK)
    assert not tab.page.evaluate("Boolean(openbelief.look || openbelief.plan.grid)")
    tab.page.evaluate("() => { window.cut = false; }")
    until(lambda: tab.page.evaluate("Boolean(openbelief.look && openbelief.plan.grid)"), "both")


def test_a_stop_without_an_answer_says_so_before_the_link_is_given_up(open_tab):
    """A network that went away swallows what is sent; nothing tells the page so."""
    tab = open_tab()
    tab.page.evaluate(SWALLOWS)
    tab.page.keyboard.press("Escape")
    until(lambda: tab.words("stop-words") == "NOT HEARD: use the remote", "the remote is named")
    assert tab.words("state") != NO_LINK, "the link still seems to be there"
    tab.page.evaluate("answerStop({ok: true})")
    until(lambda: tab.words("stop-words") == "STOP was heard", "an answer that came late after all")


ROBOT_LOST = """() => {
  const link = "The link to the robot is down.";
  openbelief.link.onState = (state) => { openbelief.state = {...state, robot: {...state.robot, link}}; };
}"""


def test_where_the_robot_cannot_be_reached_the_page_names_the_remote_and_no_stop_as_done(open_tab):
    tab = open_tab(size=PHONE)
    tab.page.evaluate(ROBOT_LOST)
    until(lambda: tab.words("state") == "No link to the robot", "the loss")
    assert tab.words("reason") == "Do not count on STOP: use the remote. The link to the robot is down."
    tab.page.keyboard.press("Escape")
    until(lambda: tab.words("stop-words") == "Heard here: use the remote", "what the console's answer is worth")
    assert tab.page.locator("#stop").get_attribute("data-state") == "lost"


def test_a_page_that_is_refused_says_why_and_tries_again(open_tab):
    tab = open_tab("viewer")
    closed = """() => {
      openbelief.link.socket.onclose({code: 4429});
      openbelief.paint(openbelief.state);
      return document.getElementById("reason").textContent;
    }"""
    assert "Too many pages" in tab.page.evaluate(closed)
    until(lambda: tab.words("state") != NO_LINK, "the next try")


def test_a_pairing_link_opened_in_the_tab_that_asks_for_a_login_logs_it_in(open_tab):
    tab = open_tab()
    tab.may_complain = "401"
    tab.page.evaluate("() => { fetch('/api/logout', {method: 'POST'}); }")
    until(lambda: tab.page.locator("#login-name").is_visible(), "the login")
    assert "You were logged out" in tab.words("login-error")
    tab.page.goto(tab.site.program.link())  # for the browser a place on the page that it shows
    tab.page.locator("#app").wait_for(state="visible", timeout=PATIENCE_S * 1000)
    until(lambda: tab.state().get("n"), "the live page")


def test_a_link_that_was_used_shuts_out_nobody_who_is_logged_in(open_tab):
    tab = open_tab()
    tab.may_complain = "401"
    used = tab.site.program.link()
    for _ in range(2):
        tab.page.goto("about:blank")
        tab.page.goto(used)
        until(lambda: tab.state().get("n"), "the live page, and STOP")


def test_who_does_not_command_is_told_what_there_is_to_do_about_a_question(tab, open_tab):
    viewer, other = open_tab("viewer"), open_tab()
    tab.ask(ASK)
    tab.until_asked()
    until(lambda: "An operator answers" in viewer.words("question-left"), "a viewer is not sent to take over")
    until(lambda: "take over to answer" in other.words("question-left"), "another operator is")
    finish(tab)


def test_enter_without_the_command_is_refused_in_words_and_stop_in_words_is_heard(tab, open_tab):
    other = open_tab()
    other.ask("find the bucket")
    assert "commands the robot now" in other.refused()
    tab.ask(ASK)
    tab.until_asked()
    other.ask("stop the robot")
    until(lambda: other.words("ask-answer") == "STOP was heard.", "its acknowledgement")
    until_idle(tab)


# What the page shows of a mission of which it is made to believe something else.
PANELS = """() => {
  const {mission} = openbelief.state, live = openbelief;
  const shown = (more) => {
    live.paint({...live.state, mission: {...mission, ...more}});
    return document.getElementById("no-candidates").textContent;
  };
  return [shown({candidates: [], outcome: null}), shown({candidates: []})];
}"""


def test_a_mission_that_ended_without_a_candidate_is_not_looking_any_more(tab):
    tab.ask(ASK)
    tab.until_asked()
    finish(tab)
    until(lambda: tab.state()["mission"]["outcome"], "its end on the page")
    assert tab.page.evaluate(PANELS) == ["Looking through the memory …", "None were chosen from."]


RIVALS = """async () => {
  const {mission} = openbelief.state, box = document.getElementById("evidence");
  const words = async (candidates) => {
    await openbelief.evidence.show(candidates[0].object_id, {...mission, candidates});
    return box.querySelector(".rival").textContent;
  };
  const [first, second, ...others] = mission.candidates;
  const left = [first, {...second, number: null, status: "rejected"}, ...others];
  return [second.label, await words(mission.candidates), await words(left)];
}"""


def test_the_runner_up_of_the_evidence_is_one_that_is_still_left(tab):
    tab.ask(ASK)
    tab.until_asked()
    until(lambda: tab.page.locator("#evidence .rival").count(), "the evidence")
    label, before, after = tab.page.evaluate(RIVALS)
    assert f"before {label} with" in before and after != before
    finish(tab)


def test_a_disk_that_was_lost_is_said_in_the_bar(open_tab):
    lost = """() => {
      const {robot} = openbelief.state, silent = {...robot.silent, disk: "the folder cannot be reached"};
      openbelief.paint({...openbelief.state, robot: {...robot, disk_free_bytes: null, silent}});
      const disk = document.getElementById("disk");
      return [disk.textContent, disk.className, disk.title];
    }"""
    assert open_tab("viewer").page.evaluate(lost) == ["lost", "bad", "the folder cannot be reached"]
