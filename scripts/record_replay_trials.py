"""Record the trials of tests/replay again, each with its expected decisions: `python scripts/record_replay_trials.py`.

Names of rows after it: only those. Do this for a new row, or where a decision is meant to change; look at the diff of
the JSON before you commit it.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

FOLDER = Path("tests/replay")
WORK = Path("build/replay")
SCENE = "tests/robot_app/small_scene.json"
# name -> what the demo is asked, and its seed
ROWS = {"small_room": ("take me to the fire extinguisher", 1)}


def record(name: str, query: str, seed: int) -> None:
    """Paths stay relative to the repository: a trial keeps its configuration's text."""
    from robot_app.demo.demo import run_demo
    from robot_app.progress_lines import LineProgress

    demo = run_demo(WORK, query, SCENE, seed, LineProgress(), print)
    shutil.copyfile(demo.paths["trial"], FOLDER / f"{name}.mcap")
    (FOLDER / f"{name}.json").write_text(json.dumps(expected(FOLDER / f"{name}.mcap"), indent=1) + "\n")


def expected(path: Path) -> dict[str, Any]:
    """What the trial says was decided."""
    from logs.trial.reader import TrialReader

    trial = TrialReader(path).whole()
    return {
        "query": trial.query.sentence,
        "decisions": [{"topic": record.topic, **record.model_dump(mode="json")} for record in trial.decisions],
    }


def main(names: list[str]) -> None:
    os.chdir(ROOT)
    for name in names or ROWS:
        record(name, *ROWS[name])


if __name__ == "__main__":
    main(sys.argv[1:])
