"""Which observations are of one object: overlap, vetoed by appearance, and connected components (eq. association)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from openbelief.arrays import Array, points_array
from openbelief.evidence import digest
from openbelief.observation import Observation
from openbelief.parameters import Parameters

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

ROUNDING_M = 1e-6  # float32 coordinates exactly r apart are within r
ROUNDING_COSINE = 1e-6


def overlap(P: Array, Q: Array, radius: float) -> float:
    """Omega_r: the larger of the shares of P within r of Q and of Q within r of P.

    P, Q: (n, 3) float32, map frame, metres, taken as given. Symmetric, in [0, 1]. Raises ValueError on bad input.
    """
    _check_radius(radius)
    p, q = _Cloud(points_array(P, "P")), _Cloud(points_array(Q, "Q"))
    return max(p.share_near(q, radius), q.share_near(p, radius))


def associate(observations: Sequence[Observation], parameters: Parameters) -> Array:
    """(n,) int64 component of each observation under eq. association, whatever the order they come in.

    Components are numbered by their smallest (recording, frame, mask), repeats by what they say. Raises ValueError on
    features of unlike length.
    """
    association = Association(parameters)
    for observation in observations:
        association.add(observation)
    return association.labels()


class Association:
    """The components so far; `add` in any order gives the same components as all at once."""

    def __init__(self, parameters: Parameters) -> None:
        _check_radius(parameters.radius_m)
        self._parameters = parameters
        self._observations: list[Observation] = []
        self._clouds: list[_Cloud] = []
        self._parent: list[int] = []
        self._boxes = _Rows(6)
        self._features: _Rows | None = None

    def add(self, observation: Observation) -> None:
        """Link one more observation to those it is related to."""
        cloud = _Cloud(observation.points)
        for other in self._candidates(cloud, observation.feature):
            if self._root(other) != self._root(len(self._clouds)) and self._overlaps(cloud, self._clouds[other]):
                self._parent[self._root(other)] = self._root(len(self._clouds))
        self._clouds.append(cloud)
        self._observations.append(observation)

    def labels(self) -> Array:
        """(n,) int64, one per observation in the order they were added."""
        first: dict[int, tuple[tuple[str, int, int], bytes]] = {}
        for index, order in enumerate(self._orders()):
            root = self._root(index)
            first[root] = min(first.get(root, order), order)
        rank = {root: label for label, root in enumerate(sorted(first, key=first.__getitem__))}
        return np.array([rank[self._root(i)] for i in range(len(self._observations))], dtype=np.int64)

    def _orders(self) -> Iterator[tuple[tuple[str, int, int], bytes]]:
        """The canonical order of each observation; what it says is only hashed where its key is repeated."""
        times = Counter(o.key for o in self._observations)
        return ((o.key, digest(o) if times[o.key] > 1 else b"") for o in self._observations)

    def _candidates(self, cloud: _Cloud, feature: Array) -> list[int]:
        """Earlier observations whose boxes, grown by r, touch this one's and whose features pass tau_v."""
        features = self._features = self._features or _Rows(len(feature))
        if features.width != len(feature):
            raise ValueError(f"Features should all have {features.width} numbers, got one of {len(feature)}.")
        reach = self._parameters.radius_m + ROUNDING_M
        boxes = self._boxes.rows
        touch = (boxes[:, :3] <= cloud.high + reach).all(axis=1) & (boxes[:, 3:] >= cloud.low - reach).all(axis=1)
        near = np.flatnonzero(touch)
        cosines = features.rows[near] @ feature.astype(np.float64)
        self._boxes.append(np.concatenate((cloud.low, cloud.high)))
        features.append(feature)
        self._parent.append(len(self._parent))
        keep = cosines >= self._parameters.tau_v - ROUNDING_COSINE
        return near[keep][np.argsort(-cosines[keep], kind="stable")].tolist()

    def _overlaps(self, p: _Cloud, q: _Cloud) -> bool:
        """Omega_r >= tau_g, the second direction only where the first does not decide."""
        radius, tau_g = self._parameters.radius_m, self._parameters.tau_g
        return p.share_near(q, radius, tau_g) >= tau_g or q.share_near(p, radius, tau_g) >= tau_g

    def _root(self, index: int) -> int:
        while self._parent[index] != index:
            self._parent[index] = index = self._parent[self._parent[index]]
        return index


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
        lows = np.array([o.points.min(axis=0) for o in members])
        highs = np.array([o.points.max(axis=0) for o in members])
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


class _Cloud:
    """Points with their box and, once asked for, their tree."""

    def __init__(self, points: Array) -> None:
        self.points = points
        self.low, self.high = points.min(axis=0).astype(float), points.max(axis=0).astype(float)
        self._tree: cKDTree | None = None

    def share_near(self, other: _Cloud, radius: float, needed: float = 0.0) -> float:
        """The share of these points within `radius` of the other's; an upper bound where it is less than `needed`."""
        reach = radius + ROUNDING_M
        inside = ((self.points >= other.low - reach) & (self.points <= other.high + reach)).all(axis=1)
        bound = float(np.count_nonzero(inside) / len(inside))
        if bound == 0.0 or bound < needed:
            return bound
        distances, _ = other.tree.query(self.points[inside], distance_upper_bound=reach)
        return float(np.isfinite(distances).sum() / len(self.points))

    @property
    def tree(self) -> cKDTree:
        if self._tree is None:
            from scipy.spatial import cKDTree

            self._tree = cKDTree(self.points, balanced_tree=False, compact_nodes=False)
        return self._tree


class _Rows:
    """A float64 table that grows by doubling."""

    def __init__(self, width: int) -> None:
        self.width, self._count, self._table = width, 0, np.empty((16, width))

    @property
    def rows(self) -> Array:
        return self._table[: self._count]

    def append(self, row: Array) -> None:
        if self._count == len(self._table):
            self._table = np.concatenate((self._table, np.empty_like(self._table)))
        self._table[self._count] = row
        self._count += 1


def _check_radius(radius: Any) -> None:
    if not (isinstance(radius, int | float | np.number) and np.isfinite(radius) and radius > 0):
        raise ValueError(f"The overlap radius should be a finite number of metres above 0, got {radius!r}.")
