"""On arrival the map is asked again, with what was seen there: is the candidate still the answer?

What each look saw at the candidate's place is added to a query-local copy of the candidate's evidence. The copy is
ranked against the rest of the map, its likeness H is held against the levels of doubt, and the words asked for are held
against the map's other phrases as names of what was seen. No threshold belongs to the check itself: zero divides better
from worse, and the levels are those from which the readout says *found* and *not found*. The memory never changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from openbelief.arrays import Array, normalize
from openbelief.grounded.attribute_evidence import AttributeEvidence
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.entries import Entries, beliefs
from openbelief.grounded.lexicon import is_known
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.reader import GroundedReader
from openbelief.grounded.reading import Reading
from openbelief.grounded.table import MapTable
from openbelief.grounded.thing import SURE, names_of, other_cost, thing_of_one
from openbelief.grounded.which import fitting
from openbelief.request.encoded import EncodedRequest

RIVALS = 5  # the map's phrases that what is seen is most like, as far as they mean something else
OTHER_COSINE = 0.7  # of a phrase with the words asked for, below which it means something else


@dataclass(frozen=True, eq=False)
class SeenThere:
    """A mask at the candidate's place. weight: w_e. feature: (d,) unit length, None where it says nothing of words."""

    phrase: str | None
    weight: float
    feature: Array | None


@dataclass(frozen=True, slots=True)
class Naming:
    """What one mask looks like. contrast: how much more like the words asked for than like the map's other phrases.

    called: its phrase. asked_like: likeness of that with the words, of all names. looks_like, rival_like: the other
    phrase that it is most like, "" where the map has none, and the likeness with that.
    """

    called: str | None
    contrast: float
    asked_like: float
    looks_like: str
    rival_like: float


@dataclass(frozen=True, slots=True)
class RelativeCheck:
    """likeness: the candidate's H with what was seen. lead: its score with that, less the best of the rest of the map.

    rival: the object that is the best of the rest, None where nothing is left. naming: of the mask, of all looks, that
    is most like the words. denial: what the candidate was called, with what was seen, against an asked colour, size or
    material; "" where that is in no doubt.
    """

    likeness: float
    lead: float
    rival: int | None
    naming: Naming
    denial: str = ""


def relative_check(
    reader: GroundedReader,
    reading: Reading,
    asked: EncodedRequest,
    candidate: int,
    looks: Sequence[Sequence[SeenThere]],
    excluded: frozenset[int],
) -> RelativeCheck:
    """looks: what each look saw at the place, one mask at least in all. excluded: object ids that were ruled out.

    Of each look the mask that is most like the words is the candidate's own: what stands around it meets its place as
    well, and says nothing about it. Raises ValueError where nothing was seen.
    """
    table, options, target = reader.table, reader.options, reading.request.target
    own = [_most_like(table, asked, target, look, options) for look in looks if look]
    if not own:
        raise ValueError("Nothing was seen at the place: there is nothing to add.")
    naming = max((naming for naming, _ in own), key=lambda one: one.contrast)
    rival = _best_other(table, reading, candidate, excluded)
    one = _copy_of(table, asked, candidate, [mask for _, mask in own], options)
    head, thing = SURE, float(reading.thing[candidate])
    if not reading.request.generic:
        head, thing = thing_of_one(table, one, target, asked, options)
    score = _without(reading, candidate) - float(reading.thing[candidate]) + thing
    lead = score - (-np.inf if rival is None else _without(reading, rival))
    return RelativeCheck(head, lead, rival, naming, _denial(one, target, options))


def _denial(one: MapTable, target: str, options: GroundedOptions) -> str:
    """By the measure of the doubt before the drive, of a table of one node."""
    attributes = AttributeEvidence.of(one, target)
    at = options.contradicted_at
    return attributes.denial(0) if at is not None and attributes.contradicted[0] > at else ""


def _without(reading: Reading, i: int) -> float:
    """The score without which one is meant."""
    return float(reading.score[i] - reading.which[i])


def name_of(reader: GroundedReader, asked: EncodedRequest, target: str, mask: SeenThere) -> Naming:
    """x(q) less the mean of the largest x over other phrases; x(p) = gain <f_mask, p> + <g_phrase, p>."""
    return _naming(reader.table, asked, target, mask, reader.options)


def _most_like(
    table: MapTable, asked: EncodedRequest, target: str, look: Sequence[SeenThere], options: GroundedOptions
) -> tuple[Naming, SeenThere]:
    told = [(_naming(table, asked, target, mask, options), mask) for mask in look]
    return max(told, key=lambda row: row[0].contrast)


