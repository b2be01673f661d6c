"""The import contracts name packages, so that a module that is added tomorrow is held by them without being named."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("openbelief", "drivers", "logs", "behaviors", "sim_fakes", "robot_app")

# new module -> what it must not import
ESCAPES = {
    "openbelief/new_idea.py": "from openbelief.perception.clip import Clip",
    "openbelief/new_room/idea.py": "from openbelief.perception.clip import Clip",
    "drivers/new_thing/driver.py": "import zenoh",
    "drivers/realsense/new_thing.py": "import pyrealsense2",
    "behaviors/new_room/thing.py": "from drivers.clock import SystemClock",
    "logs/new_room/thing.py": "from behaviors.mission import Mission",
    "robot_app/new_room/thing.py": "import zenoh",
}


def lint(house: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command; lint_imports_command()"]
    environment = {**os.environ, "PYTHONPATH": str(house)}
    return subprocess.run([*command, "--no-cache"], cwd=house, env=environment, capture_output=True, text=True)


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the packages and their contracts."""
    folder = tmp_path_factory.mktemp("house")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__", "*.obj"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


def test_the_house_keeps_its_contracts(house: Path) -> None:
    result = lint(house)
    assert result.returncode == 0, result.stdout


@pytest.mark.parametrize("module", ESCAPES)
def test_a_new_module_cannot_escape_them(house: Path, module: str) -> None:
    path = house / module
    made = [folder for folder in path.parents if not folder.exists()]
    path.parent.mkdir(parents=True, exist_ok=True)
    for folder in made:
        (folder / "__init__.py").touch()
    path.write_text(ESCAPES[module] + "\n")
    try:
        result = lint(house)
        assert result.returncode != 0, f"{module} was not noticed"
        assert "BROKEN" in result.stdout
    finally:
        path.unlink()
        for folder in made:
            shutil.rmtree(folder)
