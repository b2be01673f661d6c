"""What a memory is: it follows from its evidence, whatever the order, and nothing in it can be changed."""

from __future__ import annotations

import dataclasses
import random

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.rooms import Room

READOUTS = ("consensus", "early", "belief")


def test_objects_are_numbered_by_their_smallest_recording_frame_and_mask(memory):
    assert [node.id for node in memory.objects] == [0, 1, 2, 3]
    assert [node.label for node in memory.objects] == ["red chair", "chair", "floor lamp", "white wall"]


def test_the_memory_does_not_depend_on_the_order_of_mapping(flat, tiny_encoder, memory):
    shuffled = random.Random(1).sample(flat, len(flat))
    other = ObjectMemory.build(shuffled, tiny_encoder, Parameters())
    assert other.content_hash == memory.content_hash
    for mine, theirs in zip(memory.objects, other.objects, strict=True):
        assert (mine.feature == theirs.feature).all() and (mine.consensus == theirs.consensus).all()


def test_the_hash_follows_evidence_partition_encoder_and_parameters(flat, tiny_encoder, memory):
    def hash_of(views=flat, parameters=None, name="tiny==16", aligned=True):
        encoder = type("Renamed", (), {"id": name, "dim": 16, "encode": tiny_encoder.encode})()
        built = ObjectMemory.build(views, encoder, parameters or Parameters(), feature_text_aligned=aligned)
        return built.content_hash

    louder = [dataclasses.replace(flat[0], confidence=0.91), *flat[1:]]
    renamed = [dataclasses.replace(flat[0], phrase="Red chair"), *flat[1:]]
    others = [
        hash_of(views=louder),
        hash_of(views=renamed),
        hash_of(views=flat[1:]),
        hash_of(parameters=Parameters(alpha=0.6)),
        hash_of(name="tiny==17"),
        hash_of(aligned=False),
    ]
    assert hash_of() == memory.content_hash
    assert len({memory.content_hash, *others}) == 7


def test_repeated_frame_and_mask_are_kept_as_evidence(observe, tiny_encoder):
    views = [observe("box"), observe("box"), observe("lamp")]
    (node,) = ObjectMemory.build(views, tiny_encoder).objects
    assert len(node.observations) == 3
    assert (
        ObjectMemory.build(views[::-1], tiny_encoder).content_hash
        == ObjectMemory.build(views, tiny_encoder).content_hash
    )


