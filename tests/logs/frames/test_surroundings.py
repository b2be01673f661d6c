"""Where the robot can stand, from a recording that holds no navigation map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivers.clock import SimClock
from logs.frames.reasons import RecordingError
from logs.frames.surroundings import grid_from_what_was_seen
from openbelief.traversability import FREE, OCCUPIED
from sim_fakes.playback.ports import RecordingPorts

KITCHEN = Path(__file__).resolve().parents[3].parent / "shared" / "recordings" / "kitchen.mcap"


@pytest.mark.recordings
def test_a_real_recording_without_a_map_gets_one_from_its_depth_and_the_table_is_in_the_way():
    if not KITCHEN.exists():
        pytest.skip(f"{KITCHEN.name} is not beside the checkout")
    grid = RecordingPorts(KITCHEN).map(SimClock(0)).latest()
    table_xy = np.array([1.84, 0.59])  # kitchen.truth.json: a mug stands on it there
    assert grid.at(table_xy) == OCCUPIED
    assert (grid.cells == FREE).sum() * grid.resolution_m**2 > 1.0


def test_a_recording_that_saw_nothing_is_refused_by_name(make_walk, tmp_path):
    walk = make_walk(2)
    walk.messages = [message for message in walk.messages if "depth" not in message[0]]
    with pytest.raises(RecordingError, match="holds no depth topic"):
        grid_from_what_was_seen(walk.write(tmp_path / "blind.mcap"))
