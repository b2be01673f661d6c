"""The recorded trials: listed, filtered, scrubbed, noted, exported."""

from __future__ import annotations

import os
import zipfile

import pytest

from tests.browser.conftest import MANY, PHONE, SCREENSHOTS, until
from tests.browser.steps import newest_trial, told_trial, until_idle


def test_two_thousand_trials_are_listed_at_once_and_filtered(open_tab):
    if SCREENSHOTS:
        pytest.skip("the pictures show the trials of the flat")
    tab = open_tab()
    tab.page.locator("#to-trials").click()
    until(lambda: tab.page.locator("a.trial").count() > MANY, "every trial is listed")
    tab.page.locator("#trial-words").fill("number 1234")
    until(lambda: tab.page.locator("a.trial").count() == 1, "one is left")
    assert "find thing number 1234" in tab.page.locator("a.trial").inner_text()
    tab.page.locator("#trial-words").fill("thing")
    tab.page.locator("#trial-outcome").select_option("CONFIRMED")
    until(lambda: tab.page.locator("a.trial").count() == MANY // 2, "the half that was found")
    assert set(tab.page.locator("a.trial .word").all_text_contents()) == {"✓ Found"}


def test_a_trial_is_scrubbed_from_its_file_alone(open_tab, site):
    name = told_trial(site)
    tab = open_tab()
    tab.page.goto(f"{site.program.url}/#trials")
    tab.page.reload()
    until(lambda: tab.page.locator("a.trial").count(), "the list")
    tab.picture("trials")
    tab.page.goto(f"{site.program.url}/#trials/{name}")
    state, slider = tab.page.locator(".one .state"), tab.page.locator("input[type=range]")
    until(lambda: state.count() and state.inner_text() == "Found", "the end")
    until(lambda: "What was judged: confirmed" in tab.page.locator(".one .camera").inner_text(), "what was judged")
    assert "✓ confirmed" in tab.page.locator(".one .checks").inner_text()
    assert painted(tab, ".one .plan canvas") and painted(tab, ".one .camera canvas")
    tab.picture("trial")
    slider.focus()
    tab.page.keyboard.press("Home")
    until(lambda: state.inner_text() != "Found", "the beginning")
    assert tab.page.locator(".one .candidate").count() == 0, "nothing was ranked yet"
    for _ in range(6):
        tab.page.keyboard.press("PageUp")
    until(lambda: tab.page.locator(".one .candidate").count() > 1, "the candidates of then")
    tab.page.locator(".steps button", has_text="checked: ").first.click()
    until(lambda: "rejected" in tab.page.locator(".one .candidates").inner_text(), "the first look's verdict")
    note = f"seen from the page {os.getpid()}"
    tab.page.locator(".notes input").fill(note)
    tab.page.keyboard.press("Enter")
    until(lambda: note in (tab.page.locator(".notes ol").inner_text() or ""), "the note")
    with tab.page.expect_download() as download:
        tab.page.locator("a[download]").click()
    assert download.value.suggested_filename == f"{name.removesuffix('.mcap')}.zip"
    with zipfile.ZipFile(download.value.path()) as archive:
        assert archive.read(name) == (site.folder / name).read_bytes()


SCROLLED = "[...document.querySelectorAll('*')].filter((e) => e.scrollTop && !e.matches('.steps ol')).length"


def test_on_a_phone_the_page_stays_where_it_is_while_its_trial_is_scrubbed(open_tab, site):
    tab = open_tab(size=PHONE)
    tab.page.evaluate("(name) => { location.hash = `trials/${name}`; }", told_trial(site))
    current = tab.page.locator(".steps button[aria-current=step]")
    until(current.count, "its last step")
    last = current.inner_text()
    assert tab.page.evaluate(SCROLLED) == 0, "its head is in sight, and its slider is reached from there"
    tab.page.evaluate("document.querySelector('.steps li button').click()")
    until(lambda: current.inner_text() != last, "the first step")
    in_sight = """() => {
      const list = document.querySelector(".steps ol").getBoundingClientRect();
      const step = document.querySelector(".steps [aria-current=step]").getBoundingClientRect();
      return step.top >= list.top - 1 && step.bottom <= list.bottom + 1;
    }"""
    assert tab.page.evaluate(in_sight) and tab.page.evaluate(SCROLLED) == 0


def test_the_mission_that_ended_is_one_click_from_the_live_page(tab, site):
    tab.ask("find the bucket")
    tab.until_asked()
    tab.page.locator("#answer-no").click()
    until_idle(tab)
    link = tab.page.locator(f"#log a[href$='{newest_trial(site).name}']")
    until(link.count, "the link to it")
    link.click()
    state = tab.page.locator(".one .state")
    until(lambda: state.count() and state.inner_text() == "Stopped", "its end")
    assert newest_trial(site).name in tab.page.url


def painted(tab, selector) -> bool:
    """Whether a canvas shows more than one colour."""
    colours = """(canvas) => new Set(new Uint32Array(
      canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data.buffer)).size"""
    return tab.page.locator(selector).evaluate(colours) > 10
