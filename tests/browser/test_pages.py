"""The pages that `inspect --html` and `why --html` write, opened from the disk as a person opens them."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np
import pytest
from playwright.sync_api import Browser, BrowserContext, Page

from openbelief import ObjectMemory, Observation
from openbelief.observation import Provenance
from openbelief.perception.sentence import SentenceEncoder
from openbelief.rooms import Room
from robot_app.cli import main
from tests.browser.conftest import DESKTOP, MANY, PHONE, SMALL, until

HOSTILE = "</script><img src=x onerror=window.owned=2>"
ROWS_SHOWN = 200
SPILT = """() => [...document.querySelectorAll("body *")].filter((e) => !e.closest(".scroll, svg, ol")
  && e.getBoundingClientRect().right > document.documentElement.clientWidth + 1).map((e) => e.outerHTML.slice(0, 80))"""
SQUEEZED = """() => [...document.querySelectorAll("td, th")].filter((e) => {
  const range = document.createRange(); range.selectNodeContents(e);
  const longest = Math.max(0, ...e.textContent.split(/\\s+/).map((w) => w.length));
  return longest > 3 && longest < 12 && range.getClientRects().length > 3 * e.textContent.split(/\\s+/).length;
}).map((e) => e.textContent)"""
TYPED = """(words) => {
  const ask = document.getElementById("ask"), began = performance.now();
  ask.value = words; ask.dispatchEvent(new Event("input")); document.body.getBoundingClientRect();
  return performance.now() - began;
}"""


@dataclass
class Opened:
    page: Page
    complaints: list[str] = field(default_factory=list)
    requests: list[str] = field(default_factory=list)

    def search(self, words: str) -> int:
        """How many objects the list says match."""
        self.page.locator("#ask").fill(words)
        return int(self.page.locator("#count").inner_text().split()[0])


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Callable[..., Opened]]:
    contexts: list[BrowserContext] = []

    def opened(path: Path, size: dict[str, int] = DESKTOP, theme: str = "light") -> Opened:
        context = browser.new_context(viewport=size, color_scheme=theme)
        contexts.append(context)
        made = Opened(context.new_page())
        made.page.on("console", lambda m: made.complaints.append(m.text))
        made.page.on("pageerror", lambda error: made.complaints.append(str(error)))
        made.page.on("request", lambda request: made.requests.append(request.url))
        made.page.goto(path.as_uri())
        return made

    yield opened
    for context in contexts:
        context.close()


@pytest.fixture(scope="module")
def memory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the small room, walked through in simulation."""
    folder = tmp_path_factory.mktemp("pages") / "demo-out"
    assert main(["demo", "--scene", str(SMALL), "--out", str(folder), "--json"]) == 0
    return folder / "site.belief"


@pytest.fixture(scope="module")
def site_page(memory: Path) -> Path:
    path = memory.with_name("site.html")
    assert main(["inspect", str(memory), "--html", str(path)]) == 0
    return path


