from __future__ import annotations

import dataclasses
import random
import signal
import sqlite3
import subprocess
import sys
import textwrap

import numpy as np
import pytest

from openbelief import ObjectMemory, Parameters
from openbelief.store import FORMAT, BeliefFileError, BeliefStore


@pytest.fixture
def create(tmp_path):
    def make(name="walk.belief", **changes):
        about = {"text_encoder_id": "tiny==16", "text_dim": 16, "parameters": Parameters()}
        more = {"feature_text_aligned": True, "about": {"walk": 1}}
        return BeliefStore.create(tmp_path / name, **(about | more | changes))

    return make


def finish(store, memory):
    store.finish(memory.evidence, memory.table.columns)


def add_all(store, flat):
    for frame in range(4):
        store.add_frame("walk", 1000 + frame, [o for o in flat if o.frame == frame])


def test_what_is_read_is_what_was_saved(memory, path, tiny_encoder):
    again = ObjectMemory.open(path, tiny_encoder)
    assert again.content_hash == memory.content_hash
    assert again.about == memory.about and again.frames == memory.frames and again.parameters == memory.parameters
    assert again.rank("floor lamp") == memory.rank("floor lamp")
    assert (again.project(["lamp", "chair"]) == memory.project(["lamp", "chair"])).all()
    for mine, theirs in zip(memory.observations, again.observations, strict=True):
        assert mine.key == theirs.key and mine.phrase == theirs.phrase and mine.provenance == theirs.provenance
        assert (mine.points == theirs.points).all() and (mine.feature == theirs.feature).all()


def test_observations_without_provenance_come_back_without(observe, tiny_encoder, tmp_path):
    ObjectMemory.build([observe(None)], tiny_encoder).save(tmp_path / "a.belief")
    (observation,) = ObjectMemory.open(tmp_path / "a.belief").observations
    assert observation.provenance is None and observation.phrase is None


def test_numpy_s_integers_are_only_integers(flat, tiny_encoder, memory, tmp_path):
    same = [dataclasses.replace(o, frame=np.int64(o.frame), mask=np.int32(o.mask)) for o in flat]
    ObjectMemory.build(same, tiny_encoder).save(tmp_path / "a.belief")
    assert ObjectMemory.open(tmp_path / "a.belief").content_hash == memory.content_hash


def test_an_empty_memory_is_saved_and_read(tiny_encoder, tmp_path):
    ObjectMemory.build([], tiny_encoder).save(tmp_path / "a.belief")
    assert ObjectMemory.open(tmp_path / "a.belief", tiny_encoder).retrieve("lamp") is None


def test_one_file_is_all_there_is(path):
    assert list(path.parent.iterdir()) == [path]
    assert path.read_bytes()[18:20] == b"\x01\x01"  # not WAL
    assert sqlite3.connect(path).execute("PRAGMA journal_mode").fetchone() == ("delete",)


def test_reading_leaves_the_file_untouched_even_where_nothing_can_be_written(path):
    before = path.read_bytes()
    path.chmod(0o444)
    path.parent.chmod(0o555)
    try:
        memory = ObjectMemory.open(path)
        memory.rank(np.ones(16))
    finally:
        path.parent.chmod(0o755)
    assert path.read_bytes() == before and list(path.parent.iterdir()) == [path]


def test_without_an_encoder_vectors_can_be_asked_and_sentences_are_refused(memory, path):
    opened = ObjectMemory.open(path)
    assert opened.rank(np.eye(16)[0]) == memory.rank(np.eye(16)[0])
    with pytest.raises(ValueError, match="tiny==16"):
        opened.rank("lamp")


@pytest.mark.parametrize(("name", "dim"), [("tiny==17", 16), ("tiny==16", 8)])
def test_another_encoder_is_refused(path, tiny_encoder, name, dim):
    with pytest.raises(ValueError, match="tiny==16"):
        ObjectMemory.open(path, type("Other", (), {"id": name, "dim": dim, "encode": tiny_encoder.encode})())


def test_a_name_with_odd_characters_is_only_a_name(memory, tmp_path):
    odd = tmp_path / "a b?mode=rw#%20.belief"
    memory.save(odd)
    assert ObjectMemory.open(odd).content_hash == memory.content_hash


