"""How well each object fits the words for the thing, place and relation aside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.attributes import DESCRIBED, MEASURES, alternatives_of
from openbelief.grounded.colours import colours_of, without_colour
from openbelief.grounded.lexicon import is_known, kinds, other_thing, same
from openbelief.grounded.options import GroundedOptions
from openbelief.grounded.table import MapTable
from openbelief.request.encoded import EncodedRequest
from openbelief.request.words import GENERIC

UNNAMED = -1.0  # H of a node without language: the lowest cosine
SURE = 1.0  # H of every node where the sentence names no thing


@dataclass(frozen=True, eq=False)
class ThingScores:
    """(n,) each. score: S of the thing's words. head: H in [-1, 1]. visual: <f^v, q>, None where not text-aligned."""

    score: Array
    head: Array
    visual: Array | None


@dataclass(frozen=True, eq=False)
class Name:
    """One name of the thing. bare: compared with the phrases without their colours. cost: taken off its similarity."""

    vector: Array
    bare: bool
    cost: float = 0.0


def names_of(text: str, asked: EncodedRequest, options: GroundedOptions) -> list[Name]:
    """The words as said, the words without colour, what means the same, and what is of that kind."""
    bare = without_colour(text)
    mates, members = same(bare) or same(_singular(bare)), kinds(bare) or kinds(_singular(bare))
    rows = asked.of([text, bare, *mates, *members])
    costs = [0.0, *(options.synonym_cost for _ in mates), *(options.kind_cost for _ in members)]
    others = [Name(row, True, cost) for row, cost in zip(rows[1:], costs, strict=True)]
    return [Name(rows[0], False), *others]


def described_thing(text: str) -> list[str]:
    """The thing that a description is of, and its other names: "mug with a flower pattern" -> "mug", "cup".

    What the map's phrases do not say of it makes it no other thing.
    """
    found = DESCRIBED.match(text)
    if found is None or found["thing"] in GENERIC:
        return []
    thing = found["what"] if found["thing"] in MEASURES else found["thing"]
    return [thing, *(same(thing) or same(_singular(thing)))]


def thing_scores(table: MapTable, text: str, asked: EncodedRequest, options: GroundedOptions) -> ThingScores:
    """S = share z(H) + (1 - share) z(<f^v, q>) - cost / sqrt(looks) + colour; of alternatives the better one's."""
    if " or " in text:
        return _either([thing_scores(table, one, asked, options) for one in alternatives_of(text)])
    cost = options.other_cost * _other_things(table, without_colour(text))
    scores = scores_of_names(table, names_of(text, asked, options), options, cost)
    colour = options.colour_weight * colour_evidence(table, text, options)
    head = np.maximum(scores.head, _described_head(table, without_colour(text), asked, options))
    return ThingScores(scores.score + colour, head, scores.visual)


def _either(alternatives: Sequence[ThingScores]) -> ThingScores:
    """ "a chair or a sofa": whichever fits better."""
    seen = [one.visual for one in alternatives if one.visual is not None]
    return ThingScores(
        np.max([one.score for one in alternatives], axis=0),
        np.max([one.head for one in alternatives], axis=0),
        np.max(seen, axis=0) if seen else None,
    )


def _described_head(table: MapTable, bare: str, asked: EncodedRequest, options: GroundedOptions) -> Array | float:
    """H of the thing that a description is of: what no phrase says of it only tells things of a kind apart."""
    thing, *others = described_thing(bare) or [""]
    if not thing:
        return UNNAMED
    rows = asked.of([thing, *others])
    names = [Name(row, True, options.synonym_cost * (1 + (k > 0))) for k, row in enumerate(rows)]
    return language_head(table, names, options)


def generic_scores(table: MapTable, text: str, options: GroundedOptions) -> ThingScores:
    """Where the thing is not named ("something on the table", "the blue one") every object is one, of that colour."""
    colour = options.colour_weight * colour_evidence(table, text, options)
    return ThingScores(colour - _doubted(table, options), np.full(len(table), SURE), None)


def scores_of_names(
    table: MapTable, names: Sequence[Name], options: GroundedOptions, cost: Array | None = None
) -> ThingScores:
    """cost: (U,) taken off the likeness of each phrase."""
    head, among = language_head(table, names, options, cost), ~table.background
    said = standardised(head, among & table.spoken, options.language_spread)
    if not table.feature_text_aligned:
        said = np.where(table.spoken, said, said.min(initial=0.0) - 1.0)
        return ThingScores(said - _doubted(table, options), head, None)
    visual = table.features @ names[0].vector.astype(np.float32)
    seen = standardised(visual, among, options.visual_spread)
    fused = np.where(table.spoken, options.language_share * said + (1 - options.language_share) * seen, seen)
    return ThingScores(fused - _doubted(table, options), head, visual.astype(np.float64))