def test_nothing_in_a_memory_can_be_changed(memory, flat):
    node = memory.objects[0]
    for thing, name in ((memory, "objects"), (memory, "parameters"), (node, "id"), (node.concepts[0], "belief")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(thing, name, None)
    arrays = [node.points, node.feature, node.consensus, node.aabb, node.centroid, node.embeddings, node.belief]
    arrays += [node.concepts[0].embedding, node.observations[0].points, node.observations[0].feature]
    for array in [*arrays, *memory.embeddings.values()]:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(TypeError):
        memory.embeddings["box"] = None
    with pytest.raises(TypeError):
        memory.about["box"] = None


def test_changing_the_arrays_it_was_built_from_does_not_change_it(tiny_encoder):
    points = np.zeros((60, 3), np.float32)
    view = Observation(0, 0, "box", 0.9, points, np.eye(16, dtype=np.float32)[0])
    memory = ObjectMemory.build([view], tiny_encoder)
    points += 5
    assert memory.objects[0].centroid == pytest.approx([0.01, 0.01, 0.01])  # the centre of their one voxel
    assert memory.objects[0].observations[0].points.max() == 0.0


def test_centroid_is_the_mean_of_unique_voxels(observe, tiny_encoder):
    small, large = observe("box", frame=0, side=4), observe("box", frame=1, side=10)
    (node,) = ObjectMemory.build([small, large], tiny_encoder).objects
    assert node.centroid == pytest.approx([0.1, 0.1, 0.1], abs=1e-6)
    assert len(node.points) == 1000
    assert node.aabb == pytest.approx(np.array([[0.01] * 3, [0.19] * 3]), abs=1e-6)


def test_points_as_they_come_count_by_the_voxels_they_occupy(tiny_encoder):
    crowd, stray = np.full((500, 3), 0.001, np.float32), np.full((1, 3), 1.019, np.float32)
    view = Observation(0, 0, "box", 0.9, np.concatenate([crowd, stray]), np.eye(16, dtype=np.float32)[0])
    assert ObjectMemory.build([view], tiny_encoder).objects[0].centroid == pytest.approx([0.51] * 3)


def test_features_of_another_length_are_refused_unless_they_are_said_to_be_no_text(observe, tiny_encoder):
    views = [observe("box", dim=4)]
    with pytest.raises(ValueError, match="feature_text_aligned=False"):
        ObjectMemory.build(views, tiny_encoder)
    assert len(ObjectMemory.build(views, tiny_encoder, feature_text_aligned=False).objects) == 1


@pytest.mark.parametrize("row", [np.full(16, np.nan), np.zeros(16), np.ones(3)])
def test_an_encoder_that_breaks_its_word_is_refused(observe, row):
    encoder = type(
        "Broken", (), {"id": "broken", "dim": 16, "encode": lambda self, texts: np.array([row] * len(texts))}
    )
    with pytest.raises(ValueError, match="broken"):
        ObjectMemory.build([observe("box")], encoder())


def test_features_that_are_no_text_serve_association_only(flat, tiny_encoder):
    memory = ObjectMemory.build(flat, tiny_encoder, feature_text_aligned=False)
    for candidate in memory.rank("red chair"):
        assert candidate.visual is None and candidate.score == pytest.approx(candidate.language)
    for readout in ("visual", "full"):
        with pytest.raises(ValueError, match="not text-aligned"):
            memory.project(["chair", "lamp"], readout)
    for readout in ("consensus", "early"):
        assert memory.project(["chair", "lamp"], readout).sum(axis=1) == pytest.approx(1.0)


def test_an_object_longer_than_its_views_explain_is_reported(observe, tiny_encoder, memory):
    row = [observe("shelf", at=(0.04 * k, 0, 0), frame=k) for k in range(20)]
    (alarm,) = ObjectMemory.build(row, tiny_encoder).extent_alarms()
    assert alarm.label == 0 and alarm.extent_m == pytest.approx(0.94, abs=1e-5) and "median" in alarm.because
    assert memory.extent_alarms() == []


def test_rooms_say_where_things_stand_and_change_nothing_else(memory, tiny_encoder, flat, tmp_path):
    west, east = (Room(n, [[x, -1], [x + 4, -1], [x + 4, 1], [x, 1]]) for n, x in (("west", -1), ("east", 3)))
    placed = ObjectMemory.build(flat, tiny_encoder, rooms=[west, east])
    assert [node.room for node in placed.objects] == ["west", "west", "east", "east"]
    assert placed.content_hash == memory.content_hash and placed.rank("lamp in the east") == memory.rank(
        "lamp in the east"
    )
    placed.save(tmp_path / "a.belief")
    opened = ObjectMemory.open(tmp_path / "a.belief", tiny_encoder)
    for kept in (opened, opened.rebuilt(Parameters(alpha=0.6)), memory.with_rooms([west, east])):
        assert [node.room for node in kept.objects] == ["west", "west", "east", "east"]
        assert [room.name for room in kept.rooms] == ["west", "east"]
    assert [node.room for node in opened.with_rooms([]).objects] == [None] * 4


def test_other_parameters_over_the_same_evidence_need_no_encoder(memory, tmp_path):
    memory.save(tmp_path / "a.belief")
    opened = ObjectMemory.open(tmp_path / "a.belief")
    again = opened.rebuilt(Parameters(consolidate=False))
    assert again.content_hash != memory.content_hash and len(again.objects) == 4
    assert opened.rebuilt(memory.parameters).content_hash == memory.content_hash
    with pytest.raises(ValueError, match="voxel_m"):
        opened.rebuilt(Parameters(voxel_m=0.05))


def test_the_state_hash_covers_content_and_rooms_given_and_derived(memory, tmp_path):
    corners = [[-1, -1], [3, -1], [3, 1], [-1, 1]]
    kept = [
        memory,
        memory.with_rooms([Room("west", corners)]),
        memory.with_rooms([Room("east", corners)]),
        memory.with_rooms([Room("west", corners, given=False, because="a red chair stands there")]),
        memory.with_rooms([Room("west", corners, heights_m=(0.0, 2.5))]),
    ]
    assert len({m.state_hash for m in kept}) == 5 and {m.content_hash for m in kept} == {memory.content_hash}
    kept[3].save(tmp_path / "a.belief")
    opened = ObjectMemory.open(tmp_path / "a.belief")
    assert opened.state_hash == kept[3].state_hash and opened.objects[0].room == "west"
    assert opened.rooms[0].because == "a red chair stands there" and not opened.rooms[0].given
