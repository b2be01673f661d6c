from __future__ import annotations

import base64
import hashlib
import json
import re

from openbelief import ObjectMemory
from robot_app.cli import main


def data_of(page: str) -> dict:
    return json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S).group(1))


def test_the_page_holds_every_object_with_its_evidence(demo_folder, tmp_path):
    memory = demo_folder / "site.belief"
    assert main(["inspect", str(memory), "--html", str(tmp_path / "site.html")]) == 0
    site = data_of((tmp_path / "site.html").read_text())
    opened = ObjectMemory.open(memory)
    assert [o["id"] for o in site["objects"]] == [node.id for node in opened.objects]
    for said, node in zip(site["objects"], opened.objects, strict=True):
        phrases = {p for c in said["concepts"] for p, _ in c["phrases"]}
        assert phrases <= {p for c in node.concepts for p in c.phrases} and said["seen"] == len(node.observations)
        if not node.background:
            assert said["crop"].startswith("data:image/jpeg;base64,") and str(said["view"]) in site["pictures"]
    assert site["floors"][0]["walls"]["src"].startswith("data:image/png") and site["floors"][0]["walks"]


def test_the_page_loads_nothing_and_runs_only_its_own_script(demo_folder, tmp_path):
    assert main(["inspect", str(demo_folder / "site.belief"), "--html", str(tmp_path / "site.html")]) == 0
    page = (tmp_path / "site.html").read_text()
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page).group(1)
    assert policy.startswith("default-src 'none'; img-src data:;") and "unsafe" not in policy
    for element, directive in (("style", "style-src"), ("script", "script-src")):
        (content,) = re.findall(rf"<{element}>(.*?)</{element}>", page, re.S)
        digest = base64.b64encode(hashlib.sha256(content.encode()).digest()).decode()
        assert f"{directive} 'sha256-{digest}'" in policy
    assert not re.search(r"""(src|href)\s*=\s*["']?(https?:)?//""", page) and "style=" not in page


def test_words_of_models_and_people_are_no_markup(hostile, tmp_path):
    assert main(["inspect", str(hostile), "--html", str(tmp_path / "site.html")]) == 0
    page = (tmp_path / "site.html").read_text()
    assert "<script>alert" not in page and "<img src=x" not in page and "<b>hall" not in page
    assert "Map its recordings again to get them.</p>" in page, "what the file lacks is said to its end"
    site = data_of(page)
    assert site["objects"][0]["room"] == "<b>hall</b>" and "alert" in site["objects"][0]["label"]
    assert site["objects"][0]["crop"] is None  # what was kept is no picture


def test_a_page_that_cannot_be_written_is_one_line(demo_folder, tmp_path, capsys):
    assert main(["inspect", str(demo_folder / "site.belief"), "--html", str(tmp_path / "no" / "site.html")]) == 1
    assert "does not exist" in capsys.readouterr().err
