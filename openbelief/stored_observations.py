"""Observations that are read when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import overload
from weakref import WeakValueDictionary

from openbelief.arrays import Array
from openbelief.observation import Observation

Key = tuple[str, int, int]


class StoredKeys(Sequence[Key]):
    """(recording, frame, mask) of each observation of a file, made when it is asked for.

    recordings: their names. recording, frame, mask: (n,) whole numbers, the first into the names. Raises ValueError
    where it names none.
    """

    def __init__(self, recordings: Sequence[str], recording: Array, frame: Array, mask: Array) -> None:
        if len(recording) and not 0 <= recording.min() <= recording.max() < len(recordings):
            raise ValueError("an observation is of a recording that has no name")
        self._recordings, self._recording, self._frame, self._mask = recordings, recording, frame, mask

    def __len__(self) -> int:
        return len(self._recording)

    @overload
    def __getitem__(self, index: int) -> Key: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Key]: ...
    def __getitem__(self, index: int | slice) -> Key | Sequence[Key]:
        if isinstance(index, slice):
            return StoredKeys(self._recordings, self._recording[index], self._frame[index], self._mask[index])
        return self._recordings[self._recording[index]], int(self._frame[index]), int(self._mask[index])


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
