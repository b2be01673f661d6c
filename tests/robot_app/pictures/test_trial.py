"""The pictures of a trial say what the checks said, and can be read."""

from __future__ import annotations

import itertools
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import same_color
from matplotlib.figure import Figure

from drivers.ports import CameraFrame
from logs.trial import records
from logs.trial.reader import TrialReader
from openbelief import ObjectMemory, Observation
from openbelief.observation import Intrinsics
from robot_app.cli import main
from robot_app.pictures.arrival import CHECKS, arrival_views, stored_place
from robot_app.pictures.style import CONFIRMED, PLACE, REJECTED, spread

CAMERA = Intrinsics(160, 120, 120.0, 120.0, 79.5, 59.5)


@pytest.fixture(scope="module")
def trial(demo_folder, tmp_path_factory) -> TrialReader:
    """Asked with the paper's readout, whose first candidate is wrong here: one look rejects, one confirms."""
    folder = Path(shutil.copytree(demo_folder, tmp_path_factory.mktemp("paper") / "site"))
    config, path = folder / "robot.toml", folder / "paper.mcap"
    config.write_text(config.read_text().replace('readout = "grounded"', 'readout = "consensus"'))
    asked = ["ask", "take me to the fire extinguisher", "--yes", "--config", str(config), "--trial", str(path)]
    assert main(asked) == 0
    return TrialReader(path).whole()


@pytest.fixture(scope="module")
def memory(demo_folder) -> ObjectMemory:
    return ObjectMemory.open(demo_folder / "site.belief")


def outlines(figure: Figure) -> set[str]:
    """Which of the colours that mean something outline something in the camera's picture."""
    drawn = [line.get_edgecolor() for line in figure.axes[0].collections]
    return {colour for colour in (CONFIRMED, REJECTED, PLACE) if any(same_color(each, [colour]) for each in drawn)}


def test_the_judged_mask_has_the_colour_of_its_verdict_beside_the_remembered_place(trial, memory):
    checks = [record for record in trial.decisions if isinstance(record, records.Checks)]
    views = list(arrival_views(trial.entries, memory))
    assert {c.verdict == "confirmed" for c in checks} == {True, False} and len(views) == len(checks)
    for each, view in zip(checks, views, strict=True):
        judged = {CONFIRMED if each.verdict == "confirmed" else REJECTED} if each.mask_index is not None else set()
        assert outlines(view) == judged | {PLACE}


def test_no_label_hides_another_or_leaves_the_picture(trial, memory):
    for view in arrival_views(trial.entries, memory):
        view.draw_without_rendering()
        axes = view.axes[0]
        page = axes.get_window_extent()
        boxes = [text.get_bbox_patch().get_window_extent() for text in axes.texts]
        assert all(page.contains(*corner) for box in boxes for corner in (box.min, box.max))
        assert not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))


@pytest.mark.parametrize("drop", [True, False])
def test_labels_of_one_corner_are_spread_or_dropped_the_first_stays(drop):
    axes = Figure(figsize=(4, 3)).add_subplot()
    labels = [axes.text(1.0, 1.0, f"a long label {k}", bbox={"boxstyle": "round"}) for k in range(30)]
    spread(axes, labels, drop=drop)
    axes.figure.draw_without_rendering()
    page, boxes = axes.get_window_extent(), [t.get_bbox_patch().get_window_extent() for t in axes.texts]
    assert all(page.contains(*corner) for box in boxes for corner in (box.min, box.max))
    assert axes.texts[0] is labels[0] and (len(axes.texts) < 30) == drop
    apart = not any(one.overlaps(other) for one, other in itertools.combinations(boxes, 2))
    assert apart == drop


@pytest.mark.parametrize(("value", "passing"), [(0.44, set()), (0.45, {"visibility", "geometric"}), (0.46, None)])
def test_a_bar_is_green_exactly_where_its_check_passes(value, passing):
    """At the threshold itself visibility and place pass, likeness does not: as openbelief.verification decides."""
    green = {name for name, _, _, passes in CHECKS if passes(value, 0.45)}
    assert green == ({name for name, *_ in CHECKS} if passing is None else passing)


def node_at(z: float):
    """A block 0.3 m wide on the axis of a camera that looks along the map's z."""
    grid = np.stack(np.meshgrid(*[np.arange(-0.15, 0.15, 0.02)] * 2, [z]), axis=-1).reshape(-1, 3)
    view = Observation(0, 0, None, 0.9, grid, np.eye(2)[0])
    encoder = type("None", (), {"id": "none", "dim": 2})()
    return ObjectMemory.build([view], encoder).objects[0]


def test_the_remembered_place_is_where_its_points_are_in_the_picture():
    frame = CameraFrame(0, np.zeros((120, 160, 3), np.uint8), np.ones((120, 160), np.float32), CAMERA, "camera")
    rows, columns = np.nonzero(stored_place(node_at(1.5), frame, np.eye(4)))
    assert (rows.mean(), columns.mean()) == pytest.approx((59, 79), abs=3)
    assert np.ptp(columns) == pytest.approx(120 * 0.3 / 1.5, abs=8) and len(rows) > 0.8 * np.ptp(columns) * np.ptp(rows)
    assert not stored_place(node_at(-1.5), frame, np.eye(4)).any()
    assert not stored_place(node_at(1.5), frame, None).any()


def test_a_dollar_in_what_a_model_said_is_a_dollar_and_no_formula(trial, memory):
    entries = [
        replace(entry, record=with_phrase(entry.record, "$\\frac{$ 5 $"))
        if isinstance(entry.record, records.Segments)
        else entry
        for entry in trial.entries
    ]
    for view in arrival_views(entries, memory):
        view.draw_without_rendering()
        assert any("\\frac" in text.get_text() for text in view.axes[0].texts)


def with_phrase(segments: records.Segments, phrase: str) -> records.Segments:
    masks = tuple(mask.model_copy(update={"phrase": phrase}) for mask in segments.masks)
    return segments.model_copy(update={"masks": masks})
