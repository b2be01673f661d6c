"""docs/robot.md: its configurations load, its commands exist, its links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from robot_app.certs.zenoh import ZenohNetwork
from robot_app.cli import VERBS
from robot_app.config import load_config
from robot_app.config_sections import mount

DOCS = Path(__file__).resolve().parents[2] / "docs"
PAGE = (DOCS / "robot.md").read_text()
TOMLS = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.DOTALL)


@pytest.mark.parametrize("text", TOMLS)
def test_every_configuration_on_the_page_is_accepted(text, tmp_path):
    (tmp_path / "robot.toml").write_text(text)
    config = load_config(tmp_path / "robot.toml")
    assert all(mount(said) for said in config.onboard.mounts)


def test_the_page_has_the_workstations_the_rehearsals_and_the_mounts_configuration():
    assert len(TOMLS) == 3


def test_every_verb_on_the_page_exists():
    said = set(re.findall(r"^ {4}openbelief (\S+)", PAGE, flags=re.MULTILINE))
    assert said >= {"certs", "onboard", "doctor", "record", "map", "run", "ask", "replay"} and said <= set(VERBS)


def test_every_page_it_links_to_is_there():
    links = re.findall(r"\]\((\w+\.md)\)", PAGE)
    assert links and all((DOCS / link).is_file() for link in links)


def test_the_workstations_endpoint_is_the_one_that_certs_writes():
    assert f'endpoint = "{ZenohNetwork("192.168.123.164").endpoint}"' in PAGE
