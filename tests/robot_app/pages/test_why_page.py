from __future__ import annotations

import json
import re

import pytest

from openbelief import ObjectMemory
from robot_app.cli import main


@pytest.fixture(scope="module")
def memory(demo_folder):
    return demo_folder / "site.belief"


def an_object(memory):
    nodes = [node for node in ObjectMemory.open(memory).objects if not node.background]
    return max(nodes, key=lambda node: len(node.concepts))


def test_the_page_tells_concepts_looks_best_view_place_and_neighbours(memory, tmp_path, capsys):
    node = an_object(memory)
    page_file = tmp_path / "why.html"
    assert main(["why", str(memory), str(node.id), "--html", str(page_file), "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    page = page_file.read_text()
    assert report["html"] == str(page_file)
    headings = ("What it may be", "Early commitment", "Best view", "Where it stands", "What stands near", "Every look")
    assert all(f"<h2>{heading}" in page for heading in headings)
    for concept in report["concepts"]:
        assert f"{concept['belief']:.3f}" in page
    for look in report["observations"]:
        assert str(look["stamp_ns"]) in page and f"{look['weight']:.1f}" in page
    assert page.count('alt="crop with its mask"') == len(report["observations"]) and 'alt="best view"' in page
    assert 'class="thing chosen"' in page


def test_early_commitment_is_told_with_what_it_throws_away(memory, tmp_path):
    node = an_object(memory)
    assert main(["why", str(memory), str(node.id), "--html", str(tmp_path / "why.html")]) == 0
    page = (tmp_path / "why.html").read_text()
    lost = 1 - node.concepts[0].support / sum(c.support for c in node.concepts)
    assert f"thrown away {len(node.concepts) - 1} other concepts: {lost:.0%} of the support" in page
    assert page.count("<tr class=thrown>") == len(node.concepts) - 1


def test_the_page_runs_nothing_and_loads_nothing(memory, tmp_path):
    assert main(["why", str(memory), "0", "--html", str(tmp_path / "why.html")]) == 0
    page = (tmp_path / "why.html").read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
    assert policy.startswith("default-src 'none'") and "script-src" not in policy and "<script" not in page


def test_words_of_models_and_people_are_no_markup(hostile, tmp_path):
    assert main(["why", str(hostile), "0", "--html", str(tmp_path / "why.html")]) == 0
    page = (tmp_path / "why.html").read_text()
    assert "<script" not in page and "<img src=x" not in page and "<b>hall" not in page
    assert "&lt;script&gt;" in page and "No crops were kept" in page and "from before they were kept" in page


def test_a_page_that_cannot_be_written_is_one_line(memory, tmp_path, capsys):
    assert main(["why", str(memory), "0", "--html", str(tmp_path)]) == 1
    assert "is a folder" in capsys.readouterr().err