def test_saving_replaces_the_whole_file_or_nothing(memory, path, observe, tiny_encoder):
    ObjectMemory.build([observe("box")], tiny_encoder).save(path)
    assert len(ObjectMemory.open(path).objects) == 1
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("keep", [0, 1, 50, 99, 100, 5000, -1])
def test_a_file_cut_short_is_refused_in_one_line(path, keep):
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(BeliefFileError, match=r"^[^\n]*site.belief[^\n]*$"):
        ObjectMemory.open(path)


@pytest.mark.parametrize("seed", range(40))
def test_a_flipped_bit_is_refused_or_changes_nothing(path, memory, seed):
    data, rng = bytearray(path.read_bytes()), random.Random(seed)
    data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    path.write_bytes(data)
    try:
        opened = ObjectMemory.open(path)
        read = [(o.key, o.phrase, o.points.tobytes(), o.provenance) for o in opened.observations]
        ranked = opened.rank(np.ones(16), "belief")
    except BeliefFileError as error:
        assert "\n" not in str(error) and str(path) in str(error)
    else:
        assert opened.content_hash == memory.content_hash and ranked == memory.rank(np.ones(16), "belief")
        assert read == [(o.key, o.phrase, o.points.tobytes(), o.provenance) for o in memory.observations]


@pytest.mark.parametrize("key", ["text_dim", "feature_text_aligned", "chair"])
def test_a_flipped_bit_in_a_key_is_refused_wherever_the_key_is_kept(path, key):
    """An index keeps copies of the keys; a whole copy there must not vouch for a broken row."""
    whole = path.read_bytes()
    places = [i for i in range(len(whole)) if whole.startswith(key.encode(), i)]
    refusals = 0
    for place in places:
        broken = bytearray(whole)
        broken[place] ^= 1
        path.write_bytes(broken)
        try:
            assert ObjectMemory.open(path).parameters == Parameters()
        except BeliefFileError:
            refusals += 1
    assert refusals >= 1


@pytest.mark.parametrize("content", [b"PK\x03\x04 a zip file" * 50, b"{}", b"SQLite format 3\x00" + bytes(84)])
def test_a_foreign_file_is_refused(tmp_path, content):
    (tmp_path / "a.belief").write_bytes(content)
    with pytest.raises(BeliefFileError, match="not an OpenBelief memory"):
        ObjectMemory.open(tmp_path / "a.belief")


def test_somebody_else_s_database_a_missing_file_and_a_folder_are_refused(tmp_path):
    with sqlite3.connect(tmp_path / "a.belief") as db:
        db.execute("CREATE TABLE observations (id)")
    db.close()
    with pytest.raises(BeliefFileError, match="not an OpenBelief memory"):
        ObjectMemory.open(tmp_path / "a.belief")
    for missing, said in ((tmp_path / "b.belief", "does not exist"), (tmp_path, "is a folder")):
        with pytest.raises(BeliefFileError, match=f"{said}.*openbelief map"):
            ObjectMemory.open(missing)


def test_where_nothing_can_be_written_saving_says_so_in_one_line(memory, tmp_path):
    (tmp_path / "file").write_text("")
    for target, said in (
        (tmp_path / "no-folder" / "a.belief", "no-folder does not exist"),
        (tmp_path, "is a folder"),
        (tmp_path / "file" / "a.belief", "does not exist"),
    ):
        with pytest.raises(BeliefFileError, match=rf"^[^\n]*{said}[^\n]*$"):
            memory.save(target)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_newer_file_asks_for_a_newer_program(path):
    with sqlite3.connect(path) as db:
        db.execute(f"PRAGMA user_version={FORMAT + 1}")
    db.close()
    with pytest.raises(BeliefFileError, match="update OpenBelief"):
        ObjectMemory.open(path)


def test_a_changed_phrase_is_noticed(path):
    with sqlite3.connect(path) as db:
        db.execute("UPDATE observations SET phrase = 'safe' WHERE id = 1")
    db.close()
    opened = ObjectMemory.open(path)
    opened.rank(np.ones(16))
    with pytest.raises(BeliefFileError, match=r"damaged .mask 0 of frame 0 of 'walk' is not what was written"):
        list(opened.objects[0].observations)


