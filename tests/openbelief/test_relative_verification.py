"""The three ordered checks, the semantic one relative to the map."""

from __future__ import annotations

import numpy as np
import pytest

from openbelief import ObjectMemory, Observation, Parameters
from openbelief.arrays import normalize
from openbelief.grounded.options import GroundedOptions
from openbelief.observation import Intrinsics, Mask, RgbdFrame
from openbelief.perception.sentence import SentenceEncoder
from openbelief.phrase import with_article
from openbelief.relative_verification import RelativeVerification, Wanted, verify_relative
from openbelief.verification import Verdict

ENCODER = SentenceEncoder()
CAMERA = Intrinsics(64, 48, 50.0, 50.0, 31.5, 23.5)
HERE, LEFT = slice(24, 40), slice(0, 12)


def feature(name: str) -> np.ndarray:
    return normalize(ENCODER.encode([name])[0]).astype(np.float32)


def frame(depth: float = 2.0) -> RgbdFrame:
    return RgbdFrame(0, 0, np.zeros((48, 64, 3), np.uint8), np.full((48, 64), depth, np.float32), CAMERA, np.eye(4))


def mask(phrase: str, columns: slice = HERE, index: int = 0, looks: np.ndarray | None = None) -> Mask:
    pixels = np.zeros((48, 64), bool)
    pixels[16:32, columns] = True
    return Mask(index, pixels, phrase, 0.9, feature(phrase) if looks is None else looks)


def plane(x: float) -> np.ndarray:
    """What the mask over columns 24-40 shows at 2 m, moved to x."""
    grid = np.meshgrid(np.arange(x - 0.3, x + 0.3, 0.02), np.arange(-0.3, 0.3, 0.02))
    return np.stack((*grid, np.full_like(grid[0], 2.0)), axis=-1).reshape(-1, 3).astype(np.float32)


@pytest.fixture
def memory() -> ObjectMemory:
    """Object 0 stands in view and is called a wardrobe; the others are elsewhere."""
    said = ["wardrobe", "shoe cabinet", "bookshelf", "sofa", "floor lamp", "bicycle"]
    views = [
        Observation(10 * k + look, 0, phrase, 0.9, plane(4.0 * k), feature(phrase))
        for k, phrase in enumerate(said)
        for look in range(3)
    ]
    return ObjectMemory.build(views, ENCODER, Parameters())


def check(
    memory: ObjectMemory, masks: list[Mask], *before, sentence: str = "wardrobe", depth: float = 2.0, **more
) -> RelativeVerification:
    asked, reader = memory.asked(sentence), memory.reader()
    wanted = Wanted(reader, reader.read(asked), asked, 0)
    return verify_relative(memory.objects[0].points, frame(depth), masks, wanted, memory.parameters, before, **more)


def test_the_thing_asked_for_at_its_place_is_confirmed_at_the_first_look(memory):
    found = check(memory, [mask("sofa", LEFT), mask("wardrobe", index=7)])
    assert found.checks.confirmed and found.checks.best_mask == 7 and len(found.seen) == 1
    assert found.checks.reason == "From near it looks like a wardrobe (1.00), at the stored place: overlap 100%."
    assert found.checks.semantic == pytest.approx(found.relative.likeness) and found.checks.tau_q == 0.65


def test_the_first_failing_check_is_the_verdict(memory):
    wrong, elsewhere = mask("shoe cabinet"), mask("wardrobe", LEFT)
    assert check(memory, [wrong], depth=0.5).checks.verdict is Verdict.INSUFFICIENT_VISIBILITY
    assert check(memory, [elsewhere]).checks.verdict is Verdict.NOT_AT_STORED_PLACE
    assert "'wardrobe' is in view (1.00) but not at the stored place" in check(memory, [elsewhere]).checks.reason


def test_another_name_is_doubted_once_and_then_rejected_in_words(memory):
    first = check(memory, [mask("bicycle")])
    assert first.checks.verdict is Verdict.DOUBTFUL and "too close to tell" in first.checks.reason
    second = check(memory, [mask("bicycle")], first.seen)
    assert second.checks.verdict is Verdict.NO_MATCHING_MASK
    assert "From near it looks like a bicycle (1.00), not a wardrobe (" in second.checks.reason


