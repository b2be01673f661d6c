"""What a room is, by what stands in it: the readout's scores of its objects for the names that rooms have."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.memory import ObjectMemory

NAMES = (
    *("kitchen", "bathroom", "bedroom", "living room", "office", "hallway", "dining room", "kids room"),
    *("laundry room", "study", "garage", "balcony", "storage room", "entrance"),
)
# What stands in homes and offices: how far a name is from these says how far it is from things in general, on a site of
# one room too.
THINGS = (
    *("chair", "table", "sofa", "bed", "lamp", "shelf", "cabinet", "wardrobe", "desk", "computer", "monitor"),
    *("printer", "keyboard", "book", "television", "rug", "curtain", "pillow", "mirror", "clock", "picture"),
    *("plant", "vase", "box", "bag", "basket", "bucket", "broom", "bottle", "cup", "plate", "bowl", "knife"),
    *("pan", "kettle", "toaster", "oven", "microwave", "refrigerator", "dishwasher", "sink", "tap", "toilet"),
    *("bathtub", "shower", "towel", "soap", "iron", "toothbrush", "washing machine", "ladder", "bicycle"),
    *("car", "tool", "toy", "ball", "doll", "guitar", "piano", "shoe", "coat", "umbrella", "suitcase", "door"),
    *("phone", "radiator", "fan"),
)
WITNESSES = 3  # objects that support a name
NAMED_FROM = 2.0  # standard deviations over THINGS, the witnesses' mean
AHEAD = 0.1  # of the next name; nearer than that the objects speak for both


@dataclass(frozen=True)
class RoomName:
    """name: None where the objects speak for none. because: a sentence for people.

    either: the two names, and by what, where they speak for both alike.
    """

    name: str | None
    score: float
    because: str
    either: tuple[str, str] | None = None
    said: str = ""


@dataclass(frozen=True)
class NameScores:
    """standard: (objects, names) H_i^con of every object for every name, in standard deviations over THINGS; NaN for
    walls, floors and what was never named."""

    standard: Array
    labels: tuple[str, ...]

    def name(self, objects: Sequence[int]) -> RoomName:
        """The name that the three best objects support most."""
        scores = self.standard[list(objects)] if len(objects) else np.empty((0, len(NAMES)))
        speaking = ~np.isnan(scores[:, 0])
        spoken, ids = scores[speaking], np.array(objects, dtype=np.int64)[speaking]
        if not len(spoken):
            return RoomName(None, 0.0, "no named object stands in it")
        kinds = {label: [k for k, i in enumerate(ids) if self.labels[i] == label] for label in _labels(self, ids)}
        by_kind = np.array([spoken[rows].max(axis=0) for rows in kinds.values()])  # three doors count once
        best = -np.sort(-np.vstack((by_kind, np.zeros((WITNESSES, len(NAMES))))), axis=0)[:WITNESSES].mean(axis=0)
        first, second = np.argsort(-best, kind="stable")[:2]
        said = ", ".join(list(kinds)[k] for k in np.argsort(-by_kind[:, first], kind="stable")[:WITNESSES])
        score = float(best[first])
        if score >= NAMED_FROM and score - best[second] < AHEAD:
            both = f"{NAMES[first]} ({score:.1f}) or {NAMES[second]} ({best[second]:.1f})"
            either = NAMES[first], NAMES[second]
            return RoomName(None, score, f"no name is ahead: {both}, by {said}", either, said)
        if score < NAMED_FROM:
            return RoomName(None, score, f"no name fits well: {NAMES[first]} best ({score:.1f}), by {said}")
        words = f"{said} speak for {NAMES[first]} ({score:.1f}); next is {NAMES[second]} ({best[second]:.1f})"
        return RoomName(NAMES[first], score, words)


def decided(names: Sequence[RoomName]) -> list[RoomName]:
    """Where objects speak for two names alike and another room has better evidence for one of them, it is the other."""
    held: dict[str, float] = {}
    for room in names:
        if room.name:
            held[room.name] = max(held.get(room.name, 0.0), room.score)
    return [_decided(room, held) if room.either else room for room in names]


def _decided(room: RoomName, held: Mapping[str, float]) -> RoomName:
    one, other = room.either or ("", "")
    taken = [name for name in (one, other) if held.get(name, 0.0) >= room.score + AHEAD]
    if len(taken) != 1:
        return room
    name = other if taken[0] == one else one
    words = f"{room.said} speak for {one} and {other} alike ({room.score:.1f})"
    return RoomName(name, room.score, f"{words}; another room is more {taken[0]} ({held[taken[0]]:.1f})")


def _labels(scores: NameScores, ids: Array) -> list[str]:
    return sorted({scores.labels[i] for i in ids})


def name_scores(memory: ObjectMemory) -> NameScores:
    """Asks the memory for every name. Raises ValueError where it was opened without its text encoder."""
    if memory.text_encoder is None:
        raise ValueError("Rooms are named in the words of the memory's text encoder: open it with that.")
    scores = np.full((len(memory.objects), len(NAMES)), np.nan)
    names = np.asarray(memory.text_encoder.encode(list(NAMES)), np.float64)
    things = np.asarray(memory.text_encoder.encode(list(THINGS)), np.float64) @ names.T
    for column, vector in enumerate(names):
        for candidate in memory.rank(vector, "consensus"):
            scores[candidate.object_id, column] = np.nan if candidate.language is None else candidate.language
    scores[[node.background for node in memory.objects]] = np.nan
    labels = tuple(node.label or "" for node in memory.objects)
    spread = things.std(axis=0)
    return NameScores((scores - things.mean(axis=0)) / np.where(spread > 0, spread, 1.0), labels)


def unique_names(names: Sequence[RoomName], taken: Sequence[str] = ()) -> list[str]:
    """A name for each, none twice and none of those taken: "bedroom", "bedroom 2"; "room 3" where none fits."""
    used, counts = set(taken), Counter[str]()
    said: dict[int, str] = {}
    for i in sorted(range(len(names)), key=lambda i: (-names[i].score, i)):
        word = names[i].name or "room"
        while i not in said:
            counts[word] += 1
            number = counts[word]
            candidate = word if number == 1 and names[i].name else f"{word} {number}"
            if candidate not in used:
                said[i] = candidate
                used.add(candidate)
    return [said[i] for i in range(len(names))]