def test_mapping_through_the_store_gives_the_same_memory(create, flat, memory, tiny_encoder):
    with create() as store:
        add_all(store, flat)
        store.add_frame("walk", 9000, [], skipped="no transform")
        assert store.frames_done("walk") == {1000, 1001, 1002, 1003, 9000} and store.frames_done("other") == set()
        built = ObjectMemory.build(
            store.observations(), tiny_encoder, store.parameters, frames=store.frames(), about=store.about
        )
        finish(store, built)
        opened = ObjectMemory.open(store.path)
    assert opened.content_hash == memory.content_hash == built.content_hash
    assert opened.frames[-1].skipped == "no transform" and opened.about == {"walk": 1}


def test_an_unfinished_mapping_is_no_memory_and_can_be_resumed(create, flat, tiny_encoder):
    with create() as store:
        add_all(store, flat[:0])
        path = store.path
    with pytest.raises(BeliefFileError, match="unfinished mapping"):
        ObjectMemory.open(path)
    with BeliefStore.resume(path) as store:
        assert store.frames_done("walk") == {1000, 1001, 1002, 1003} and store.about == {"walk": 1}
        finish(store, ObjectMemory.build(store.observations(), tiny_encoder))
    assert ObjectMemory.open(path).objects == ()


def test_a_finished_file_can_hold_more_and_must_be_finished_again(path, observe, tiny_encoder):
    with BeliefStore.resume(path) as store:
        store.add_frame("second", 1007, [observe("box", at=(9, 0, 0), frame=7, recording="second")])
    with pytest.raises(BeliefFileError, match="unfinished"):
        ObjectMemory.open(path)
    with BeliefStore.resume(path) as store:
        finish(store, ObjectMemory.build(store.observations(), tiny_encoder))
    assert len(ObjectMemory.open(path).objects) == 5


def test_a_frame_is_taken_once_whole_and_of_its_own_recording(create, flat):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        with pytest.raises(ValueError, match="already"):
            store.add_frame("walk", 1000, flat[:4])
        with pytest.raises(ValueError, match="'walk'"):
            store.add_frame("other", 1001, flat[4:8])
        assert len(store.observations()) == 4


def test_a_memory_of_other_evidence_is_not_written(create, flat, memory):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        with pytest.raises(ValueError, match="not built from the evidence"):
            store.finish(memory.evidence, memory.table.columns)


def test_after_an_interruption_too_a_memory_of_other_evidence_is_not_written(create, flat, tiny_encoder):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
    with BeliefStore.resume(store.path) as store:
        store.add_frame("walk", 1001, flat[4:8])
        for other in (flat[:4], flat[4:8], flat[:7], flat):
            built = ObjectMemory.build(other, tiny_encoder)
            with pytest.raises(ValueError, match="not built from the evidence"):
                finish(store, built)
        finish(store, ObjectMemory.build(flat[:8], tiny_encoder))
    assert ObjectMemory.open(store.path).content_hash == ObjectMemory.build(flat[:8], tiny_encoder).content_hash


def test_a_memory_with_one_coordinate_changed_is_other_evidence(create, flat, tiny_encoder):
    moved = dataclasses.replace(flat[3], points=np.nextafter(flat[3].points, np.float32(9)))
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        with pytest.raises(ValueError, match="not built from the evidence"):
            finish(store, ObjectMemory.build([*flat[:3], moved], tiny_encoder))


def test_a_mapping_in_two_runs_leaves_the_same_columns_as_in_one(create, flat, tiny_encoder):
    def columns(path):
        db = sqlite3.connect(path)
        return db.execute("SELECT name, shape, sha256 FROM columns ORDER BY name, part").fetchall()

    with create("once.belief") as once:
        add_all(once, flat)
        finish(once, ObjectMemory.build(once.observations(), tiny_encoder))
    with create("twice.belief") as first:
        first.add_frame("walk", 1000, [o for o in flat if o.frame == 0])
        assert len(first.observations()) == 4
    with BeliefStore.resume(first.path) as second:
        for frame in range(1, 4):
            second.add_frame("walk", 1000 + frame, [o for o in flat if o.frame == frame])
        finish(second, ObjectMemory.build(second.observations(), tiny_encoder))
    assert columns(once.path) == columns(second.path)