def language_head(table: MapTable, names: Sequence[Name], options: GroundedOptions, cost: Array | None = None) -> Array:
    """H = share <norm(sum p g), q> + (1 - share) T log sum p exp(s / T); (n,) in [-1, 1]."""
    T, share = options.temperature, options.consensus_share
    likeness = np.full(len(table.words), UNNAMED)
    consensus = np.full(len(table), UNNAMED)
    spoken = table.spoken
    for name in names:
        vectors, length = (table.bare_vectors, table.bare_length) if name.bare else (table.vectors, table.length)
        alike = (vectors @ name.vector.astype(np.float32)).astype(np.float64) if len(vectors) else likeness
        if cost is not None:
            alike = alike - cost
        likeness = np.maximum(likeness, alike - name.cost)
        mean = table.of_rows(table.belief * alike[table.phrase])
        consensus[spoken] = np.maximum(consensus[spoken], mean[spoken] / length[spoken] - name.cost)
    weighed = table.of_rows(table.belief * np.exp((likeness[table.phrase] - 1.0) / T))
    pooled = np.full(len(table), UNNAMED)
    pooled[spoken] = 1.0 + T * np.log(weighed[spoken])
    return share * consensus + (1 - share) * pooled


def thing_of_one(
    table: MapTable, one: MapTable, text: str, asked: EncodedRequest, options: GroundedOptions
) -> tuple[float, float]:
    """H and S of a table of one node, by the means and deviations of the whole map.

    Nothing is taken off for few looks: the robot stands before it.
    """
    names, bare, among = names_of(text, asked, options), without_colour(text), ~table.background
    head, map_head = (
        language_head(each, names, options, options.other_cost * _other_things(each, bare)) for each in (one, table)
    )
    score = _on_scale(head, map_head[among & table.spoken], options.language_spread)
    if table.feature_text_aligned:
        query = names[0].vector.astype(np.float32)
        seen = _on_scale(one.features @ query, (table.features @ query)[among], options.visual_spread)
        score = options.language_share * score + (1 - options.language_share) * seen
    colour = options.colour_weight * colour_evidence(one, text, options)
    told = np.maximum(head, _described_head(one, bare, asked, options))
    return float(told[0]), float((score + colour)[0])


def other_cost(text: str, phrase: str | None, options: GroundedOptions) -> float:
    """What is taken off where both are known to name different things."""
    return options.other_cost * bool(phrase and other_thing(without_colour(text), without_colour(phrase)))


def _other_things(table: MapTable, bare: str) -> Array:
    """(U,) 1 for the phrases that are known to name something else."""
    others = np.zeros(len(table.words))
    if is_known(bare):
        for u, phrase in table.known.items():
            others[u] = other_thing(bare, phrase)
    return others


def colour_evidence(table: MapTable, text: str, options: GroundedOptions) -> Array:
    """(n,) in (-1, 1): support of phrases with an asked colour against that of other colours; 0 where none is asked."""
    asked = colours_of(text)
    if not asked:
        return np.zeros(len(table))
    sign = np.array([bool(c & asked) - bool(c and not c & asked) for c in table.colours], dtype=np.float64)
    signs = sign[table.phrase]
    told = table.of_rows(table.support * np.abs(signs))
    return table.of_rows(table.support * signs) / (told + options.colour_prior)


def standardised(values: Array, among: Array, least_spread: float) -> Array:
    """z-scores over the nodes of `among`, by a standard deviation of at least so much; 0 where there are none."""
    return _on_scale(values, values[among], least_spread)


def _on_scale(values: Array, known: Array, least_spread: float) -> Array:
    """By the mean and deviation of others."""
    return (values - known.mean()) / max(float(known.std()), least_spread) if len(known) else np.zeros(len(values))


def _doubted(table: MapTable, options: GroundedOptions) -> Array:
    return options.evidence_cost / np.sqrt(np.maximum(table.looks, 1.0))


def _singular(text: str) -> str:
    """ "chairs" -> "chair", "boxes" -> "box", "shelves" -> "shelf"; the last word only."""
    for ending, instead in (("ves", "f"), ("ies", "y"), ("xes", "x"), ("ches", "ch"), ("shes", "sh"), ("s", "")):
        if text.endswith(ending) and not text.endswith("ss") and len(text) > len(ending) + 2:
            return text.removesuffix(ending) + instead
    return text
