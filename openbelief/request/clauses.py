"""The clauses of a sentence, each to its part of the request."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from openbelief.request import words as w
from openbelief.request.cursor import Cursor
from openbelief.request.parts import adjectives_first, anchors_of, beyond_its_kind, without_dangling
from openbelief.request.places import EVERYWHERE, is_place
from openbelief.request.request import Negation, Relation, Which
from openbelief.request.words import RelationKind, WhichKind

PLACING = ("in", "inside", "within", "at", "from", "on", "into")
# "left of ME" is which one, not where.
AS_SEEN: dict[RelationKind, WhichKind] = {
    "next to": "nearest",
    "nearest to": "nearest",
    "farthest from": "farthest",
    "left of": "left-most",
    "right of": "right-most",
    "in front of": "ahead",
    "behind": "behind",
}


class Clauses:
    """Reads tokens from left to right; its attributes are the parts."""

    def __init__(self, tokens: Sequence[str]) -> None:
        self._cursor = Cursor(tokens)
        self.thing: list[str] = []
        self.place: str | None = None
        self.relations: list[Relation] = []
        self.negations: list[Negation] = []
        self.which: Which | None = None
        self.unused: list[str] = []
        self._pointed_at: list[str] = []  # "not THAT CHAIR": of the kind that is wanted
        self._ways = (
            *(self._side, self._ranked_anchor, self._another_anchor, self._aside, self._superlative, self._whereabouts),
            *(self._told, self._refinement),
        )

    def read(self) -> None:
        cursor = self._cursor
        if cursor.stands(w.NEGATIONS) and not cursor.compound(0):  # "not the red chair, the blue one"
            self._negation()
            cursor.skip_words(",", "but", "rather", "instead")
        self._read_which()
        thing, dangling = without_dangling(cursor.segment())
        self.thing = adjectives_first(thing)
        self.unused += dangling
        while cursor.word is not None:
            self._clause()
        self._name_the_pronoun()

    def _clause(self) -> None:
        cursor = self._cursor
        cursor.skip_words(",")
        if any(one() for one in self._ways):
            return
        before = cursor.at
        if self.thing:
            self.unused += cursor.segment()
        else:  # "in the kitchen, next to the sink, A LAMP"
            self.thing = cursor.segment()
        if cursor.at == before:  # nothing can be made of this word
            self.unused += cursor.rest[:1]
            cursor.at += 1

    def _told(self) -> bool:
        """A negation, a place or a relation; "that is" and the like before it say nothing more."""
        cursor = self._cursor
        cursor.skip(w.FILLERS, only_before=(*w.LACKS, *w.NEGATIONS, *w.RELATIONS))
        if length := cursor.stands(w.LACKS):
            cursor.at += length
            self._without(cursor.segment())
        elif cursor.stands(w.NEGATIONS) > cursor.stands(w.RELATIONS):  # "not far from" is near
            self._negation()
        elif cursor.stands(w.RELATIONS):
            relation, place = self._relation()
            self._stand_in(place)
            self._relate(relation)
        else:
            return False
        return True

    def _stand_in(self, place: str | None) -> None:
        if place is not None and self.place is not None:
            self.unused += place.split()
        self.place = self.place or place

    def _relate(self, relation: Relation | None) -> None:
        """A "with" after another relation says which anchor is meant: "next to the table with the lamp"."""
        if relation is None:
            return
        if relation.kind == "with" and self.relations and self.relations[-1].of_anchor is None:
            self.relations[-1] = replace(self.relations[-1], of_anchor=relation)
        else:
            self.relations.append(relation)

    # ---- places, relations and negations

    def _relation(self) -> tuple[Relation | None, str | None]:
        """The clause at the cursor, as a relation or as a place; neither where it went elsewhere."""
        cursor, word = self._cursor, self._cursor.word
        kind = cursor.read(w.RELATIONS)
        missing = kind == "with" and cursor.word == "no"
        cursor.at += missing
        anchor = cursor.segment()
        if kind is None or not anchor or self._of_myself(kind, anchor) or self._adjective(kind, anchor):
            return None, None
        if word in PLACING and is_place(" ".join(anchor)):
            return None, " ".join(anchor)
        if kind == "in" and anchor == ["room"]:  # "in this room"
            return None, "this room"
        if word in PLACING and " ".join(anchor) in EVERYWHERE:
            return None, None
        anchors = anchors_of(kind, anchor)
        if not anchors:
            return None, None
        relation = Relation(kind, anchors, self._held() if kind == "with" else None)
        if missing:
            self.negations.append(Negation(relation=relation))
        return (None if missing else relation), None

    def _held(self) -> RelationKind | None:
        """ "... ON IT", after what a thing is with."""
        self._cursor.skip(w.FILLERS, only_before=w.REVERSED)
        return self._cursor.read(w.REVERSED)

    def _of_myself(self, kind: RelationKind, anchor: list[str]) -> bool:
        """ "next to me" is which one, not where."""
        if anchor[-1] not in w.SELF or kind not in AS_SEEN:
            return False
        self.which = Which(AS_SEEN[kind], self.which.number if self.which else 1)
        return True

    def _adjective(self, kind: RelationKind, anchor: list[str]) -> bool:
        """ "a chair in blue"."""
        if kind not in ("in", "with") or not all(part in w.COLOURS for part in anchor):
            return False
        self.thing = [*anchor, *self.thing]
        return True

    def _negation(self) -> None:
        cursor, outside = self._cursor, self._cursor.word == "outside"
        cursor.at += cursor.stands(w.NEGATIONS)
        if outside:
            self.negations.append(Negation(place=" ".join(cursor.segment()) or None))
            return
        cursor.skip((*w.FILLERS, *w.VERBS))
        pointing = cursor.word in w.POINTING
        phrase = [] if cursor.stands(w.RELATIONS) else cursor.segment()
        if pointing:
            self._pointed(phrase)
            return
        cursor.skip(w.FILLERS, only_before=w.RELATIONS)
        of_one = cursor.stands(w.RELATIONS) and (
            not phrase or phrase[-1] in w.PRONOUNS or not self.thing or phrase == self.thing
        )
        relation, place = self._relation() if of_one else (None, None)
        if (named := self._named(phrase)) or place or relation:
            self.negations.append(Negation(named, place, relation))

    def _pointed(self, phrase: list[str]) -> None:
        """ "not THAT one": another of its kind."""
        self.which = self.which or Which("other")
        self._pointed_at = phrase or ["one"]

    def _without(self, anchor: list[str]) -> None:
        if anchor:
            self.negations.append(Negation(relation=Relation("with", (" ".join(anchor),), self._held())))

    def _named(self, phrase: list[str]) -> str | None:
        """What a negation is about: "the red one" and "red" are a red thing of the kind that is asked for."""
        own = [word for word in phrase if word not in w.PRONOUNS]
        if not own:
            return None
        of_a_kind = len(own) < len(phrase) or all(word in w.ADJECTIVES for word in own)
        head = self.thing[: self.thing.index("of")] if "of" in self.thing[1:] else self.thing
        noun = head[-1:] if of_a_kind and head and head[-1] not in w.PRONOUNS else []
        return " ".join([*own, *noun])

    # ---- what is told behind the thing without a preposition

    def _whereabouts(self) -> bool:
        """ "the chair UPSTAIRS": a place, though no room is called so; "over there" is what a hand would show."""
        cursor = self._cursor
        length = cursor.stands(w.WHEREABOUTS)
        if not length or (cursor.begins(cursor.at) and cursor.is_word(cursor.at + length)):
            return False
        words = cursor.rest[:length]
        cursor.at += length
        if words[-1] == "there":
            self.unused += words
        else:
            self._stand_in(" ".join(words).removeprefix("in "))
        return True

    def _another_anchor(self) -> bool:
        """ "next to the sofa AND THE PIANO": the same relation to another."""
        cursor, last = self._cursor, self.relations[-1] if self.relations else None
        if last is None or last.kind in ("between", "in") or last.of_anchor or cursor.word != "and":
            return False
        article = cursor.tokens[cursor.at + 1 : cursor.at + 2]
        if not article or article[0] not in w.ARTICLES:
            return False
        cursor.at += 1
        if anchor := cursor.segment():
            self.relations.append(Relation(last.kind, (" ".join(anchor),), self._held() if last.holds else None))
        else:
            self.unused.append("and")
        return True

    def _ranked_anchor(self) -> bool:
        """ "the nearest lamp TO the sofa"."""
        cursor = self._cursor
        if not cursor.to_anchor or self.which is None or cursor.word not in ("to", "from"):
            return False
        cursor.at += 1
        anchor = cursor.segment()
        if anchor and anchor[-1] not in w.SELF:
            kind: RelationKind = "nearest to" if self.which.kind == "nearest" else "farthest from"
            self.relations.append(Relation(kind, (" ".join(anchor),)))
            self.which = None if self.which.number == 1 else Which(None, self.which.number)
        return True

    def _side(self) -> bool:
        """ "the lamp on the left", "the chair near me"."""
        length = self._cursor.stands(w.SIDES)
        if not length or self._cursor.tokens[self._cursor.at + length :][:1] == ["of"]:
            return False
        self.which = Which(self._cursor.read(w.SIDES), self.which.number if self.which else 1)
        return True

    def _aside(self) -> bool:
        """What comes after is another wish, or a reason: none of it is used."""
        cursor = self._cursor
        cursor.at += cursor.word == "and" and bool(cursor.stands(w.RELATIONS, cursor.at + 1))
        another = cursor.word == "and" and cursor.tokens[cursor.at + 1 : cursor.at + 2] != []
        article = another and cursor.tokens[cursor.at + 1] in w.ARTICLES
        if cursor.stands(w.RELATIONS) or not (article or cursor.stands(w.ASIDES)):
            return False
        self.unused += [word for word in cursor.rest if word != ","]
        cursor.at = len(cursor.tokens)
        return True

    def _superlative(self) -> bool:
        """ "the chair that IS THE LARGEST"."""
        cursor, start, which = self._cursor, self._cursor.at, self.which
        cursor.skip(w.FILLERS)
        if cursor.at > start:
            self._read_which()
        if cursor.word not in (None, ",") or self.which == which:
            cursor.at, self.which = start, which
        return cursor.at > start

    def _refinement(self) -> bool:
        """ "..., the blue one", "..., the second one": more of the thing's own words, and which of it."""
        cursor = self._cursor
        cursor.skip(w.FILLERS)
        start, which = cursor.at, self.which
        self._read_which()
        more = cursor.peek()
        own = [word for word in more if word not in w.PRONOUNS]
        adjectives = len(own) < len(more) or all(word in w.ADJECTIVES for word in own)
        if not (self.thing and adjectives and (own or self.which != which)):
            cursor.at, self.which = start, which
            return False
        cursor.segment()
        self.thing = [*own, *self.thing]
        return True

    # ---- which one

    def _read_which(self) -> None:
        """ "the second largest": an ordinal, an order, or both, before the thing's own words."""
        cursor = self._cursor
        cursor.skip_articles()
        number, kind, counted = 1, None, False
        while (word := cursor.word) and not cursor.compound(cursor.at):
            length = 0 if cursor.stands(w.RELATIONS) > 1 else cursor.stands(w.WHICH)  # "next chair", not "next to"
            if length and (cursor.is_word(cursor.at + length) or cursor.at + length == len(cursor.tokens)):
                kind = cursor.read(w.WHICH)
            elif word in w.NUMBERS and cursor.is_word(cursor.at + 1):
                self.unused.append(word)
                cursor.at += 1
            elif word in w.ORDINALS and cursor.is_word(cursor.at + 1):
                number, counted, cursor.at = w.ORDINALS[word], True, cursor.at + 1
            else:
                break
            cursor.skip_articles(("of",))
        if kind is not None or counted:
            self.which = Which(kind, number)
        cursor.to_anchor = kind in ("nearest", "farthest")

    def _name_the_pronoun(self) -> None:
        """ "not the red chair, the blue one": the noun that was said before."""
        named = next((n.phrase.split() for n in self.negations if n.phrase), self._pointed_at)
        if self._pointed_at and not self.thing:
            self.thing = self._pointed_at
        elif self.thing and self.thing[-1] in w.PRONOUNS and named:
            self.thing[-1] = named[-1]
        self.negations = [beyond_its_kind(negation, self.thing) for negation in self.negations]