def test_words_and_pictures_of_other_types_are_kept_as_what_they_say(create, flat, tiny_encoder):
    source = dataclasses.replace(flat[0].provenance, crop_jpeg=bytearray(b"picture"), stamp_ns=np.int64(1000))
    odd = dataclasses.replace(flat[0], phrase=np.str_("lamp"), provenance=source)
    with create() as store:
        store.add_frame("walk", 1000, [odd])
        finish(store, ObjectMemory.build(store.observations(), tiny_encoder))
    (kept,) = ObjectMemory.open(store.path).observations
    assert (kept.phrase, kept.provenance.crop_jpeg) == ("lamp", b"picture")


def test_a_frame_that_the_disk_refused_can_be_given_again(create, flat, tiny_encoder):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        pages = store._db.execute("PRAGMA page_count").fetchone()[0]
        store._db.execute(f"PRAGMA max_page_count={pages}")
        with pytest.raises(BeliefFileError, match="full"):
            store.add_frame("walk", 1001, flat[4:8])
        store._db.execute("PRAGMA max_page_count=1000000")
        store.add_frame("walk", 1001, flat[4:8])
        finish(store, ObjectMemory.build(store.observations(), tiny_encoder))
    assert [o.key for o in ObjectMemory.open(store.path).observations] == sorted(o.key for o in flat[:8])


def test_two_mappers_do_not_write_one_file(create, flat):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        with pytest.raises(BeliefFileError, match="another process"):
            BeliefStore.resume(store.path)


def test_an_existing_file_is_not_overwritten(create):
    with create(), pytest.raises(FileExistsError, match="exists already"):
        create()


def test_a_disk_that_is_full_is_said_so_in_one_line_and_loses_no_finished_frame(create, flat):
    with create() as store:
        store.add_frame("walk", 1000, flat[:4])
        pages = store._db.execute("PRAGMA page_count").fetchone()[0]
        store._db.execute(f"PRAGMA max_page_count={pages}")
        with pytest.raises(BeliefFileError, match=r"^[^\n]*cannot be written: database or disk is full\.$"):
            store.add_frame("walk", 1001, flat[4:8])
        assert len(store.observations()) == 4 and store.frames_done("walk") == {1000}


def test_a_new_file_where_none_can_be_is_refused_in_one_line(create):
    with pytest.raises(BeliefFileError, match=r"^[^\n]*cannot be written: unable to open[^\n]*$"):
        create("no-folder/a.belief")


def test_kill_9_while_mapping_loses_no_finished_frame(tmp_path):
    script = """
        import sys, numpy as np
        from openbelief import Observation, Parameters
        from openbelief.observation import Provenance
        from openbelief.store import BeliefStore
        store = BeliefStore.create(sys.argv[1], text_encoder_id="tiny==16", text_dim=16, parameters=Parameters(),
                                   feature_text_aligned=True, about={})
        points = np.random.default_rng(0).uniform(size=(5000, 3))
        for frame in range(100_000):
            source = Provenance("walk", frame, (0, 0, 1, 1), {"size": [1, 1], "counts": [0, 1]})
            store.add_frame("walk", frame, [Observation(frame, 0, "box", 0.9, points, np.eye(16)[0], source)])
            print(frame, flush=True)
    """
    path = tmp_path / "walk.belief"
    with subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script), str(path)], stdout=subprocess.PIPE, text=True
    ) as mapper:
        for line in mapper.stdout:
            if int(line) == 20:
                break
        mapper.send_signal(signal.SIGKILL)
    with pytest.raises(BeliefFileError, match="unfinished"):
        ObjectMemory.open(path)
    with BeliefStore.resume(path) as store:
        done = store.frames_done("walk")
        assert done >= set(range(21)) and len(store.observations()) == len(done)
