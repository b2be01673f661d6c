"""A person at the page asks, approves, declines, picks another one by hand, and wants to know why."""

from __future__ import annotations

import re

import pytest

from logs.trial.reader import TrialReader
from logs.trial.records import OperatorReply
from tests.browser.conftest import DESKTOP, PHONE, until
from tests.browser.steps import ASK, newest_trial, until_idle, until_under_way


@pytest.mark.parametrize(("name", "size"), [("desktop", DESKTOP), ("phone", PHONE)])
def test_the_first_candidate_is_rejected_and_the_second_confirmed(open_tab, name, size):
    tab = open_tab(size=size)
    tab.picture(f"{name}-ready")
    tab.take()
    tab.ask(ASK)
    tab.until_asked()
    assert "Go to #1" in tab.words("answer-yes") and "s left" in tab.words("question-left")
    if name == "phone":
        tab.page.locator("#tab-plan").click()
    tab.picture(f"{name}-question")
    tab.page.locator("#answer-yes").click()
    until_under_way(
        tab, lambda: tab.words("state") in ("Walking", "Looking", "Looking again"), "the robot is under way"
    )
    tab.picture(f"{name}-walking")
    until_under_way(tab, lambda: rejected(tab) and asked(tab), "the first candidate is rejected, the second asked for")
    tab.until_asked()
    if name == "phone":
        tab.page.locator("#tab-candidates").click()
    tab.picture(f"{name}-rejected")
    tab.page.locator("#answer-yes").click()
    until_under_way(tab, lambda: tab.words("state") == "Found", "the second is found")
    if name == "phone":
        tab.page.locator("#tab-camera").click()
    tab.picture(f"{name}-found")
    mission = tab.state()["mission"]
    verdicts: dict[int, list[str]] = {}
    for look in mission["looks"]:
        verdicts.setdefault(look["object_id"], []).append(look["verdict"])
    first, second = verdicts.values()
    assert "confirmed" not in first and second[-1] == "confirmed"
    assert {reply["who"] for reply in mission["replies"]} == {"operator"} and mission["how"] == "console"


PAINTED = """(doubt) => {
  const {question, state} = window.openbelief, asked = state.operator.question;
  question.open({...asked, doubt, sentence: (doubt ? `I am not sure: ${doubt}. ` : "") + asked.sentence}, []);
  return ["question-doubt", "question-words"].map((id) => document.getElementById(id).innerText);
}"""


def test_a_doubt_stands_before_the_question_and_not_twice(tab):
    tab.ask(ASK)
    tab.until_asked()
    sentence = asked(tab)["sentence"]
    assert asked(tab)["doubt"] == "" and tab.page.locator("#question-doubt").is_hidden()
    doubt = "what fits best was called <b>gray</b>, never red"
    assert tab.page.evaluate(PAINTED, doubt) == [f"I am not sure: {doubt}. ", sentence]
    assert tab.page.evaluate(PAINTED, "") == ["", sentence]
    tab.page.locator("#answer-no").click()
    until_idle(tab)


def test_why_not_this_one_another_one_and_leaving_one_out_are_clicks(tab):
    tab.ask(ASK)
    tab.until_asked()
    first = asked(tab)
    tab.page.locator("#answer-why").click()
    assert tab.words("question-why") == first["because"] and asked(tab) == first, "the question stays open"
    tab.page.locator("#answer-other").click()
    second = next_question(tab, first)
    assert second["object_id"] != first["object_id"] and "declined by you" in row(tab, first["object_id"])

    wanted = second["options"][1]
    button(tab, f"Take candidate {wanted['number']}").click()
    third = next_question(tab, second)
    assert third["object_id"] == wanted["object_id"]

    unwanted = next(each for each in third["options"] if each["object_id"] != third["object_id"])
    button(tab, f"Leave out candidate {unwanted['number']}").click()
    fourth = next_question(tab, third)
    assert fourth["object_id"] == third["object_id"] and "declined by you" in row(tab, unwanted["object_id"])
    tab.page.locator("#answer-no").click()
    until_idle(tab)

    replies = [record for record in records(tab) if isinstance(record, OperatorReply)]
    assert [each.reply for each in replies] == ["not this one", "take", "not this one", "no"]
    assert {(each.who, each.how) for each in replies} == {("operator", "console")}
    assert tab.state()["mission"]["outcome"]["end"] == "CANCELLED"


def test_an_object_on_the_plan_shows_its_evidence(tab):
    x, y, label = tab.page.evaluate(
        "(({plan}) => {const o = plan.site.objects.find((e) => e.label === 'armchair') || plan.site.objects[0];"
        " const r = plan.canvas.width / plan.canvas.clientWidth;"
        " return [...plan.at(o.centroid[0], o.centroid[1]).map((v) => v / r), o.label];})(window.openbelief)"
    )
    tab.page.locator("#plan").click(position={"x": x, "y": y})
    until(lambda: label in tab.words("evidence") and "Seen" in tab.words("evidence"), "its evidence")


def rejected(tab):
    return [each for each in tab.state()["mission"]["candidates"] if each["status"] in ("rejected", "no matching mask")]


def asked(tab):
    """The open question, without what runs down."""
    question = tab.state()["operator"]["question"]
    return question and {key: value for key, value in question.items() if key != "left_s"}


def next_question(tab, before):
    until(lambda: (now := asked(tab)) and now["id"] > before["id"], "the next question")
    tab.until_asked()
    return asked(tab)


def row(tab, object_id):
    """What the page says of that candidate."""
    label = next(each["label"] for each in tab.state()["mission"]["candidates"] if each["object_id"] == object_id)
    rows = tab.page.locator("#candidates .candidate[data-status=declined]", has_text=label)
    until(rows.count, f"{label} is declined")
    return rows.first.inner_text()


def button(tab, name):
    return tab.page.get_by_role("button", name=re.compile(f"^{name}, "))


def records(tab):
    return [entry.record for entry in TrialReader(newest_trial(tab.site)).entries]
