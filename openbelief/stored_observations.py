"""Observations that are read when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import overload
from weakref import WeakValueDictionary

from openbelief.observation import Observation

Key = tuple[str, int, int]


class StoredObservations(Sequence[Observation]):
    """The evidence of a file in canonical order. While anybody holds an observation, it is the same one for all.

    keys: (recording, frame, mask) of each. read: gives one; may raise BeliefFileError.
    """

    def __init__(self, keys: Sequence[Key], read: Callable[[int], Observation]) -> None:
        self.keys, self._read = keys, read
        self._held: WeakValueDictionary[int, Observation] = WeakValueDictionary()

    def __len__(self) -> int:
        return len(self.keys)

    @overload
    def __getitem__(self, index: int) -> Observation: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Observation]: ...
    def __getitem__(self, index: int | slice) -> Observation | Sequence[Observation]:
        if isinstance(index, slice):
            return Members(self, range(len(self))[index])
        row = range(len(self))[index]
        observation = self._held.get(row)
        if observation is None:
            observation = self._held.setdefault(row, self._read(row))
        return observation

    def held(self) -> dict[int, Observation]:
        """Those that somebody holds now, by index."""
        return dict(self._held)


class Members(Sequence[Observation]):
    """Some of a sequence of observations, by index."""

    def __init__(self, observations: Sequence[Observation], indices: Sequence[int]) -> None:
        self._observations, self._indices = observations, indices

    def __len__(self) -> int:
        return len(self._indices)

    @overload
    def __getitem__(self, index: int) -> Observation: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Observation]: ...
    def __getitem__(self, index: int | slice) -> Observation | Sequence[Observation]:
        if isinstance(index, slice):
            return Members(self._observations, self._indices[index])
        return self._observations[self._indices[index]]
