"""Which observations are of one object: overlap, vetoed by appearance, and connected components (eq. association)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from openbelief.arrays import Array, bounds, points_array
from openbelief.observation import Observation
from openbelief.parameters import Parameters
from openbelief.touching_boxes import TouchingBoxes
from openbelief.voxel_ball import ROUNDING_M
from openbelief.voxel_share import NearShares

ROUNDING_COSINE = 1e-6


def overlap(P: Array, Q: Array, radius: float) -> float:
    """Omega_r: the larger of the shares of P within r of Q and of Q within r of P.

    P, Q: (n, 3) float32, map frame, metres, taken as given. Symmetric, in [0, 1]. Raises ValueError on bad input.
    """
    _check_radius(radius)
    near = NearShares([points_array(P, "P"), points_array(Q, "Q")], radius, voxel_m=radius / 1.5)
    return float(max(near.shares(np.array([0]), near=1)[0], near.shares(np.array([1]), near=0)[0]))


def associate(observations: Sequence[Observation], parameters: Parameters) -> Array:
    """(n,) int64 component of each observation under eq. association, whatever the order they come in.

    Components are numbered by their smallest (recording, frame, mask), repeats by what they say. Raises ValueError on
    features of unlike length.
    """
    _check_radius(parameters.radius_m)
    if not len(observations):
        return np.zeros(0, np.int64)
    return _numbered(observations, _grown(observations, parameters))


def _grown(observations: Sequence[Observation], parameters: Parameters) -> Array:
    """(n,) component of each observation, numbered anyhow.

    A component grows from one view: all its neighbours that look alike and are not in it yet are compared with it at
    once, and of those that join the one with the least overlap, which shows most that is new, goes next. So few pairs
    are ever compared: most neighbours have joined before their turn comes. Every view has its turn against all that is
    then still outside, so each pair is decided by either direction of Omega_r.
    """
    features = _features(observations)
    near = NearShares([o.points for o in observations], parameters.radius_m, parameters.voxel_m)
    boxes = TouchingBoxes(near.clouds.low, near.clouds.high, parameters.radius_m + ROUNDING_M)
    components, done = _Components(len(observations)), np.zeros(len(observations), bool)
    for seed in boxes.order.tolist():
        waiting = [seed]
        while waiting:
            view = waiting.pop()
            if done[view]:
                continue
            done[view] = True
            others = components.outside(view, boxes.of(view))
            others = others[_alike(features[others], features[view], parameters.tau_v)]
            if not len(others):
                continue
            shares = near.shares(of=others, near=view)
            joining = np.flatnonzero(shares >= parameters.tau_g)
            components.join(view, others[joining])
            waiting += others[joining[np.argsort(-shares[joining], kind="stable")]].tolist()
    return components.label


def _features(observations: Sequence[Observation]) -> Array:
    """(n, d) float32; raises ValueError on features of unlike length."""
    width = len(observations[0].feature)
    for o in observations:
        if len(o.feature) != width:
            raise ValueError(f"Features should all have {width} numbers, got one of {len(o.feature)}.")
    return np.array([o.feature for o in observations])


def _alike(others: Array, feature: Array, tau_v: float) -> Array:
    """(k,) bool: the cosine of (k, d) features with (d,) one is at least tau_v; near it float64 decides."""
    least = tau_v - ROUNDING_COSINE
    cosines = (others @ feature).astype(np.float64)
    close = np.abs(cosines - least) <= len(feature) * np.finfo(np.float32).eps  # what float32 may be off at most
    cosines[close] = others[close].astype(np.float64) @ feature.astype(np.float64)
    return cosines >= least


def _numbered(observations: Sequence[Observation], components: Array) -> Array:
    """The components by the rank of their least observation in canonical order."""
    first: dict[int, tuple[tuple[str, int, int], bytes]] = {}
    for component, order in zip(components.tolist(), _orders(observations), strict=True):
        first[component] = min(first.get(component, order), order)
    rank = {component: label for label, component in enumerate(sorted(first, key=first.__getitem__))}
    return np.array([rank[component] for component in components.tolist()], dtype=np.int64)


def _orders(observations: Sequence[Observation]) -> Iterator[tuple[tuple[str, int, int], bytes]]:
    """The canonical order of each observation; what it says is only hashed where its key is repeated."""
    times = Counter(o.key for o in observations)
    return ((o.key, o.digest if times[o.key] > 1 else b"") for o in observations)


class _Components:
    """label: (n,) int64, equal within a component."""

    def __init__(self, count: int) -> None:
        self.label = np.arange(count)
        self._members = [[i] for i in range(count)]

    def outside(self, view: int, others: Array) -> Array:
        return others[self.label[others] != self.label[view]]

    def join(self, view: int, others: Array) -> None:
        """The smaller component takes the larger one's label: none is relabelled more than log n times."""
        for label in np.unique(self.label[others]).tolist():
            small, large = sorted((label, int(self.label[view])), key=lambda each: len(self._members[each]))
            self.label[self._members[small]] = large
            self._members[large] += self._members[small]
            self._members[small] = []


@dataclass(frozen=True)
class ExtentAlarm:
    """A component larger than its members explain: reported, never silently split."""

    label: int
    extent_m: float
    because: str


def extent_alarms(observations: Sequence[Observation], labels: Array, parameters: Parameters) -> list[ExtentAlarm]:
    """Components longer than `extent_alarm_m`, or than `extent_alarm_ratio` times their median member."""
    alarms = []
    for label in np.unique(labels).tolist():
        members = [observations[i] for i in np.flatnonzero(np.asarray(labels) == label).tolist()]
        lows, highs = np.array([bounds(o.points) for o in members]).swapaxes(0, 1)
        extent = float((highs.max(axis=0) - lows.min(axis=0)).max())
        if because := _too_long(extent, float(np.median((highs - lows).max(axis=1))), parameters):
            alarms.append(ExtentAlarm(label, extent, because))
    return alarms


def _too_long(extent: float, median: float, parameters: Parameters) -> str | None:
    if extent > parameters.extent_alarm_m:
        return f"{extent:.1f} m long, over {parameters.extent_alarm_m:g} m"
    if extent > parameters.extent_alarm_ratio * median:
        return f"{extent:.1f} m long where the median of its masks is {median:.1f} m"
    return None


def _check_radius(radius: Any) -> None:
    if not (isinstance(radius, int | float | np.number) and np.isfinite(radius) and radius > 0):
        raise ValueError(f"The overlap radius should be a finite number of metres above 0, got {radius!r}.")
