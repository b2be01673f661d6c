"""What a language-model agent proposes is named as an agent's on the page, and only a person's click is its yes."""

from __future__ import annotations

import asyncio
import math
from concurrent.futures import ThreadPoolExecutor

import pytest

pytest.importorskip("mcp", reason="the extra `agent` is not installed (requirements/agent.txt)")

from drivers.ros.zenoh_link import ZenohLink
from logs.trial.reader import TrialReader
from robot_app.config import load_config
from robot_app.mission.lease import Refused
from robot_app.remote import messages as m
from robot_app.remote.client import RemoteClient
from robot_app.remote.service import link_config
from tests.browser.steps import newest_trial, robot_at, until_idle
from tests.robot_app.agents.test_mcp import proposes

NAMED = "The agent helper asks, not a person."


def guesses_yes(site, question: dict) -> str:
    """How the answer of a program without the lease is refused."""
    config = load_config(site.config)
    yes = m.ConfirmRequest(
        token="guessed", epoch=1, question=question["id"], memory_hash=question["memory_hash"], word="yes"
    )
    with ZenohLink(link_config(config)) as link, pytest.raises(Refused) as refused:
        RemoteClient(link).send(yes)
    return str(refused.value)


def test_an_agents_mission_waits_for_a_click_on_the_page_and_is_confirmed_in_its_name(tab, site):
    with ThreadPoolExecutor(1) as beside:
        ended = beside.submit(asyncio.run, proposes(site.config))
        tab.until_asked()
        start = robot_at(tab)
        assert tab.words("question-words").startswith(NAMED)
        assert "operator (console) commands" in guesses_yes(site, tab.state()["operator"]["question"])
        assert tab.page.locator("#answer-yes").is_enabled() and math.dist(start, robot_at(tab)) < 0.05
        tab.page.locator("#answer-yes").click()
        outcome = ended.result()["outcome"]
    assert outcome["end"] == "CONFIRMED", outcome
    until_idle(tab)  # then its trial is written
    trial = TrialReader(newest_trial(site))
    assert (trial.query.who, trial.query.how) == ("helper", "agent")
    [reply] = [record for record in trial.records if record.topic == "/trial/operator_reply"]
    assert (reply.reply, reply.who, reply.how) == ("yes", "operator", "console")
