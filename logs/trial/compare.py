"""Two runs of one mission, decision by decision: identical, or what differs first and by how much."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from logs.trial.records import Checks, Record, Transition

TOLERANCE = 1e-6  # of floats; everything else must be equal


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What may differ: the floats of `loose` fields of an arrival's checks by as much as `loosely`, and `words`."""

    loosely: float = TOLERANCE
    loose: frozenset[str] = frozenset()
    words: frozenset[str] = frozenset()

    def same(self, topic: str, field: str, old: Any, new: Any) -> bool:
        if field in self.words:
            return True
        apart = self.loosely if topic == Checks.topic and field in self.loose else TOLERANCE
        return _same(old, new, apart)


EXACTLY = Tolerance()
# Where perception is computed again. The same networks on another GPU, or in fp16, move a similarity by up to 0.01 and
# a mask's rim by a pixel; 0.05 leaves room for that. Reasons quote such values, and the order of masks is theirs.
BY_PERCEPTION = Tolerance(
    0.05,
    frozenset({"semantic.value", "geometric.value", "relative.asked_like", "relative.rival_like"}),
    frozenset(
        {
            "reason",
            "because",
            "mask_index",
            "relative.called",
            "relative.looks_like",
            "relative.lead",
            "relative.contrast",
        }
    ),
)


@dataclass(frozen=True, slots=True)
class Difference:
    """The first decision that differs. step: states left before it; field: "" where a record is missing or another."""

    step: int
    decision: int
    topic: str
    field: str
    recorded: Any
    replayed: Any

    @property
    def by(self) -> float | None:
        """How far two numbers are apart, None where they are not both numbers."""
        if _is_number(self.recorded) and _is_number(self.replayed):
            return abs(float(self.recorded) - float(self.replayed))
        return None

    def __str__(self) -> str:
        where = f"{self.topic}{' ' + self.field if self.field else ''}"
        apart = f" (apart by {self.by:.3g})" if self.by is not None else ""
        return (
            f"step {self.step}, decision {self.decision}, {where}: "
            f"recorded {self.recorded!r}, replayed {self.replayed!r}{apart}"
        )


def compare_decisions(
    recorded: Sequence[Record], replayed: Sequence[Record], tolerance: Tolerance = EXACTLY
) -> Difference | None:
    """The first difference, None where the decisions are identical: floats within TOLERANCE, all else equal.

    A looser tolerance says what else may differ.
    """
    step = 0
    for number, (old, new) in enumerate(zip_longest(recorded, replayed), start=1):
        if old is None or new is None or type(old) is not type(new):
            return Difference(step, number, (old or new).topic, "", _named(old), _named(new))
        if isinstance(old, Transition) and isinstance(new, Transition) and old.event != new.event:
            return Difference(step, number, old.topic, "event", _event(old), _event(new))
        for field, a, b in _differing("", old.model_dump(), new.model_dump()):
            if not tolerance.same(old.topic, field, a, b):
                return Difference(step, number, old.topic, field, a, b)
        step += isinstance(old, Transition)
    return None


def _named(record: Record | None) -> str | None:
    if isinstance(record, Transition):
        return f"{record.topic} {_event(record)}"
    return None if record is None else record.topic


def _event(record: Transition) -> str:
    """With its reason: where the replay asked for other inputs than the trial's, that says so."""
    return f"{record.event} ({record.because})"


def _differing(path: str, old: Any, new: Any) -> Iterator[tuple[str, Any, Any]]:
    """(field, recorded, replayed) of every difference, in the order of the fields."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in dict.fromkeys([*old, *new]):
            yield from _differing(f"{path}.{key}" if path else key, old.get(key), new.get(key))
    elif isinstance(old, (list, tuple)) and isinstance(new, (list, tuple)):
        for index, (a, b) in enumerate(zip(old, new, strict=False)):
            yield from _differing(f"{path}[{index}]", a, b)
        if len(old) != len(new):
            yield f"{path} (length)", len(old), len(new)
    elif not _same(old, new):
        yield path, old, new


def _same(old: Any, new: Any, apart: float = TOLERANCE) -> bool:
    if isinstance(old, float) and isinstance(new, float):
        return abs(old - new) <= apart
    return bool(old == new)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)
