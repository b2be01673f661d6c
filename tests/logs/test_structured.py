"""The application's log: ids on every line, one line per event, nothing a terminal would obey."""

from __future__ import annotations

import io
import json
import logging

import pytest
import structlog

from logs.structured import configure, logger, neutralise, trial_context
from support.clocks import HandClock

FORGERY = 'lamp\x1b[2J\r\n{"event": "goal_reached"}\u202e\x9b\u2028'


@pytest.fixture(autouse=True)
def _unconfigured() -> object:
    yield
    structlog.reset_defaults()


def logged(*, json_lines: bool) -> tuple[io.StringIO, object]:
    stream = io.StringIO()
    configure(HandClock(1_700_000_000_250_000_000), stream, json_lines=json_lines)
    return stream, logger()


def test_every_line_in_a_trial_carries_its_ids() -> None:
    stream, log = logged(json_lines=True)
    with trial_context(trial_id="t1"):
        with trial_context(query_id="q2"):
            log.info("goal_sent", object_id=7)
        log.info("between")
    log.warning("after")
    first, second, third = (json.loads(line) for line in stream.getvalue().splitlines())
    assert (first["trial_id"], first["query_id"], first["object_id"]) == ("t1", "q2", 7)
    assert second["trial_id"] == "t1" and "query_id" not in second
    assert "trial_id" not in third and third["level"] == "warning"
    assert (first["stamp_ns"], first["time"]) == (1_700_000_000_250_000_000, "2023-11-14T22:13:20.250+00:00")


@pytest.mark.parametrize("json_lines", [True, False])
def test_operator_text_cannot_forge_a_line_or_move_the_cursor(json_lines: bool) -> None:
    stream, log = logged(json_lines=json_lines)
    log.info("asked", text=FORGERY, nested={FORGERY: [FORGERY]}, thing=object)
    text = stream.getvalue()
    assert text.count("\n") == 1
    for character in ("\r", "\x9b", "\u202e", "\u2028", "\x1b[2J"):
        assert character not in text
    if json_lines:
        assert json.loads(text)["text"] == neutralise(FORGERY)


def test_words_of_any_language_stay_as_they_are() -> None:
    assert neutralise("ein Stuhl für Zoë, 椅子, كرسي") == "ein Stuhl für Zoë, 椅子, كرسي"


def test_an_exception_is_logged_with_its_traceback() -> None:
    stream, log = logged(json_lines=True)
    try:
        raise ValueError("bad \x1b[0m scan")
    except ValueError:
        log.exception("failed")
    [line] = stream.getvalue().splitlines()
    trace = json.loads(line)["exception"]
    assert "ValueError: bad \\x1b[0m scan" in trace and "\n" in trace


def test_what_drivers_log_through_the_standard_library_has_the_same_form():
    stream = io.StringIO()
    configure(HandClock(1_700_000_000_250_000_000), stream, json_lines=True)
    logging.getLogger("drivers.ros.zenoh_link").warning("payload on %s\x1b[2J dropped", "/tf")
    [line] = [json.loads(each) for each in stream.getvalue().splitlines()]
    assert line["event"] == "payload on /tf\\x1b[2J dropped" and line["level"] == "warning"
    assert line["source"] == "drivers.ros.zenoh_link" and line["stamp_ns"] == 1_700_000_000_250_000_000