def _naming(table: MapTable, asked: EncodedRequest, target: str, mask: SeenThere, options: GroundedOptions) -> Naming:
    """Its own name is among the other phrases, wherever it means something else than the words."""
    names = names_of(target, asked, options)
    vector, bare = _vectors_of(asked, mask.phrase, table.vectors.shape[1])
    asked_like = max(float(name.vector @ (bare if name.bare else vector)) - name.cost for name in names)
    words = [*table.words, mask.phrase or target]
    phrases = np.concatenate([table.bare_vectors, bare[None].astype(np.float32)])
    rivals = (phrases @ bare.astype(np.float32)).astype(np.float64)
    own, theirs = asked_like - other_cost(target, mask.phrase, options), rivals.copy()
    if table.feature_text_aligned and mask.feature is not None:
        own += options.arrival_visual_gain * float(mask.feature @ names[0].vector)
        theirs += options.arrival_visual_gain * (phrases @ mask.feature.astype(np.float32))
    alike = np.max([phrases @ n.vector.astype(np.float32) - n.cost for n in names], axis=0)
    within = np.array([word in target or target in word for word in words], dtype=bool)
    theirs[(alike >= OTHER_COSINE) | within] = -np.inf
    theirs[-1] = -np.inf if mask.phrase in table.words else theirs[-1]  # counted once
    best = np.argsort(-theirs, kind="stable")[:RIVALS]
    best = best[np.isfinite(theirs[best])]
    if not len(best):
        return Naming(mask.phrase, own, asked_like, "", 0.0)
    contrast, first = own - float(theirs[best].mean()), int(best[0])
    return Naming(mask.phrase, contrast, asked_like, words[first], float(rivals[first]))


def _vectors_of(asked: EncodedRequest, phrase: str | None, dim: int) -> tuple[Array, Array]:
    """(d,) of the phrase, and of it without its colour; zero where nothing was said."""
    if not phrase:
        return np.zeros(dim), np.zeros(dim)
    vector, bare = asked.of([phrase, without_colour(phrase)])
    return vector, bare


def _copy_of(
    table: MapTable, asked: EncodedRequest, i: int, seen: Sequence[SeenThere], options: GroundedOptions
) -> MapTable:
    """A table of one node: the candidate's entries, and the arrival's as many as they weigh."""
    mine = np.flatnonzero(table.row == i)
    support = {table.words[table.phrase[e]]: float(table.support[e]) for e in mine}
    told = [mask for mask in seen if mask.phrase]
    said = max(sum(mask.weight for mask in told), 1e-6)
    scale = max(1.0, options.arrival_share * sum(support.values()) / said)  # from near as much as from everywhere else
    feature = _feature_with(table, i, seen, sum(support.values()))
    for mask in told:
        support[str(mask.phrase)] = support.get(str(mask.phrase), 0.0) + scale * mask.weight
    return _one_row(table, asked, i, support, feature, len(seen), options)


def _feature_with(table: MapTable, i: int, seen: Sequence[SeenThere], mapped: float) -> Array:
    """(d,) f^v of the candidate with the arrival's features by their weight; the map's own where they say nothing."""
    feature: Array = table.features[i].astype(np.float64)
    shown = [(mask.weight, mask.feature) for mask in seen if mask.feature is not None]
    if not table.feature_text_aligned or not shown:
        return feature
    return normalize(feature * mapped + np.sum([weight * each for weight, each in shown], axis=0))


def _one_row(
    table: MapTable,
    asked: EncodedRequest,
    i: int,
    support: dict[str, float],
    feature: Array,
    looks: int,
    options: GroundedOptions,
) -> MapTable:
    words = tuple(sorted(support))
    vectors, bare = (
        asked.of(texts).astype(np.float32) if words else table.vectors[:0]
        for texts in (words, [without_colour(word) for word in words])
    )
    V, features = np.array([support[word] for word in words]), feature[None].astype(np.float32)
    rows, columns = np.zeros(len(words), np.int64), np.arange(len(words))
    belief = beliefs(Entries(rows, columns, V), vectors, features if table.feature_text_aligned else None, options)
    return replace(
        table,
        words=words,
        colours=tuple(map(colours_of, words)),
        known={u: bare_word for u, word in enumerate(words) if is_known(bare_word := without_colour(word))},
        vectors=vectors,
        bare_vectors=bare,
        row=rows,
        phrase=columns,
        support=V,
        belief=belief,
        length=np.array([np.linalg.norm(belief @ vectors)]) if words else np.zeros(1),
        bare_length=np.array([np.linalg.norm(belief @ bare)]) if words else np.zeros(1),
        features=features,
        looks=table.looks[i : i + 1] + looks,
        background=table.background[i : i + 1],
    )


def _best_other(table: MapTable, reading: Reading, i: int, excluded: frozenset[int]) -> int | None:
    """Of what is not the candidate, no piece of it, and was not ruled out; None where nothing is left.

    Where the sentence says which one ("the second chair"), the others of that kind are no rivals: they are what it
    counts.
    """
    others = np.isfinite(reading.score) & (table.group != table.group[i])
    others[[k for k in excluded if 0 <= k < len(others)]] = False
    if reading.request.which is not None:
        others &= ~fitting(reading.head, np.isfinite(reading.score), reading.options)
    if not others.any():
        return None
    return int(np.where(others, reading.score - reading.which, -np.inf).argmax())
