"""The three ordered arrival checks with a relative semantic one (`arrival_check = "relative"`).

The paper's frame stays: what cannot be seen is not judged, then what is there is named, then it is located. Only the
naming differs: what is seen at the candidate's place is added to a copy of its evidence and the map is asked again
(openbelief.grounded.arrival), instead of one threshold for all words. A first look that decides neither way is
doubtful, and is looked at once more from elsewhere; both looks then count.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from openbelief.arrays import Array
from openbelief.arrival_look import Here, Look, Looked, look_at
from openbelief.grounded.arrival import Naming, RelativeCheck, SeenThere, name_of, relative_check
from openbelief.grounded.levels import DoubtLevels
from openbelief.grounded.reader import GroundedReader
from openbelief.grounded.reading import Reading
from openbelief.observation import Mask, RgbdFrame
from openbelief.parameters import Parameters
from openbelief.phrase import with_article
from openbelief.request.encoded import EncodedRequest
from openbelief.verification import ArrivalChecks, Verdict, is_unseen, seen_through, unseen


@dataclass(frozen=True)
class Wanted:
    """What is being verified: the candidate's row in the reading of what was asked, and what was ruled out before."""

    reader: GroundedReader
    reading: Reading
    asked: EncodedRequest
    candidate: int
    excluded: frozenset[int] = frozenset()

    @property
    def target(self) -> str:
        return self.reading.request.target or "thing"

    @property
    def aligned(self) -> bool:
        return self.reader.table.feature_text_aligned

    def named(self, mask: SeenThere) -> Naming:
        return name_of(self.reader, self.asked, self.reading.request.target, mask)


@dataclass(frozen=True)
class RelativeVerification:
    """checks: as the paper's, with `semantic` the candidate's H and `tau_q` the level it was held against.

    seen: what this look saw at the place. relative: None where no look saw anything there.
    """

    checks: ArrivalChecks
    seen: Look
    relative: RelativeCheck | None


def verify_relative(
    node_points: Array,
    frame: RgbdFrame,
    masks: Sequence[Mask],
    wanted: Wanted,
    parameters: Parameters,
    before: Sequence[Look] = (),
    *,
    feature_text_aligned: bool = True,
    pose_error_m: float = 0.10,
) -> RelativeVerification:
    """Visibility, then semantics relative to the map, then geometry; the first to fail decides.

    before: what earlier doubtful looks saw at the place. Without any this is the first look, which may be DOUBTFUL.
    feature_text_aligned: whether the masks' features can be compared with words. Raises ValueError as `verify` does.
    """
    dim = wanted.reader.table.vectors.shape[1] if feature_text_aligned and wanted.aligned else None
    looked = look_at(node_points, frame, masks, parameters, dim, pose_error_m)
    return judge_relative(looked, wanted, parameters, before)


def judge_relative(
    looked: Looked, wanted: Wanted, parameters: Parameters, before: Sequence[Look] = ()
) -> RelativeVerification:
    """The verdict on what was looked at, as `verify_relative` gives it."""
    here = looked.at_place(parameters.tau_arr)
    seen, relative = tuple(one.seen for one in here), None
    if seen or any(before):
        looks = (*before, seen)
        relative = relative_check(wanted.reader, wanted.reading, wanted.asked, wanted.candidate, looks, wanted.excluded)
    level = level_of(relative, wanted.reader.levels, first=not before)
    verdict, reason = _decide(looked, here, relative, level, wanted, parameters, first=not before)
    nearest = max(here, key=lambda one: (one.overlap or 0.0, -one.index), default=None)
    checks = ArrivalChecks(
        verdict=verdict,
        reason=reason,
        visibility=looked.shown,
        tau_nu=parameters.tau_nu,
        semantic=None if relative is None else relative.likeness,
        tau_q=level,
        overlap=None if nearest is None else nearest.overlap,
        tau_arr=parameters.tau_arr,
        pose_error_m=looked.pose_error_m,
        best_mask=None if nearest is None else nearest.index,
    )
    return RelativeVerification(checks, seen, relative)


def contradicts(naming: Naming, levels: DoubtLevels) -> bool:
    """Whether what was seen is called something else: less like the words than like the map's other phrases, and by its
    own name *not found*. What the map says of the place from afar does not outweigh that.
    """
    return naming.contrast < 0 and naming.asked_like < levels.unsure


