"""What a room is, by what stands in it: how much each thing tells of one kind of room against all the others."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from openbelief.arrays import Array
from openbelief.grounded.place_hints import HINTS
from openbelief.memory import ObjectMemory

NAMES = tuple(HINTS)
# A thing is as like a kind of room as it is like the most typical thing there, and half as much like the name itself.
NAME_SHARE = 0.5
TEMPERATURE = 0.2  # of the likenesses: a chair, which is alike to things of many rooms, tells of none of them
DOUBT = 0.1  # a thing may be anything, or stand anywhere: one cannot outvote all the others
ALIKE = 0.7  # cosine: so like each other, things are of one kind and count once together
PASSAGE = {"hallway": 4.0, "entrance": 3.0}  # what a long and narrow room beside several others tells, as things do
AHEAD = 0.75  # of the next name; nearer than that the things speak for both, or for nothing
WITNESSES = 3  # kinds of things that are said to support a name


@dataclass(frozen=True)
class RoomName:
    """name: None where the objects speak for none. score: log-evidence for it, against chance. because: a sentence for
    people.

    either: the two names, and by what, where they speak for both alike.
    """

    name: str | None
    score: float
    because: str
    either: tuple[str, str] | None = None
    said: str = ""


@dataclass(frozen=True)
class NameScores:
    """telling: (objects, names) log of how much likelier than chance each name is by each object alone. vectors:
    (objects, d) their consensus. speaking: (objects,) bool, False for walls, floors and what was never named."""

    telling: Array
    vectors: Array
    speaking: Array
    labels: tuple[str, ...]

    def name(self, objects: Sequence[int], passage: bool = False) -> RoomName:
        """The name that the kinds of things among the objects, and the room's shape, support most."""
        ids = np.array([i for i in objects if self.speaking[i]], dtype=np.int64)
        if not len(ids) and not passage:
            return RoomName(None, 0.0, "no named object stands in it")
        alike = self.vectors[ids] @ self.vectors[ids].T >= ALIKE
        votes = self.telling[ids] / np.maximum(alike.sum(axis=1), 1)[:, None]
        scores = votes.sum(axis=0) + np.array([PASSAGE.get(name, 0.0) * passage for name in NAMES])
        first, second = np.argsort(-scores, kind="stable")[:2].tolist()
        said = self._witnesses(ids, votes[:, first], passage and NAMES[first] in PASSAGE)
        return _named(NAMES[first], NAMES[second], float(scores[first]), float(scores[second]), said)

    def _witnesses(self, ids: Array, votes: Array, passage: bool) -> str:
        """The labels that speak most for a name, and the shape where that does."""
        order = np.argsort(-votes, kind="stable")
        labels = list(dict.fromkeys(self.labels[ids[k]] for k in order if votes[k] > 0))
        return ", ".join(["its long and narrow shape"] * passage + labels[:WITNESSES]) or "nothing"


def _named(first: str, second: str, score: float, next_score: float, said: str) -> RoomName:
    if score - next_score >= AHEAD:
        words = f"{said} speak for {first} ({score:.1f}); next is {second} ({next_score:.1f})"
        return RoomName(first, score, words)
    both = f"{first} ({score:.1f}) or {second} ({next_score:.1f})"
    return RoomName(None, score, f"no name is ahead: {both}, by {said}", (first, second), said)


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


def name_scores(memory: ObjectMemory) -> NameScores:
    """Asks the memory for typical things of every kind of room. Raises ValueError without its text encoder."""
    if memory.text_encoder is None:
        raise ValueError("Rooms are named in the words of the memory's text encoder: open it with that.")
    words = list(dict.fromkeys([*NAMES, *(thing for things in HINTS.values() for thing in things)]))
    text = dict(zip(words, np.asarray(memory.text_encoder.encode(words), np.float64), strict=True))
    vectors = np.asarray(memory.table.consensus, np.float64)
    likeness = np.stack([_likeness(vectors, text, name) for name in NAMES], axis=1) / TEMPERATURE
    share = np.exp(likeness - likeness.max(axis=1, keepdims=True))
    share /= share.sum(axis=1, keepdims=True)
    telling = np.log((1.0 - DOUBT) * share * len(NAMES) + DOUBT)
    speaking = np.asarray(memory.table.spoken & ~memory.table.background)
    return NameScores(telling, vectors, speaking, tuple(node.label or "" for node in memory.objects))


def _likeness(vectors: Array, text: Mapping[str, Array], name: str) -> Array:
    """(objects,) of their consensus to a kind of room."""
    typical = np.stack([text[thing] for thing in HINTS[name]])
    return (vectors @ typical.T).max(axis=1) + NAME_SHARE * (vectors @ text[name])


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
