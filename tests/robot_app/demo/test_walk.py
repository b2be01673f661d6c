"""The demo's walk knows from its first picture how many there will be."""

from __future__ import annotations

from pathlib import Path

from robot_app.config import Config
from robot_app.config_sections import PortsSection, SimSection
from robot_app.demo.walk import record_walk

SMALL = Path(__file__).parents[1] / "small_scene.json"


def test_the_walks_progress_knows_its_total_and_its_end(tmp_path: Path) -> None:
    ports = PortsSection(camera="sim", lidar="sim", pose="sim", map="sim", navigator="sim")
    config = Config(ports=ports, sim=SimSection(scene=str(SMALL)))
    told: list[tuple[int, int]] = []
    frames = record_walk(config, tmp_path / "walk.mcap", lambda done, total: told.append((done, total)))
    assert frames > 5 and told == [(done, frames) for done in [*range(1, frames + 1), frames]]
