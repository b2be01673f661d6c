"""A place in a sentence, and where its clauses begin: the words of one clause end where the next one starts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from openbelief.request import words as w
from openbelief.request.words import Name, Words

LAST = tuple((article,) for article in sorted(w.ARTICLES))


class Cursor:
    """`at` moves from left to right over the tokens; a comma is a token of its own.

    to_anchor: whether "to" and "from" begin a clause, as after "the nearest lamp".
    """

    def __init__(self, tokens: Sequence[str]) -> None:
        self.tokens, self.at, self.to_anchor = list(tokens), 0, False

    @property
    def word(self) -> str | None:
        return self.tokens[self.at] if self.at < len(self.tokens) else None

    @property
    def rest(self) -> list[str]:
        return self.tokens[self.at :]

    def stands(self, table: Iterable[Words], at: int | None = None) -> int:
        """How many words of the first entry that stands here (or at `at`); 0 where none does."""
        start = self.at if at is None else at
        return next((len(entry) for entry in table if tuple(self.tokens[start : start + len(entry)]) == entry), 0)

    def read(self, table: Mapping[Words, Name]) -> Name | None:
        """What the entry that stands here means, and past it."""
        length = self.stands(table)
        found = table[tuple(self.tokens[self.at : self.at + length])] if length else None
        self.at += length
        return found

    def skip(self, table: Iterable[Words], only_before: Iterable[Words] | None = None) -> None:
        while length := self.stands(table):
            if only_before is not None and not self.stands(only_before, self.at + length):
                return
            self.at += length

    def skip_words(self, *words: str) -> None:
        while self.word in words:
            self.at += 1

    def skip_articles(self, more: Sequence[str] = ()) -> None:
        while (word := self.word) and (word in w.ARTICLES or word in more) and self.at + 1 < len(self.tokens):
            self.at += 1
        self.at += self.stands(w.QUANTIFIERS)

    def is_word(self, at: int) -> bool:
        return at < len(self.tokens) and self.tokens[at] != ","

    # ---- clauses

    def segment(self) -> list[str]:
        """The words up to the next clause, without articles at their beginning; the cursor moves behind them."""
        taken = self.peek()
        self.at = self._end()
        return taken

    def peek(self) -> list[str]:
        return bare([word for word in self.tokens[self.at : self._end()] if word != ","])

    def compound(self, at: int) -> bool:
        return bool(self.stands(w.COMPOUNDS, at))

    def begins(self, at: int) -> bool:
        """A relation, a place or a negation, with something of its own behind it: "to sit ON by a table" is none."""
        if n := self.stands(w.RELATIONS, at):
            return self.is_word(at + n) and not self.stands(w.RELATIONS, at + n)
        return any((n := self.stands(table, at)) and self.is_word(at + n) for table in (w.LACKS, w.NEGATIONS))

    def _end(self) -> int:
        end = self.at
        while end < len(self.tokens) and not self._ends_at(end):
            end += 1
        return end

    def _ends_at(self, at: int) -> bool:
        if self.compound(at) or (at > 0 and self.compound(at - 1)):
            return False
        if self.tokens[at] == ",":
            return self._comma_ends(at)
        return self.begins(at) or (at > self.at and any(ends(at) for ends in (self._and, self._to, self._told_behind)))

    def _comma_ends(self, at: int) -> bool:
        """Another adjective goes on; a clause, an article or a pronoun begins something new."""
        after = at + 1
        if not self.is_word(after):
            return True
        return (
            self.begins(after)
            or self.tokens[after] in (*w.ARTICLES, "and", "but")
            or bool(self.stands(w.ASIDES + w.FILLERS, after))
        )

    def _and(self, at: int) -> bool:
        """ "the cup and the saucer" names two things, "between the cup and the saucer" one place."""
        if self.tokens[at] != "and" or not self.is_word(at + 1) or self._between(at):
            return False
        return self.tokens[at + 1] in w.ARTICLES or bool(self.stands(w.RELATIONS, at + 1))

    def _between(self, at: int) -> bool:
        opened = [i for i in range(at) if self.tokens[i] == "between"]
        return bool(opened) and "and" not in self.tokens[opened[-1] : at] and opened[-1] < self.at

    def _to(self, at: int) -> bool:
        return self.to_anchor and self.tokens[at] in ("to", "from") and self.is_word(at + 1)

    def _told_behind(self, at: int) -> bool:
        if any(self.stands(table, at) for table in (w.SIDES, w.ASIDES, w.REVERSED, w.WHEREABOUTS)):
            return True
        filler = self.stands(w.FILLERS, at)
        after = at + filler
        adjective = self.is_word(after) and self.tokens[after] in w.ADJECTIVES
        return bool(filler) and (adjective or self.begins(after) or self._superlative_last(after))

    def _superlative_last(self, at: int) -> bool:
        """ "... is THE LARGEST", at the end."""
        at += self.stands(LAST, at)
        length = self.stands(w.WHICH, at)
        return bool(length) and at + length == len(self.tokens)


def bare(words: list[str]) -> list[str]:
    """Without the articles at its beginning, and behind "or"."""
    start = next((i for i, word in enumerate(words) if word not in w.ARTICLES), len(words))
    return [word for i, word in enumerate(words) if i >= start and (word not in w.ARTICLES or words[i - 1] != "or")]