@pytest.fixture(scope="module")
def many(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of a site of 2 000 objects in 20 rooms, each with its crop; one phrase and one room are markup."""
    folder = tmp_path_factory.mktemp("many")
    rng, encoder = np.random.default_rng(0), SentenceEncoder()
    block = (np.stack(np.meshgrid(*[np.arange(6)] * 3), axis=-1).reshape(-1, 3) + 0.5) * 0.02
    words = [f"{colour} {thing}" for colour in ("red", "blue", "green", "old") for thing in ("chair", "lamp", "box")]
    features = encoder.encode(words)
    seen = []
    for k in range(MANY):
        picture = np.full((90, 120, 3), rng.integers(40, 220, 3), np.uint8)
        jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
        source = Provenance("walk", k, (10, 10, 110, 80), {"size": [480, 640], "counts": [640 * 480]}, jpeg)
        points = (block + np.array([k % 50, k // 50, 0.4])).astype(np.float32)
        phrase = HOSTILE if k == 7 else words[k % len(words)]
        seen.append(Observation(k, 0, phrase, 0.8, points, features[k % len(words)], source))
    square = 10.0 * np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) - 0.5
    names = ["<script>window.owned=1</script>", *(f"hall {k}" for k in range(1, 20))]
    rooms = [Room(name, square + 10.0 * np.array([k % 5, k // 5])) for k, name in enumerate(names)]
    ObjectMemory.build(seen, encoder, rooms=rooms).save(folder / "site.belief")
    assert main(["inspect", str(folder / "site.belief"), "--html", str(folder / "site.html")]) == 0
    return folder / "site.html"


def test_the_site_is_searched_and_shows_the_evidence_of_what_is_clicked(
    open_page: Callable[..., Opened], site_page: Path
) -> None:
    opened = open_page(site_page)
    assert opened.search("armchair") >= 1 and opened.search("armchair nowhere") == 0
    opened.search("armchair")
    opened.page.locator("#list button.row").first.click()
    detail = opened.page.locator("#detail")
    assert "armchair" in detail.locator("h2").inner_text() and "observations in" in detail.inner_text()
    assert detail.locator("tr.concept").count() >= 1 and detail.locator("tr.phrase").count() >= 1
    widths = detail.locator("img").evaluate_all("images => images.map((i) => i.complete && i.naturalWidth)")
    assert len(widths) == 2 and all(width > 100 for width in widths)  # the crop with its mask, and the best view
    assert detail.locator("svg.over rect").count() == 1


def test_the_plan_answers_a_click_on_a_thing_and_on_a_room(open_page: Callable[..., Opened], site_page: Path) -> None:
    opened = open_page(site_page)
    said = json.loads(opened.page.locator("#data").inner_text() or opened.page.locator("#data").text_content() or "")
    room = said["floors"][0]["rooms"][0]
    opened.page.locator("#plan .room").first.dispatch_event("click")
    detail = opened.page.locator("#detail")
    assert detail.locator("h2").inner_text() == room["name"] and room["because"] in detail.inner_text()
    opened.page.locator("#plan .thing").first.dispatch_event("click")
    assert "(object" in detail.locator("h2").inner_text() and opened.page.locator("#plan .chosen").count() == 1


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_both_pages_fit_their_screen_load_nothing_and_complain_of_nothing(
    open_page: Callable[..., Opened], site_page: Path, memory: Path, size: dict[str, int], theme: str
) -> None:
    why = memory.with_name("why.html")
    assert main(["why", str(memory), "0", "--html", str(why)]) == 0
    for path in (site_page, why):
        opened = open_page(path, size, theme)
        assert opened.page.evaluate(SPILT) == [] and opened.page.evaluate(SQUEEZED) == []
        assert opened.complaints == []
        assert [url for url in opened.requests if not url.startswith("data:")] == [path.as_uri()]


def test_markup_in_words_of_models_and_people_stays_words(open_page: Callable[..., Opened], many: Path) -> None:
    opened = open_page(many)
    assert opened.search("window.owned=2") == 1
    opened.page.locator("#list button.row").first.click()
    assert "<img src=x onerror" in opened.page.locator("#detail").inner_text()
    opened.page.locator("#plan .room").first.dispatch_event("click")
    assert "<script>" in opened.page.locator("#detail h2").inner_text()
    assert opened.page.evaluate("window.owned") is None and opened.page.locator("img[src=x]").count() == 0
    why = many.with_name("why.html")
    assert main(["why", str(many.with_name("site.belief")), "7", "--html", str(why)]) == 0
    told = open_page(why)
    assert "<img src=x onerror" in told.page.locator("h1").inner_text()
    assert told.page.evaluate("window.owned") is None and opened.complaints == told.complaints == []


def test_two_thousand_objects_are_drawn_once_and_searched_as_one_types(
    open_page: Callable[..., Opened], many: Path
) -> None:
    """What it takes is printed (-s), and nobody's test: it depends on the machine."""
    began = time.perf_counter()
    opened = open_page(many)
    until(lambda: opened.page.locator("#plan .thing").count() == MANY, "every object on the plan")
    opened_s = time.perf_counter() - began
    assert opened.search("") == MANY
    assert opened.page.locator("#list button.row").count() == ROWS_SHOWN  # not more rows than a person reads
    took_ms = [opened.page.evaluate(TYPED, words) for words in ("c", "ch", "chair", "red chair", "red chair hall 3")]
    assert 0 < opened.search("red chair hall 3") < opened.search("red chair") < MANY
    assert opened.page.locator("#plan .match").count() == opened.search("red chair")
    nodes = opened.page.evaluate("document.querySelectorAll('*').length")
    assert nodes < 4 * MANY
    print(
        f"{MANY} objects: {many.stat().st_size / 1e6:.1f} MB, {nodes} DOM nodes, on the plan after {opened_s:.2f} s, "
        f"a key {np.median(took_ms):.0f} ms (most {max(took_ms):.0f} ms)"
    )