def test_a_doubtful_look_is_made_good_by_the_next(memory):
    first = check(memory, [mask("bicycle")])
    assert check(memory, [mask("wardrobe")], first.seen).checks.confirmed


def test_a_place_that_perception_missed_is_looked_at_again_and_an_empty_one_is_not(memory):
    missed = check(memory, [mask("sofa", LEFT)])
    assert missed.checks.verdict is Verdict.DOUBTFUL and missed.seen == () and missed.relative is None
    assert check(memory, [mask("sofa", LEFT)], missed.seen).checks.verdict is Verdict.NO_MATCHING_MASK
    assert check(memory, [mask("wardrobe")], missed.seen).checks.confirmed
    gone = check(memory, [], depth=4.0)
    assert gone.checks.verdict is Verdict.NO_MATCHING_MASK and "looks through" in gone.checks.reason


def test_what_fits_better_elsewhere_on_the_map_is_said(memory):
    """The stored wardrobe, asked for as a cabinet for shoes: the shoe cabinet is it."""
    first = check(memory, [mask("shoe rack")], sentence="shoe cabinet")
    again = check(memory, [mask("wardrobe")], first.seen, sentence="shoe cabinet")
    assert again.checks.verdict is Verdict.NO_MATCHING_MASK
    assert again.relative.rival == 1 and again.relative.lead < 0


def test_features_that_say_nothing_of_words_are_left_out_and_unlike_ones_refused(memory):
    short = np.eye(7, dtype=np.float32)[0]
    assert check(memory, [mask("wardrobe", looks=short)], feature_text_aligned=False).checks.confirmed
    with pytest.raises(ValueError, match="they cannot be compared"):
        check(memory, [mask("wardrobe", looks=short)])


@pytest.mark.parametrize(
    ("phrase", "said"),
    [("sofa", "a sofa"), ("umbrella stand", "an umbrella stand"), ("shoes", "shoes"), ("glass", "a glass")],
)
def test_a_thing_is_said_with_its_article(phrase, said):
    assert with_article(phrase) == said


def test_a_colour_that_the_map_and_the_look_deny_is_not_confirmed(memory_of_chairs):
    again = check(memory_of_chairs, [mask("white chair")], sentence="red chair")
    assert again.checks.verdict is Verdict.DOUBTFUL
    assert "but it was called white, never red" in again.checks.reason
    last = check(memory_of_chairs, [mask("white chair")], again.seen, sentence="red chair")
    assert last.checks.verdict is Verdict.NO_MATCHING_MASK and "never red" in last.checks.reason


@pytest.mark.parametrize(
    ("sentence", "seen"), [("red chair", "red chair"), ("white chair", "chair"), ("chair", "chair")]
)
def test_a_colour_that_is_seen_from_near_or_not_asked_for_is_no_denial(memory_of_chairs, sentence, seen):
    assert check(memory_of_chairs, [mask(seen)], sentence=sentence).checks.verdict is Verdict.CONFIRMED


def test_a_trial_of_before_did_not_heed_a_denied_colour(memory_of_chairs):
    asked, options = memory_of_chairs.asked("red chair"), GroundedOptions(contradicted_at=None)
    reader = memory_of_chairs.reader(options)
    wanted, points = Wanted(reader, reader.read(asked), asked, 0), memory_of_chairs.objects[0].points
    found = verify_relative(points, frame(), [mask("white chair")], wanted, memory_of_chairs.parameters)
    assert "never red" not in found.checks.reason


@pytest.fixture
def memory_of_chairs() -> ObjectMemory:
    """Object 0 stands in view; three looks called it white, and one said no colour."""
    said = [["white chair", "white chair", "white chair", "chair"], ["bookshelf"] * 4, ["floor lamp"] * 4]
    views = [
        Observation(10 * k + look, 0, phrase, 0.9, plane(4.0 * k), feature(phrase))
        for k, phrases in enumerate(said)
        for look, phrase in enumerate(phrases)
    ]
    return ObjectMemory.build(views, ENCODER, Parameters())