def confirms(relative: RelativeCheck, levels: DoubtLevels, *, first: bool) -> bool:
    """Whether the candidate, with what was seen there, is still the answer."""
    likely = relative.likeness >= level_of(relative, levels, first=first)
    return likely and relative.lead > 0 and not relative.denial and not contradicts(relative.naming, levels)


def in_doubt(relative: RelativeCheck, levels: DoubtLevels) -> bool:
    """Whether a first look that does not confirm decides nothing yet: by one of the two it may be the thing."""
    return relative.likeness >= levels.unsure or relative.naming.contrast >= 0


def level_of(relative: RelativeCheck | None, levels: DoubtLevels, *, first: bool) -> float:
    """H from which it is confirmed: where the readout says *found*.

    At the second look already where it says *unsure*, if what is seen is no less like the words than like the map's
    other phrases.
    """
    return levels.unsure if relative and not first and relative.naming.contrast >= 0 else levels.found


def _decide(
    looked: Looked,
    here: Sequence[Here],
    relative: RelativeCheck | None,
    level: float,
    wanted: Wanted,
    parameters: Parameters,
    *,
    first: bool,
) -> tuple[Verdict, str]:
    """The paper's order: what cannot be seen is not judged, and what is not there is not named."""
    if is_unseen(looked.shown, parameters):
        return Verdict.INSUFFICIENT_VISIBILITY, unseen(looked.shown, parameters.tau_nu)
    if not here or relative is None:
        return _nothing_here(looked, wanted, first=first)
    like, levels = _looks_like(relative.naming, wanted.target), wanted.reader.levels
    if confirms(relative, levels, first=first):
        overlap = max(one.overlap or 0.0 for one in here)
        return Verdict.CONFIRMED, f"{like}, at the stored place: overlap {overlap:.0%}."
    if relative.denial:
        like = f"{like}, but it was {relative.denial}"
    elif relative.likeness >= level and not contradicts(relative.naming, levels):
        like = f"{like}, but with what is seen here {_rival(relative, wanted)} fits {wanted.target!r} better"
    elif relative.likeness < level:
        like = f"{like}: with that the place is {relative.likeness:.2f} like it, needs {level:.2f}"
    if first and in_doubt(relative, levels):
        return Verdict.DOUBTFUL, f"{like}; too close to tell from one look."
    return Verdict.NO_MATCHING_MASK, f"{like}."


def _nothing_here(looked: Looked, wanted: Wanted, *, first: bool) -> tuple[Verdict, str]:
    """The thing stands elsewhere in view, its place is empty, or perception may have missed it."""
    named = max((wanted.named(one.seen) for one in looked.found), key=lambda one: one.asked_like, default=None)
    if named and named.asked_like >= wanted.reader.levels.found:
        elsewhere = f"{wanted.target!r} is in view ({named.asked_like:.2f}) but not at the stored place"
        return Verdict.NOT_AT_STORED_PLACE, f"{elsewhere}{seen_through(looked.shown)}."
    nothing = f"Nothing is recognised where {wanted.target!r} should be"
    if first and not seen_through(looked.shown):
        return Verdict.DOUBTFUL, f"{nothing}; one look may have missed it."
    return Verdict.NO_MATCHING_MASK, f"{nothing}{seen_through(looked.shown)}."


def _looks_like(naming: Naming, target: str) -> str:
    """In words: what it looks like from near, and how much."""
    asked = f"{with_article(target)} ({naming.asked_like:.2f})"
    if naming.contrast >= 0 or not naming.looks_like:
        return f"From near it looks like {asked}"
    rival = f"{with_article(naming.looks_like)} ({naming.rival_like:.2f})"
    if naming.rival_like < naming.asked_like:
        return f"From near it is called {naming.called!r} but looks more like {rival} than like {asked}"
    called = "" if naming.called in (None, naming.looks_like) else f"is called {naming.called!r} and "
    return f"From near it {called}looks like {rival}, not {asked}"


def _rival(relative: RelativeCheck, wanted: Wanted) -> str:
    phrases = [] if relative.rival is None else wanted.reader.table.phrases_of(relative.rival)
    return f"the {phrases[0][0]} elsewhere on the map" if phrases else "something else on the map"
